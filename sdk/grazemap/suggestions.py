"""Suggestions of a known name for an unknown one."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

LONGEST_NAME = 64
"""All known names are much shorter, and the comparison of longer names takes time."""


def suggestion(unknown: str, known: Iterable[str]) -> str:
    """Return a suggestion of a known name for an unknown one, or "" where none is similar.

    The hyphens with which all flags begin make no names similar.
    """
    names = {name.lstrip("-"): name for name in known}
    near = get_close_matches(unknown.lstrip("-"), names, n=1) if len(unknown) <= LONGEST_NAME else []
    return f"; did you mean {names[near[0]]}" if near else ""
