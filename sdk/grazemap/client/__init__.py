"""The clients, asynchronous and blocking: requests and results over HTTP.

`async_client.py`, `jobs.py` and `watch.py` are written once, as coroutines over a connection. `blocking.py` derives the
blocking client from them, and `process_methods.py` derives the methods of processes from the models of requests. `make
tables` writes `client.pyi` and `methods.pyi`, which editors and mypy read.
"""

from grazemap.client.async_client import AsyncClient
from grazemap.client.client import Client

__all__ = ["AsyncClient", "Client"]
