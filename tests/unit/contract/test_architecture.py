"""docs/architecture.md: its picture shows the present imports, and the files that it names are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tools import house
from tools.house import House, Room

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "architecture.md").read_text("utf-8")
PACKAGES = ("sdk", "core", "worker", "service")
TODAY = house.read()


def rooms(**imports: str) -> dict[str, Room]:
    """Make the rooms of a package from `name="other another"`."""
    return {name: Room("p", name, True, frozenset(others.split())) for name, others in imports.items()}


def test_a_package_stands_above_all_that_it_imports() -> None:
    stacked = house.floors(rooms(top="middle low", middle="low", low="", beside="low"))
    assert [[room.name for room in floor] for floor in stacked] == [["low"], ["beside", "middle"], ["top"]]


def test_packages_in_a_circle_are_found_and_share_a_level() -> None:
    planted = rooms(a="b low", b="a", low="")
    assert house.circles(planted) == {"a", "b"}
    assert [[room.name for room in floor] for floor in house.floors(planted)] == [["low"], ["a", "b"]]


def test_the_picture_is_that_of_the_imports() -> None:
    assert house.PICTURE.read_text("utf-8") == house.draw(TODAY), "make house"


def test_a_new_package_and_a_new_import_change_the_picture() -> None:
    core = TODAY.rooms[house.CORE]
    for planted in (
        {**core, "new": Room(house.CORE, "new", True, frozenset({"maps"}))},
        {**core, "maps": core["maps"]._replace(imports=core["maps"].imports | {"warmup"})},
    ):
        assert house.draw(TODAY._replace(rooms={**TODAY.rooms, house.CORE: planted})) != house.draw(TODAY)


def test_an_import_against_the_order_is_refused() -> None:
    wrong = House(TODAY.rooms, {**TODAY.between, (house.CORE, house.SDK): frozenset({"wire"})})
    with pytest.raises(ValueError, match="against the direction"):
        house.draw(wrong)


def test_every_file_that_is_named_is_there() -> None:
    for path in re.findall(r"`([\w/]+\.(?:py|md|lua|svg))`", PAGE):
        assert any(list(ROOT.glob(f"{package}/grazemap*/**/{path}")) for package in PACKAGES), path
