"""Changes to numba that cut its time by a quarter, for processes that only compile; what is compiled is the same.

Half of numba's time goes into finding types. What takes time, and what `hurry` does about it:

- for every product of two numbers some ten templates are tried anew: the type of a call is kept;
- at every template all options of compilation are compared: only those that are set are;
- after each pass the variables of every instruction are listed again: they are found by the types of its fields;
- listeners measure the time of each pass, which nobody reads: events are not sent to them;
- Python's garbage collector runs often and finds little: it runs rarely.

It changes functions of numba, so it is for `warmup`, not for a process in which a user's functions are compiled. With a
version of numba whose private interface is not known, it does nothing.
"""

from __future__ import annotations

import gc
from typing import Any

from grazemap_core.numerics.jit.compiled import PART_COMPILER

# Thresholds of `gc.set_threshold`: the collector runs rarely, and the memory grows by one in thirty.
_GARBAGE = (100_000, 50, 1000)


def hurry() -> None:
    """Have this process compile more quickly, until it ends."""
    if PART_COMPILER is None:
        return
    gc.set_threshold(*_GARBAGE)
    _compare_what_is_set()
    _keep_call_types()
    _list_variables_by_type()
    _tell_nobody()


def _compare_what_is_set() -> None:
    """Compare two settings by the options that at least one of them sets, instead of by all options."""
    from numba.core.targetconfig import TargetConfig

    by_option: Any = TargetConfig.__eq__

    def equal(config: Any, other: Any) -> Any:
        if type(config) is not type(other):
            return by_option(config, other)
        ours, theirs = config._values, other._values
        return ours == theirs or all(getattr(config, name) == getattr(other, name) for name in {**ours, **theirs})

    # numba hashes the names of all options, which are the same for all settings of a type: the type is enough
    TargetConfig.__eq__, TargetConfig.__hash__ = equal, lambda config: hash(type(config))  # type: ignore[method-assign]


def _keep_call_types() -> None:
    """Keep the type that numba finds for a call of one of its functions, for each set of arguments and settings."""
    from numba.core.targetconfig import ConfigStack
    from numba.core.types.functions import BaseFunction

    call_types: dict[Any, tuple[Any, Any]] = {}
    find = BaseFunction.get_call_type

    def get_call_type(function: Any, context: Any, args: Any, kws: Any) -> Any:
        settings = ConfigStack.top_or_none()
        key = function, context, tuple(args), tuple(kws.items()), settings
        if key not in call_types:
            signature = find(function, context, args, kws)
            call_types[*key[:-1], settings and settings.copy()] = signature, function.get_impl_key(signature)
        signature, implementation = call_types[key]
        function._impl_keys[signature.args] = implementation  # set at every call, as it depends on the settings
        return signature

    BaseFunction.get_call_type = get_call_type  # type: ignore[method-assign, assignment]


def _list_variables_by_type() -> None:
    """Find the variables in an instruction without examining its strings, numbers and places in the source."""
    from numba.core import ir

    by_class: Any = ir.Inst._rec_list_vars
    without = {str, int, float, bool, type(None), ir.Loc, ir.Scope}

    def variables(instruction: Any, value: Any) -> Any:
        kind = type(value)
        if kind not in (dict, list, tuple):
            return by_class(instruction, value)
        nested: list[Any] = []
        for item in value.values() if kind is dict else value:
            if type(item) is ir.Var:
                nested.append(item)
            elif type(item) not in without:
                nested.extend(variables(instruction, item))
        return nested

    ir.Inst._rec_list_vars = variables  # type: ignore[method-assign]


def _tell_nobody() -> None:
    """Send no events to listeners; numba sends some twenty for every pass."""
    from numba.core import event

    event.broadcast = lambda _: None
