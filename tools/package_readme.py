"""The README as package indexes show it: a hook of hatchling, which takes the description of the package from it.

The addresses in README.md are those of files beside it, which an index does not have. There is no public copy of the
repository to link to, so these links are left out, and so are pictures; the source distribution has the files.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_NO_ADDRESS = r"\((?![a-z]+:|#)[^)]*\)"
_PICTURE = re.compile(rf"^!\[[^\]]*\]{_NO_ADDRESS}\n\n", re.MULTILINE)
_LINK = re.compile(rf"\[([^\]]*)\]{_NO_ADDRESS}")
_WHERE = "\nThe documents that are named here are in the folder `docs` of the source distribution.\n"


def description(readme: str) -> str:
    """Return the text of the README without links and pictures that lead to files beside it."""
    return _LINK.sub(r"\1", _PICTURE.sub("", readme)) + _WHERE


class PackageReadme(MetadataHookInterface):
    """Sets the field `readme` of the project."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the field."""
        text = description((Path(self.root) / "README.md").read_text("utf-8"))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
