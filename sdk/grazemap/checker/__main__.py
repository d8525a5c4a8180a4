"""Verifies the certificate on the standard input: `python -m grazemap.checker`.

The certificate may be the text in a result of proofs. The answer on the standard output is JSON: `outcome`, which is
"verified", "refused", "undecided" or "no certificate", and with it a `reason`, or the parts of a verdict.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from grazemap.checker import check
from grazemap.checker.arithmetic import Refused
from grazemap.checker.reading import decoded


def answer(data: bytes) -> dict[str, Any]:
    """Return the answer for the content of a file."""
    try:
        document = decoded(data)
        if isinstance(document, dict) and isinstance(document.get("certificate"), str):
            document = decoded(document["certificate"])
    except Refused as refused:
        return {"outcome": "no certificate", "reason": str(refused)}
    parts = {"statement": dict, "verdict": str}
    if not (isinstance(document, dict) and all(isinstance(document.get(x), kind) for x, kind in parts.items())):
        return {"outcome": "no certificate", "reason": "it has no statement or no verdict"}
    if document.get("verdict") == "undecided":
        return {"outcome": "undecided"}
    verdict = check(document)
    if not verdict.accepted:
        return {"outcome": "refused", "reason": verdict.reason}
    return {"outcome": "verified", **verdict._asdict()}


MAX_MEMORY = 8 << 30
"""Maximum bytes of memory for the arithmetic, where the system can limit them."""


def limit_memory() -> None:
    """Limit what this process may allocate (not on Windows)."""
    try:
        import resource
    except ImportError:
        return
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    most = MAX_MEMORY if hard == resource.RLIM_INFINITY else min(MAX_MEMORY, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


if __name__ == "__main__":
    limit_memory()
    sys.stdout.write(json.dumps(answer(sys.stdin.buffer.read())))
