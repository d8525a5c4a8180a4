"""The attributes in the docstrings of results and records, from their schemas."""

from __future__ import annotations

from textwrap import dedent, fill, indent

from grazemap.schema import Field, Record


def with_attributes(docstring: str, record: Record) -> str:
    """Return a docstring with the section Attributes."""
    summary, _, rest = docstring.partition("\n")
    parts = [summary, "", "Attributes", "----------"]
    for one in record:
        if not one.replaces and one.name != "at_computed":
            parts += [f"{one.name} : {_type(one)}", indent(fill(_text(one), 108), "    ")]
    return "\n".join(parts) + (f"\n\n{dedent(rest).strip()}\n" if rest.strip() else "\n")


def _type(one: Field) -> str:
    name = one.type.name if isinstance(one.type, Record) else one.type if isinstance(one.type, str) else "dict"
    if one.dims:
        listed = one.texts or isinstance(one.type, Record)
        shape = f"({', '.join(one.dims)}{',' * (len(one.dims) == 1)})"
        name = f"tuple of {name}" if listed else f"ndarray of {name}, shape {shape}"
    return f"{name}, or None" if one.optional or (one.null and not one.dims and name != "float") else name


def _text(one: Field) -> str:
    unit = f" {one.unit} in SI." if one.unit else ""
    when = f" Only {one.when}." if one.when else ""
    index = f" Position in `{one.index_of}`." if one.index_of else ""
    return one.description + index + unit + when
