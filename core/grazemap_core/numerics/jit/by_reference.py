"""Tuples of arrays by reference: one pointer is passed on, where numba passes seven numbers for every array.

Half of what a kernel that calls others is compiled of would be such passing. A kernel that Python calls takes tuples,
makes references of them and passes these on; what is looked up in one looks as in a tuple. An array should be looked
up before a loop that writes to another one: the compiler cannot know that the tuple stays as it is.
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
    """Type of a pointer to a named tuple that the kernel which made it holds; valid until that returns."""

    def __init__(self, target: Any) -> None:
        """Take numba's type of the tuple."""
        self.target = target
        super().__init__(name=f"reference({target})")

    @property
    def mangling_args(self) -> tuple[str, tuple[Any, ...]]:
        """What numba makes names of functions from."""
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
    return impl_ret_borrowed(context, builder, kind, builder.load(place))  # counted where kernels have numba's runtime


def reference(record: Record) -> Record:
    """Return a reference to a named tuple, in a kernel, for as long as that kernel runs; in Python the tuple itself."""
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
