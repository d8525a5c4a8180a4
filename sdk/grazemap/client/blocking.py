"""Blocking classes, derived from the asynchronous ones.

The coroutines of a client wait only in its connection. A `Connection` blocks instead, so that a coroutine runs to its
end without an event loop. It runs in the thread of the caller, even if that thread already runs an event loop, as in a
notebook.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Coroutine, Generator
from functools import wraps
from inspect import iscoroutinefunction, signature
from types import FunctionType
from typing import Any, TypeVar, cast

T = TypeVar("T")
# Texts that are removed from the annotations and docstrings of the asynchronous classes.
_ASYNCHRONOUS = ("Async", "await ", " from asyncio")


def run(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine that never waits for an event loop, and return its value.

    The traceback of an interrupt ends here: where the coroutine waited helps nobody.
    """
    try:
        coroutine.send(None)
    except StopIteration as end:
        return cast(T, end.value)
    except KeyboardInterrupt as interrupt:
        raise interrupt.with_traceback(None) from None
    coroutine.close()
    raise RuntimeError("a coroutine of a blocking client waits for an event loop")


def iterate(generator: AsyncGenerator[T]) -> Generator[T]:
    """Yield the items of an asynchronous generator that never waits for an event loop."""
    try:
        while True:
            try:
                item = run(generator.__anext__())
            except StopAsyncIteration:
                return
            yield item
    finally:
        run(generator.aclose())


def blocking(asynchronous: type) -> Callable[[type[T]], type[T]]:
    """Return the decorator that adds the methods and properties of an asynchronous class which the class lacks.

    Public coroutines become functions, and asynchronous generators become generators. Other methods stay as they are.
    """

    def complete(cls: type[T]) -> type[T]:
        cls.__doc__ = _blocking_text(asynchronous.__doc__)
        for base in asynchronous.__mro__:
            if issubclass(cls, base):
                continue
            for name, value in vars(base).items():
                if name in _own_names(cls) or name in ("__aenter__", "__aexit__"):
                    continue
                if isinstance(value, FunctionType):
                    setattr(cls, name, _blocking(value, cls))
                elif isinstance(value, property):
                    setattr(cls, name, value)
        return cls

    return complete


def _own_names(cls: type) -> set[str]:
    """Return the names that a class and its bases define, apart from those of every object."""
    return {name for base in cls.__mro__ if base is not object for name in vars(base)}


def _blocking(function: FunctionType, cls: type) -> Callable[..., Any]:
    """Return the blocking form of a function of an asynchronous class."""
    if iscoroutinefunction(function) and function.__name__.startswith("_"):
        return function  # awaited by the public ones
    original = signature(function)
    yields = str(original.return_annotation).startswith("AsyncGenerator")

    @wraps(function)
    def called(*arguments: Any, **keywords: Any) -> Any:
        outcome = function(*arguments, **keywords)
        if yields:
            return iterate(outcome)
        return run(outcome) if iscoroutinefunction(function) else outcome

    method: Any = called
    method.__module__, method.__qualname__ = cls.__module__, f"{cls.__name__}.{function.__name__}"
    method.__doc__ = _blocking_text(function.__doc__)
    method.__annotations__ = {name: _blocking_text(text) for name, text in function.__annotations__.items()}
    parameters = [
        parameter.replace(annotation=method.__annotations__.get(name, parameter.empty))
        for name, parameter in original.parameters.items()
    ]
    method.__signature__ = original.replace(parameters=parameters, return_annotation=method.__annotations__["return"])
    return called


def _blocking_text(text: str | None) -> str | None:
    for part in _ASYNCHRONOUS:
        text = text and text.replace(part, "")
    return text
