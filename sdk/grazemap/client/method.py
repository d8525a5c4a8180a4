"""Methods that are written once and that both clients have."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from functools import wraps
from inspect import signature
from types import MethodType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

from grazemap.results import Result
from grazemap.wire import ProcessRequest

P = ParamSpec("P")
R = TypeVar("R", bound=Result)


@dataclass(frozen=True)
class Question(Generic[R]):
    """A request, the class of the result that answers it, and whether progress is shown."""

    result: type[R]
    request: ProcessRequest
    progress: bool


class Blocking:
    """The base of the client whose methods return results."""

    def _answer(self, question: Question[R]) -> R:
        raise NotImplementedError


class Awaited:
    """The base of the client whose methods are awaited."""

    async def _answer(self, question: Question[R]) -> R:
        raise NotImplementedError


class method(Generic[P, R]):
    """A method of both clients, from a function that returns the question: it returns the result, or is awaited."""

    def __init__(self, ask: Callable[Concatenate[Any, P], Question[R]]) -> None:
        @wraps(ask)
        def blocking(client: Blocking, *args: P.args, **kwargs: P.kwargs) -> R:
            return client._answer(ask(client, *args, **kwargs))

        @wraps(ask)
        async def awaited(client: Awaited, *args: P.args, **kwargs: P.kwargs) -> R:
            return await client._answer(ask(client, *args, **kwargs))

        answer = ask.__annotations__["return"].removeprefix("Question[").removesuffix("]")
        functions: tuple[Any, ...] = (blocking, awaited)
        for function in functions:
            function.__annotations__ = {**ask.__annotations__, "return": answer}
            function.__signature__ = signature(ask).replace(return_annotation=answer)
        blocking.__doc__ = (ask.__doc__ or "").replace("await client.", "client.")
        self._blocking, self._awaited = blocking, awaited

    @overload
    def __get__(self, client: Blocking, owner: type) -> Callable[P, R]: ...

    @overload
    def __get__(self, client: Awaited, owner: type) -> Callable[P, Coroutine[Any, Any, R]]: ...

    @overload
    def __get__(self, client: None, owner: type) -> Callable[..., Any]: ...

    def __get__(self, client: Any, owner: type) -> Callable[..., Any]:
        """Return the method of a client, or the function of its class."""
        function: Callable[..., Any] = self._blocking if issubclass(owner, Blocking) else self._awaited
        return function if client is None else MethodType(function, client)
