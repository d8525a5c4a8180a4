"""What lanes share, and what every lane has for itself, is looked up in the same way."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest

from grazemap_core.arrays import Floats, Integers
from grazemap_core.numerics.jit.by_lane import at, of_lanes, put, record_of, store, table_of
from grazemap_core.numerics.jit.by_reference import reference
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.jit.inlining import PART_COMPILER

PITCH = 4
SHARED, OWN = np.array([2.0, 3.0]), np.array([[1.0, 2.0, 3.0, 0.0], [5.0, 7.0, 11.0, 0.0]])


class Tables(NamedTuple):
    """Tables of all lanes."""

    numbers: Floats
    count: int


class Record(NamedTuple):
    """A lane's record."""

    numbers: Floats
    tables: Tables
    weight: float


class Records(NamedTuple):
    """The fields that `record_of` needs."""

    shared: Record
    addresses: Integers


class OwnTables(NamedTuple):
    """The field that `table_of` needs."""

    number: int
    tables: tuple[Tables, ...]


@kernel
def sum_up(table: Floats, lanes: int, sums: Floats) -> None:
    for place in range(sums.shape[0]):
        row, sums[place] = of_lanes(table, place, PITCH), 0.0
        for lane in range(lanes):
            sums[place] += at(row, lane)


@kernel
def overwrite(table: Floats, place: int, lane: int, number: float) -> None:
    put(table, place, PITCH, lane, number)


@kernel
def weighed(records: Records, lane: int) -> float:
    record = record_of(records, lane)
    weighed: float = record.weight * record.numbers[0]
    return weighed


@kernel
def second_of(own: OwnTables, records: Records, lane: int) -> float:
    own, records = reference(own), reference(records)
    return at(of_lanes(table_of(own, 1, records).numbers, 1, PITCH), lane)


def record(first: float) -> Record:
    return Record(np.array([first, 0.0]), Tables(SHARED, 1), 10.0)


def test_numbers_are_those_of_all_lanes_or_of_every_lane():
    for table, expected in ((SHARED, [6.0, 9.0]), (OWN, [6.0, 23.0])):
        sums = np.empty(2)
        sum_up(table, 3, sums)
        np.testing.assert_array_equal(sums, expected)


def test_only_a_number_of_its_own_is_overwritten():
    shared, own = SHARED.copy(), OWN.copy()
    overwrite(shared, 1, 2, -1.0)
    overwrite(own, 1, 2, -1.0)
    np.testing.assert_array_equal(shared, SHARED)
    assert own[1, 2] == -1.0
    assert np.sum(own != OWN) == 1


def test_a_record_is_that_of_all_lanes_without_addresses():
    assert weighed(Records(record(3.0), np.zeros(2, dtype=np.int64)), 1) == 30.0


@pytest.mark.skipif(PART_COMPILER is None, reason="lanes share their records with this version of numba")
def test_a_record_is_the_lanes_own_where_it_has_an_address():
    stored = [record(5.0), record(7.0)]
    size = store(stored[0], 0)
    memory = np.zeros(2 * size, dtype=np.uint8)
    addresses = memory.ctypes.data + size * np.arange(2)
    for one, address in zip(stored, addresses.tolist(), strict=True):
        assert store(one, address) == size
    records = Records(record(3.0), addresses)
    assert [weighed(records, lane) for lane in (0, 1)] == [50.0, 70.0]


def test_tables_are_those_of_the_number_or_the_shared_ones():
    records = Records(record(3.0), np.zeros(2, dtype=np.int64))
    assert second_of(OwnTables(0, ()), records, 2) == SHARED[1]
    assert second_of(OwnTables(2, (Tables(0.0 * OWN, 1), Tables(OWN, 1))), records, 2) == OWN[1, 2]


@pytest.mark.parametrize(("features", "lanes"), [("+avx512f", "8"), ("", "4")])
def test_blocks_of_lanes_are_of_the_processor_that_code_is_generated_for(features: str, lanes: str) -> None:
    """Whatever this one is: kernels for x86-64-v3 that are compiled on a processor with AVX-512 are those of others."""
    code = "from grazemap_core.maps.kernels.lanes import VECTOR; print(VECTOR)"
    environment = os.environ | {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": features}
    said = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True, timeout=120)
    assert said.stdout.decode().strip() == lanes
