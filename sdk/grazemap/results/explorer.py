"""The page of a service as a notebook or a terminal shows it."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape


@dataclass(frozen=True, slots=True)
class ExplorerPage:
    """A view of a service's page: below a notebook's cell the page itself, elsewhere its address.

    The page is that of the service, which must run as long as one looks at it.
    """

    url: str
    """Its address."""
    height: int
    """Its height in a notebook, in pixels; it is as wide as the notebook."""

    def __str__(self) -> str:
        return self.url

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.url}>"

    def _repr_html_(self) -> str:
        address = escape(self.url, quote=True)
        return (
            f"<iframe src='{address}' title='grazemap' allow='clipboard-write' "
            f"style='width:100%;height:{self.height}px;border:0'></iframe>"
            f"<div><a href='{address}' target='_blank' rel='noopener'>{address}</a></div>"
        )
