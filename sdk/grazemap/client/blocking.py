"""Blocking classes, made of the asynchronous ones.

The coroutines of a client wait only in its connection. With a `Connection`, which blocks, a coroutine runs to its end
without an event loop: in the thread of the caller, also where a loop runs there already, as in a notebook.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Coroutine, Generator
from functools import wraps
from inspect import iscoroutinefunction, signature
from types import FunctionType
from typing import Any, TypeVar, cast

T = TypeVar("T")
# What the annotations and docstrings of the asynchronous classes have, and those of the blocking ones lack.
_ASYNCHRONOUS = ("Async", "await ", " from asyncio")


def run(coroutine: Coroutine[Any, Any, T]) -> T:
    """Return what a coroutine returns that never waits for an event loop."""
    try:
        coroutine.send(None)
    except StopIteration as end:
        return cast(T, end.value)
    coroutine.close()
    raise RuntimeError("a coroutine of a blocking client waits for an event loop")


def iterate(generator: AsyncGenerator[T]) -> Generator[T]:
    """Yield what an asynchronous generator yields that never waits for an event loop."""
    try:
        while True:
            try:
                item = run(generator.__anext__())
            except StopAsyncIteration:
                return
            yield item
    finally:
        run(generator.aclose())


def blocking(awaited: type) -> Callable[[type[T]], type[T]]:
    """Return the decorator that adds to a class what an asynchronous class has and it lacks.

    Public coroutines become functions, and asynchronous generators become generators; all else is the same.
    """

    def completed(cls: type[T]) -> type[T]:
        cls.__doc__ = _of_blocking(awaited.__doc__)
        for base in awaited.__mro__:
            if issubclass(cls, base):
                continue
            for name, value in vars(base).items():
                if name in vars(cls) or name in ("__aenter__", "__aexit__"):
                    continue
                if isinstance(value, FunctionType):
                    setattr(cls, name, _blocking(value, cls))
                elif isinstance(value, property):
                    setattr(cls, name, value)
        return cls

    return completed


def _blocking(function: FunctionType, cls: type) -> Callable[..., Any]:
    """Return a function of an asynchronous class for a blocking one."""
    if iscoroutinefunction(function) and function.__name__.startswith("_"):
        return function  # awaited by the public ones
    shown = signature(function)
    yields = str(shown.return_annotation).startswith("AsyncGenerator")

    @wraps(function)
    def called(*arguments: Any, **keywords: Any) -> Any:
        outcome = function(*arguments, **keywords)
        if yields:
            return iterate(outcome)
        return run(outcome) if iscoroutinefunction(function) else outcome

    made: Any = called
    made.__module__, made.__qualname__ = cls.__module__, f"{cls.__name__}.{function.__name__}"
    made.__doc__ = _of_blocking(function.__doc__)
    made.__annotations__ = {name: _of_blocking(text) for name, text in function.__annotations__.items()}
    parameters = [
        one.replace(annotation=made.__annotations__.get(name, one.empty)) for name, one in shown.parameters.items()
    ]
    made.__signature__ = shown.replace(parameters=parameters, return_annotation=made.__annotations__["return"])
    return called


def _of_blocking(text: str | None) -> str | None:
    for part in _ASYNCHRONOUS:
        text = text and text.replace(part, "")
    return text
