"""The clients, blocking and asynchronous: questions in, results out, over HTTP."""

from grazemap.client.async_client import AsyncClient
from grazemap.client.client import Client

__all__ = ["AsyncClient", "Client"]
