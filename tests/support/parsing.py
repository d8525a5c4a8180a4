"""How often requests are parsed and canonicalised."""

from __future__ import annotations

from typing import Any

import pytest

from grazemap.wire import ProcessRequest


def count(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Return counts that grow from now on: of stored requests that are parsed, and of requests written canonically."""
    counts = {"parsed": 0, "canonicalised": 0}
    validate, dump = ProcessRequest.model_validate.__func__, ProcessRequest.model_dump  # type: ignore[attr-defined]

    def counted_validate(cls: type[ProcessRequest], *args: Any, **settings: Any) -> Any:
        counts["parsed"] += 1
        return validate(cls, *args, **settings)

    def counted_dump(self: ProcessRequest, **settings: Any) -> Any:
        counts["canonicalised"] += 1
        return dump(self, **settings)

    monkeypatch.setattr(ProcessRequest, "model_validate", classmethod(counted_validate))
    monkeypatch.setattr(ProcessRequest, "model_dump", counted_dump)
    return counts
