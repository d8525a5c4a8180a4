"""A data folder that version 0.1.0 wrote, as `grazemap up --data` keeps it.

Its jobs, in the order of their submission: a grazing curve that was computed, an unfolding map that waits in the queue,
one that a worker had begun when it was killed, and a grazing curve that was dismissed.
"""

from __future__ import annotations

import tarfile
from pathlib import Path

FINISHED = "09582e3d80caa1561a79ccaf0435804ca92fd7cf673a38ba068fde69bd67031f"
QUEUED = "521352e89604f95a9bfd240e263fa29591a1ffd77583ce644facdf772038ef79"
BEGUN = "bd02493ac4c2da0fc6fc4119614cf34725a5288574e8d1859f0e4ec13b02c320"
DISMISSED = "628982c47d8e36b1d8a4cca8123a59b8b0a3899574cf0817b43c6be4695c787a"
PREFIX = "grazemap:"
"""Of the keys of its layout."""


def unpack(folder: Path) -> Path:
    """Unpack the data folder into `folder`, which it returns."""
    with tarfile.open(Path(__file__).parent / "data" / "folder-0.1.0.tar.xz") as archive:
        # the filter of archives is missing before Python 3.11.4
        archive.extraction_filter = getattr(tarfile, "data_filter", lambda member, path: member)
        archive.extractall(folder)
    return folder
