"""The bytes of results do not change without a change of version."""

from __future__ import annotations

import numpy as np
import pytest

from tests import result_digests


def test_bytes_change_only_with_the_version() -> None:
    version, key = result_digests.core_version(), result_digests.platform_key()
    record = result_digests.recorded().get(version, {})
    assert record, f"nothing is recorded for version {version}: make digests"
    if key not in record:
        pytest.skip(f"no digests of version {version} are recorded for {key}: make digests")
    names = result_digests.changed(record, key, result_digests.compute())
    assert names == [], "the bytes changed: change the version in pyproject.toml, then make digests"


def test_this_version_has_the_bytes_of_the_one_before_but_for_previews() -> None:
    """Where both were recorded: 0.2.0 moved and renamed everything, and computes the same."""
    record, key = result_digests.recorded(), result_digests.platform_key()
    before, now = record["0.1.0"].get(key), record["0.2.0"].get(key)
    if before is None or now is None:
        pytest.skip(f"no digests of both versions are recorded for {key}")
    assert [name for name in now if before[name] != now[name]] == ["preview of a map"]


def test_a_changed_bit_is_detected_and_a_changed_name_is_not() -> None:
    arrays = {"verified": np.arange(3.0), "period": np.arange(4)}
    digest = result_digests.digest(arrays.values())
    assert result_digests.digest([arrays["period"], arrays["verified"]]) == digest
    record = {"here": {"map": digest}}
    assert result_digests.changed(record, "here", {"map": digest}) == []
    arrays["verified"][1] = np.nextafter(1.0, 2.0)
    assert result_digests.changed(record, "here", {"map": result_digests.digest(arrays.values())}) == ["map"]
    assert result_digests.changed(record, "here", {}) == ["map"]


def test_the_digest_depends_on_types_and_shapes() -> None:
    alone = {result_digests.digest([array]) for array in (np.zeros(4), np.zeros((2, 2)), np.zeros(4, dtype=np.int64))}
    assert len(alone) == 3
