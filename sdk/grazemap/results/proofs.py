"""Proofs: certificates that the checker verifies."""

from __future__ import annotations

import json
from typing import Any

from grazemap.results.base import Result


class Proof(Result):
    """The proof or the disproof of a statement, as a certificate.

    `document` is the certificate as a dict, and `enclosures` is what the checker shows besides the statement: decimals
    with their radii. A result saved as .json is a file for `grazemap check`.
    """

    kind: str
    verdict: str
    reason: str | None
    limited: bool
    certificate: str
    shown: str

    @property
    def document(self) -> dict[str, Any]:
        """The certificate."""
        document: dict[str, Any] = json.loads(self.certificate)
        return document

    @property
    def enclosures(self) -> dict[str, Any]:
        """The enclosures, by name; empty if the statement is undecided."""
        enclosures: dict[str, Any] = json.loads(self.shown)
        return enclosures

    def _summary(self) -> str:
        return f"{self.kind}, {self.verdict}" + (f": {self.reason}" if self.reason else "")
