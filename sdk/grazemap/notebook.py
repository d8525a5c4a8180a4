"""What is shown below the cell of a notebook."""

from __future__ import annotations

import sys
from typing import Any


def runs_in_notebook() -> bool:
    """Return whether this runs in a notebook's kernel."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return getattr(shell, "kernel", None) is not None


class NotebookDisplay:
    """An output below a notebook's cell. It is emptied at the end, so that a saved notebook does not contain it.

    A widget of `tqdm.auto` would remain in a saved notebook, as the text of its first state.
    """

    def __init__(self) -> None:
        from IPython.display import display

        self._handle_class: Any = display({"text/html": ""}, raw=True, display_id=True)

    def update(self, html: str) -> None:
        """Show HTML in place of what was shown before."""
        self._handle_class.update({"text/html": html}, raw=True)
