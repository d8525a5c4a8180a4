"""The clients, blocking and asynchronous: requests and results over HTTP.

`methods.py` has the methods that both clients share, one for each process. `async_client.py`, `async_jobs.py`,
`async_watch.py` and `async_connection.py` are written by hand. From them `make client` generates the blocking modules
`client.py`, `jobs.py`, `watch.py` and `connection.py`.
"""

from grazemap.client.async_client import AsyncClient
from grazemap.client.client import Client

__all__ = ["AsyncClient", "Client"]
