"""The HTML that notebooks show for results, jobs and clients: a small picture and a table. No request is sent."""

from __future__ import annotations

import base64
import io
import logging
from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.errors import MissingExtra
from grazemap.results.pictures import plots
from grazemap.results.record import changed
from grazemap.wire import Oscillator

if TYPE_CHECKING:
    from grazemap.results.base import Result

_DOTS_PER_INCH = 70
_MAX_DRAWN = {"vertical": 400, "horizontal": 400, "time": 20_000}


def table(title: str, rows: Mapping[str, Any], picture: str = "") -> str:
    """Return a title, a picture and a table of two columns as HTML; rows without a value are left out."""
    cells = "".join(
        f"<tr><th style='text-align:left'>{escape(name)}</th><td style='text-align:left'>{escape(str(value))}</td></tr>"
        for name, value in rows.items()
        if value not in (None, "")
    )
    return (
        f"<div><b>{escape(title)}</b></div>"
        f"<div style='display:flex;gap:1em;align-items:flex-start'>{picture}<table>{cells}</table></div>"
    )


def result_html(result: Result, summary: str) -> str:
    """Return a result as HTML."""
    request = result.meta["request"]
    rows: dict[str, Any] = {"result": summary, "units": result.units}
    shown = ("omega", "clearance", "axis", "horizontal", "vertical")
    rows |= {name: _value(request[name]) for name in shown if name in request}
    oscillator = Oscillator(**request["oscillator"])
    restitution = oscillator.restitution
    restitution_text = (
        f"{restitution:g}"
        if isinstance(restitution, float)
        else f"{restitution.right:g} right, {restitution.left:g} left"
    )
    coordinates = "masses" if oscillator.matrices is None else "coordinates"
    rows |= {"oscillator": f"{oscillator.size} {coordinates}, R = {restitution_text}"}
    rows |= {"core": result.meta.get("core_version"), "note": "; ".join(note.detail for note in result.notes)}
    return table(type(result).__name__, rows, _thumbnail(result))


def _value(value: Any) -> str:
    if isinstance(value, dict):
        if "values" in value:  # an axis
            return f"{value['vary']}: {_value(value['values'])}"
        if "start" not in value:  # clearances of the stops
            return ", ".join(f"{stop} {'absent' if gap is None else _value(gap)}" for stop, gap in value.items())
        points = f", {value['points']} points" if "points" in value else ""
        return f"{value['start']:g} to {value['stop']:g}{points}"
    if isinstance(value, list) and value:
        return f"{value[0]:g} to {value[-1]:g}, {len(value)} values"
    return f"{value:g}" if isinstance(value, float) else str(value)


def thinned(result: Result) -> Result:
    """Return a large result thinned to every n-th row, column and sample; a small result is returned itself."""
    steps: dict[str, int] = {}
    role_of = {name: role for role, name in result.roles.items()}
    for field in result.schema:
        value = getattr(result, field.name, None)
        for dim, length in zip(field.dims, np.shape(value) if isinstance(value, np.ndarray) else (), strict=False):
            role = role_of.get(dim, dim)
            steps[role] = max(1, -(-length // _MAX_DRAWN.get(role, length or 1)))
    if all(step <= 1 for step in steps.values()):
        return result
    kept = {
        field.name: getattr(result, field.name)[
            tuple(slice(None, None, steps[role_of.get(dim, dim)]) for dim in field.dims)
        ]
        for field in result.schema
        if isinstance(getattr(result, field.name, None), np.ndarray)
    }
    return changed(result, **kept)


def _thumbnail(result: Result) -> str:
    """Return a small picture as an element of HTML; empty without matplotlib, or where nothing can be drawn."""
    if not hasattr(result, "plot"):
        return ""
    data = io.BytesIO()
    try:
        small = thinned(result)
        draw_without_pyplot = plots().draw_without_pyplot
        # a large result is drawn without legend and labels, to be fast
        figure = (
            draw_without_pyplot(small) if small is result else draw_without_pyplot(small, legend="none", labels=False)
        )
        figure.savefig(data, format="png", dpi=_DOTS_PER_INCH)
    except MissingExtra:
        return ""
    except Exception:  # a display must not fail: the table is shown without a picture
        logging.getLogger(__name__).debug("no thumbnail", exc_info=True)
        return ""
    return f"<img alt='' src='data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}'>"
