"""The register of pictures. Modules of `grazemap.plots` add functions that draw results, and methods look them up."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache
from importlib import import_module
from inspect import Parameter
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, Literal, TypedDict, TypeVar, get_args

from grazemap.constants import ENGINEERING_UNITS, PICTURE_STYLES, PictureStyle
from grazemap.errors import MissingExtra

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results.base import Result

LegendPlace = Literal["outside", "inside", "none"]

A = TypeVar("A")
F = TypeVar("F", bound=Callable[..., Any])

PICTURES: dict[tuple[type[Result], str], Callable[..., Any]] = {}
"""The functions that draw results, by class and method.

They take the result, ax, the arguments of the drawing, the style and further keywords.
"""


class PictureOptions(TypedDict, total=False):
    """The keywords of every picture."""

    legend: LegendPlace | None
    """Where the legend is."""
    labels: bool
    """Whether there are a title and texts of the axes."""
    engineering_units: bool
    """Whether frequencies are in Hz and lengths in mm, whatever the `shown_units` of the result. Axes that have a
    picture keep their units."""
    style: PictureStyle
    """"screen", or "column": a figure for a column of a journal, 3.4 inches wide."""


_DEFAULTS: PictureOptions = {"legend": None, "labels": True, "engineering_units": False, "style": PICTURE_STYLES[0]}


def picture(method: F) -> F:
    """Show the keywords of every picture in the signature of a method, where it has ``**options`` in the source."""
    signature = inspect.signature(method)
    *own, _ = signature.parameters.values()
    for name, default in _DEFAULTS.items():
        annotation = PictureOptions.__annotations__[name].__forward_arg__
        own.append(Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation))
    method.__signature__ = signature.replace(parameters=own)  # type: ignore[attr-defined]
    return method


def draw(result: Result, ax: A | Axes | None, options: PictureOptions, method: str = "plot", **arguments: object) -> A:
    """Draw the picture of a method of a result, on the given axes or those of a new figure, and return the axes.

    `arguments` are the arguments of the method that not every picture has. Raises TypeError for an unknown option,
    ValueError for an unknown place of the legend, an unknown style or engineering units of a nondimensional result, and
    MissingExtra.
    """
    for name in options:
        if name not in _DEFAULTS:
            raise TypeError(f"{type(result).__name__}.{method}() got an unexpected keyword argument {name!r}")
    every = _DEFAULTS | options
    if every["legend"] not in (None, *get_args(LegendPlace)):
        raise ValueError(f"legend must be {', '.join(get_args(LegendPlace))} or None, not {every['legend']!r}")
    if every["style"] not in PICTURE_STYLES:
        raise ValueError(f"style must be {' or '.join(PICTURE_STYLES)}, not {every['style']!r}")
    shown = result.in_units(*ENGINEERING_UNITS) if every["engineering_units"] else result
    plots()
    place = {"legend": every["legend"], "labels": every["labels"], "shown_units": shown.shown_units}
    drawn: A = PICTURES[type(result), method](shown, ax, place, style=every["style"], **arguments)
    return drawn


@cache
def plots() -> Any:
    """Return the package of pictures, after its modules have registered what they draw. Raises MissingExtra."""
    try:
        package = import_module("grazemap.plots")
        for module in iter_modules(package.__path__, f"{package.__name__}."):
            import_module(module.name)
    except ImportError as error:
        if (error.name or "").partition(".")[0] == "grazemap":
            raise
        raise MissingExtra("a picture", "plot") from error
    return package
