"""What makes numba compile in three quarters of the time, for processes that do nothing else.

Half of numba's time goes into finding types. For a product of two numbers it tries some ten templates in turn, each
time anew, and at every template it compares all options of compilation; after each pass it lists the variables of every
instruction again; it tells listeners of each pass, which measure times that nobody reads; and Python looks for garbage
again and again, of which there is little. `hurry` has numba keep the types that it has found, compare the options that
are set, list variables by the types of what holds them, and tell nobody; and it has Python look rarely. What is
compiled is the same.

It changes functions of numba, so it is for `warmup`, not for a process in which a user's functions are compiled. With a
version of numba whose private interface is not known, it does nothing.
"""

from __future__ import annotations

import gc
from typing import Any

from grazemap_core.numerics.jit.inlining import PART_COMPILER

# Objects that are made before garbage is looked for: the memory grows by one in thirty.
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
    """Have settings compared by those options that one of them sets, instead of by all."""
    from numba.core.targetconfig import TargetConfig

    by_option: Any = TargetConfig.__eq__

    def equal(config: Any, other: Any) -> Any:
        if type(config) is not type(other):
            return by_option(config, other)
        ours, theirs = config._values, other._values
        return ours == theirs or all(getattr(config, name) == getattr(other, name) for name in {**ours, **theirs})

    # numba's hash is that of the names of all options, which is the same for all settings of a type
    TargetConfig.__eq__, TargetConfig.__hash__ = equal, lambda config: hash(type(config))  # type: ignore[method-assign]


def _keep_call_types() -> None:
    """Have the type that a call to one of numba's functions has with given arguments and settings kept."""
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
        function._impl_keys[signature.args] = implementation  # it depends on the settings
        return signature

    BaseFunction.get_call_type = get_call_type  # type: ignore[method-assign, assignment]


def _list_variables_by_type() -> None:
    """Have the variables in an instruction found without asking what each of its strings and places in files is."""
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
    """Have numba's events, of which some twenty accompany every pass, reach no listener."""
    from numba.core import event

    event.broadcast = lambda _: None
