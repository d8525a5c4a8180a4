"""The client of a stack on this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grazemap.client import Client

if TYPE_CHECKING:
    from grazemap.local_stack import JoinedStack, LocalStack


class LocalClient(Client):
    """A `Client` of a stack on this machine; closing it stops the stack, unless another process uses it too."""

    def __init__(self, stack: LocalStack | JoinedStack) -> None:
        super().__init__(stack.url)
        self._stack = stack

    def close(self) -> None:
        """Close the connections and stop the stack, unless another process uses it; then leave it."""
        try:
            super().close()
        finally:
            self._stack.stop()
