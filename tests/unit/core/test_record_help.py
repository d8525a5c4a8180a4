"""The help of a record of the core lists every field with its text."""

from __future__ import annotations

import importlib
import inspect
import pickle
import pkgutil
from dataclasses import fields, is_dataclass

import grazemap_core
from grazemap_core.records import NamedTuple, dataclass


class Pair(NamedTuple):
    """Two numbers."""

    first: int
    """The first
    number."""
    second: float = 2.0
    """The second number."""


@dataclass(frozen=True)
class Base:
    """A base."""

    first: int
    """The first number."""


@dataclass(frozen=True)
class Derived(Base):
    """A derived class."""

    second: int = 2
    """The second number."""


def names_of(record: type) -> list[str]:
    return [field.name for field in fields(record)] if is_dataclass(record) else list(record._fields)


def records() -> list[type]:
    """All tuples with names and data classes of the core."""
    modules = [
        importlib.import_module(module.name)
        for module in pkgutil.walk_packages(grazemap_core.__path__, "grazemap_core.")
    ]
    classes = {
        value
        for module in modules
        for value in vars(module).values()
        if inspect.isclass(value) and value.__module__.startswith("grazemap_core.")
    }
    return [kind for kind in classes if vars(kind).keys() & {"__dataclass_fields__", "_fields"}]


def test_texts_stand_below_their_fields():
    lines = ["Two numbers.", "", "Attributes", "----------", "first : int", "    The first", "    number."]
    assert inspect.getdoc(Pair) == "\n".join([*lines, "second : float", "    The second number."])
    assert inspect.getdoc(Pair(1)) == inspect.getdoc(Pair)


def test_all_records_list_their_fields():
    helps = {record: record.__doc__ or "" for record in [*records(), Derived]}  # made from the source at every access
    assert len(helps) > 150
    lacking = [
        (record.__name__, name)
        for record, text in helps.items()
        for name in names_of(record)
        if f"\n{name} : " not in text
    ]
    assert lacking == []


def test_a_record_without_a_source_has_its_docstring_alone():
    space: dict[str, type] = {"NamedTuple": NamedTuple, "__name__": "nowhere"}
    exec('class Made(NamedTuple):\n    """Made."""\n\n    x: int\n    """The x."""\n', space)
    assert space["Made"].__doc__ == "Made."


def test_records_are_those_of_the_standard_library():
    pair = Pair(1)
    assert pickle.loads(pickle.dumps(pair)) == pair == (1, 2.0)
    assert type(Pair) is type
    assert Pair.__qualname__ == "Pair"
    assert Pair._field_defaults == {"second": 2.0}
    assert pickle.loads(pickle.dumps(Derived(1))) == Derived(1, 2)
