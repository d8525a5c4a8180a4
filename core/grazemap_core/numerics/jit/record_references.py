"""Named tuples of arrays passed by reference between kernels.

Numba passes seven numbers for every array of a tuple; a reference is one pointer. Without references, passing arguments
would be half of the code of a kernel that calls others. A kernel that Python calls takes tuples, makes references to
them with `reference` and passes these on; fields are looked up as in a tuple. Look an array up before a loop that
writes to another array: the compiler does not know that the tuple does not change.
"""

from __future__ import annotations

from typing import Any, TypeVar

from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, lower_builtin, models, register_model, type_callable

Record = TypeVar("Record", bound=tuple[Any, ...])


class Reference(types.Type):
    """Numba's type of a pointer to a named tuple; the pointer is valid until the kernel that made it returns."""

    def __init__(self, target: Any) -> None:
        """Take numba's type of the named tuple."""
        self.target = target
        super().__init__(name=f"reference({target})")

    @property
    def mangling_args(self) -> tuple[str, tuple[Any, ...]]:
        """Name and parameters from which numba builds the names of compiled functions."""
        return "reference", (self.target,)


@register_model(Reference)
class _ReferenceModel(models.PrimitiveModel):
    def __init__(self, manager: Any, reference: Reference) -> None:
        super().__init__(manager, reference, manager.lookup(reference.target).get_value_type().as_pointer())


@infer_getattr
class _ReferenceFields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, reference: Reference, field: str) -> Any:  # type: ignore[override]
        names, kinds = reference.target.fields, reference.target.types
        if field not in names:
            return None
        kind = kinds[names.index(field)]
        return Reference(kind) if isinstance(kind, types.NamedTuple) else kind


@lower_getattr_generic(Reference)
def _look_up(context: Any, builder: Any, reference: Reference, pointer: Any, field: str) -> Any:
    index = reference.target.fields.index(field)
    place = cgutils.gep_inbounds(builder, pointer, 0, index)
    kind = reference.target.types[index]
    if isinstance(kind, types.NamedTuple):
        return place
    return impl_ret_borrowed(context, builder, kind, builder.load(place))  # reference-counted if numba's runtime is on


def reference(record: Record) -> Record:
    """Return a reference to a named tuple, valid while the calling kernel runs; in Python the tuple itself."""
    return record


@type_callable(reference)
def _type_of_reference(_: Any) -> Any:
    return lambda record: record if isinstance(record, Reference) else Reference(record)


@lower_builtin(reference, types.NamedTuple)
def _refer(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
    return cgutils.alloca_once_value(builder, arguments[0])


@lower_builtin(reference, Reference)
def _refer_again(_: Any, __: Any, ___: Any, arguments: Any) -> Any:
    return arguments[0]
