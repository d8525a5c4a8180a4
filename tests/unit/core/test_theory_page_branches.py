"""The numbers of the theory page on orbits with any impacts are the computed ones, to the last printed digit."""

from __future__ import annotations

import functools

import pytest
from test_periodic_orbits import DEFAULT, default_orbit
from test_theory_page import cells

from grazemap_core.continuation.branches import orbit_branch


@functools.cache
def branch(label):
    return orbit_branch(DEFAULT, default_orbit(label), 1.3, 1.75)


@pytest.mark.parametrize(
    "label",
    [
        "1-2r-2l, NS",
        "1-2r-2l, GR",
        "1-3r-3l, SN",
        "1-3r-3l, SB",
        "3-4r-4l, SN",
        "3-4r-4l, GR",
        "5-8r-8l, GR, upper",
        "5-8r-8l, SN",
        "5-8r-8l, GR, lower",
    ],
)
def test_special_points_of_branches(label):
    motion, kind, *_ = label.split(", ")
    row = cells(label)
    points = [p for p in branch(motion).special_points if p.type == kind and p.impact is None]
    near = [p for p in points if f"{p.clearance:.12f}" == row[0]]
    assert len(near) == 1, points
    assert row[1] == ("yes" if near[0].admissible else "no")
    # the ends of the interval in which it is a motion are all there
    if kind == "GR":
        assert len([p for p in points if p.admissible]) == (2 if motion == "5-8r-8l" else 1)
