"""Proofs: certificates that the checker verifies."""

from __future__ import annotations

import json
from typing import Any

from grazemap.results.base import Result


class Proof(Result):
    """The proof or the disproof of a statement, as a certificate.

    `document` is the certificate as a dict, and `enclosures` is what was computed in it: decimals with their radii. A
    result saved as .json is a file for `grazemap check`.
    """

    kind: str
    verdict: str
    reason: str | None
    certificate: str

    @property
    def document(self) -> dict[str, Any]:
        """The certificate."""
        found: dict[str, Any] = json.loads(self.certificate)
        return found

    @property
    def enclosures(self) -> dict[str, Any]:
        """The enclosures in the certificate, by name; empty if it is undecided."""
        found: dict[str, Any] = self.document["enclosures"]
        return found

    def _summary(self) -> str:
        return f"{self.kind}, {self.verdict}" + (f": {self.reason}" if self.reason else "")
