"""Proofs: certificates that the checker verifies."""

from __future__ import annotations

import json
from typing import Any

from grazemap.results.base import Result
from grazemap.results.record import field


class Proof(Result, process="proofs"):
    """The proof or the disproof of a statement, as a certificate."""

    kind: str = field("What is stated.", values=("orbit", "attraction", "bifurcation", "codimension-two"))
    verdict: str = field(
        "proven or disproven, if the checker accepts the certificate; else undecided.",
        values=("proven", "disproven", "undecided"),
    )
    reason: str | None = field("Why it is undecided, and at which precision or limit of time.")
    limited: bool = field(
        "Whether the limit of time ended the search; then it is made again when it is asked for again."
    )
    certificate: str = field("The certificate, as JSON.", variable=None)
    shown: str = field("What the checker shows besides the statement, by name, as JSON.", variable=None)

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
