"""The client of a stack on this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grazemap.client import Client
from grazemap.results import html

if TYPE_CHECKING:
    from grazemap.local_stack import JoinedStack, LocalStack

_REMOVED = "removed when the stack ends (data=FOLDER keeps them)"


class LocalClient(Client):
    """A `Client` of a stack on this machine; closing it stops the stack, unless another process uses it too."""

    def __init__(self, stack: LocalStack | JoinedStack) -> None:
        self._stack = stack
        try:
            # the stack has no keys, and that of the environment is for another service
            super().__init__(stack.url, api_key="")
        except BaseException:
            stack.stop()
            raise

    def __repr__(self) -> str:
        kept = f", results are {_REMOVED}" if self._stack.temporary else ""
        return f"<{type(self).__name__} of {self.base_url}{kept}>"

    def _repr_html_(self) -> str:
        kept = {"results": _REMOVED} if self._stack.temporary else {}
        return html.table(type(self).__name__, {"service": self.base_url, **kept})

    def close(self) -> None:
        """Close the connections and stop the stack, unless another process uses it; then leave it."""
        try:
            super().close()
        finally:
            self._stack.stop()
