"""The blocking client and its job handles, derived from the asynchronous classes; editors read `client.pyi`."""

from __future__ import annotations

from typing import Self

from grazemap.client.async_client import AsyncClient
from grazemap.client.blocking import blocking
from grazemap.client.connection import Connection
from grazemap.client.jobs import AsyncJobHandle
from grazemap.client.methods import Methods


@blocking(AsyncJobHandle)
class JobHandle:  # noqa: D101 - its docstring is made too
    pass


@blocking(AsyncClient)
class Client(Methods):  # noqa: D101 - its docstring is made too
    _connection_class, _handle_class = Connection, JobHandle

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
