"""Numbers and records that lanes share, or that every lane has for itself, looked up in the same way.

The numbers of a table are those of all lanes, (places,), or every lane's own, (places, pitch). The type of the table
tells which, so numba compiles one kernel for either; shared tables cost nothing. The pitch is a constant to the
compiler, which would not use vector instructions otherwise.

    row = lane_row(table, place, pitch)     before a loop over lanes
    lane_value(row, lane)                   in the loop

`record_of` looks up what belongs to a lane in a named tuple, or a reference to one, with the fields

    shared      a named tuple, of all lanes or an example of a lane's
    addresses   where every lane's is in memory (`store`); 0 where it is shared

and `table_of` looks up the tables of all lanes.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.jit.record_references import Reference


def lane_row(table: Floats, place: int, pitch: int) -> float:
    """Return what `lane_value` takes: the number at a place of a table, or in a kernel where the lanes' own begin."""
    number: float = table[place]
    return number


@type_callable(lane_row)
def _type_of_lanes(_: Any) -> Any:
    return lambda table, place, pitch: table.dtype if table.ndim == 1 else types.CPointer(table.dtype)


@lower_builtin(lane_row, types.Array, types.Integer, types.Integer)
def _look_up_place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    table, place, pitch = signature.args
    data = context.make_array(table)(context, builder, arguments[0]).data
    index = context.cast(builder, arguments[1], place, types.intp)
    if table.ndim == 1:
        return context.unpack_value(builder, table.dtype, builder.gep(data, [index], inbounds=True))
    index = builder.mul(index, context.cast(builder, arguments[2], pitch, types.intp))
    return builder.gep(data, [index], inbounds=True)


def lane_value(row: float, lane: int) -> float:
    """Return a lane's number of a row from `lane_row`."""
    return row


@type_callable(lane_value)
def _type_of_number(_: Any) -> Any:
    return lambda row, lane: row.dtype if isinstance(row, types.CPointer) else row


@lower_builtin(lane_value, types.Float, types.Integer)
def _shared_number(_: Any, __: Any, ___: Any, arguments: Any) -> Any:
    return arguments[0]


@lower_builtin(lane_value, types.CPointer, types.Integer)
def _separate_number(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    row, lane = signature.args
    index = context.cast(builder, arguments[1], lane, types.intp)
    return context.unpack_value(builder, row.dtype, builder.gep(arguments[0], [index], inbounds=True))


def put_lane_value(table: Floats, place: int, pitch: int, lane: int, number: float) -> None:
    """Write a lane's own number; nothing where numbers are shared."""


@type_callable(put_lane_value)
def _type_of_put(_: Any) -> Any:
    return lambda table, place, pitch, lane, number: types.none


@lower_builtin(put_lane_value, types.Array, types.Integer, types.Integer, types.Integer, types.Float)
def _put(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    table, *kinds, _ = signature.args
    if table.ndim > 1:
        place, pitch, lane = (
            context.cast(builder, value, kind, types.intp) for value, kind in zip(arguments[1:4], kinds, strict=True)
        )
        data = context.make_array(table)(context, builder, arguments[0]).data
        index = builder.add(builder.mul(place, pitch), lane)
        context.pack_value(builder, table.dtype, arguments[4], builder.gep(data, [index], inbounds=True))
    return context.get_dummy_value()


def _target(kind: Any) -> Any:
    return kind.target if isinstance(kind, Reference) else kind


def _field(kind: Any, name: str) -> Any:
    return _target(kind).types[_target(kind).fields.index(name)]


def _field_pointer(builder: Any, kind: Any, value: Any, name: str) -> Any:
    pointer = value if isinstance(kind, Reference) else cgutils.alloca_once_value(builder, value)
    return cgutils.gep_inbounds(builder, pointer, 0, _target(kind).fields.index(name))


def record_of(records: Any, lane: int) -> Any:
    """Return a reference to a lane's record."""
    return records.shared


@type_callable(record_of)
def _type_of_record(_: Any) -> Any:
    return lambda records, lane: Reference(_field(records, "shared"))


@lower_builtin(record_of, types.Any, types.Integer)
def _look_up_record(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    records, lane = signature.args
    shared = _field_pointer(builder, records, arguments[0], "shared")
    kind, place = _field(records, "addresses"), _field_pointer(builder, records, arguments[0], "addresses")
    addresses = context.make_array(kind)(context, builder, builder.load(place))
    index = context.cast(builder, arguments[1], lane, types.intp)
    address = builder.load(builder.gep(addresses.data, [index], inbounds=True))
    is_shared = builder.icmp_unsigned("==", address, address.type(0))
    return builder.select(is_shared, shared, builder.inttoptr(address, shared.type))


def table_of(separate: Any, which: int, records: Any) -> Any:
    """Return a reference to the tables of all lanes: those number `which`, a constant, of `separate.tables`, if any.

    Without any they are the field `tables` of what lanes share in `records`. `separate` is a reference.
    """
    return records.shared.tables


@type_callable(table_of)
def _type_of_table(_: Any) -> Any:
    def table_type(separate: Any, which: Any, records: Any) -> Any:
        tables = _field(separate, "tables")
        return Reference(tables[0] if len(tables) else _field(_field(records, "shared"), "tables"))

    return table_type


@lower_builtin(table_of, Reference, types.Integer, types.Any)
def _look_up_table(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    separate, which, records = signature.args
    if len(_field(separate, "tables")) == 0:
        shared, place = _field(records, "shared"), _field_pointer(builder, records, arguments[2], "shared")
        return cgutils.gep_inbounds(builder, place, 0, shared.fields.index("tables"))
    zero, index = ir.Constant(ir.IntType(32), 0), context.cast(builder, arguments[1], which, types.intp)
    return builder.gep(_field_pointer(builder, separate, arguments[0], "tables"), [zero, index], inbounds=True)


def _detached(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return a value whose arrays are not those of Python, which counts references to them."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.NamedTuple):
        for i, part_type in enumerate(kind.types):
            part = _detached(context, builder, part_type, builder.extract_value(value, i))
            value = builder.insert_value(value, part, i)
    return value


def _write(record: Any, address: int) -> int:
    """Write a named tuple to memory, if there is any, and return its size in bytes."""
    raise NotImplementedError  # in kernels only


@type_callable(_write)
def _type_of_write(_: Any) -> Any:
    return lambda record, address: types.intp


@lower_builtin(_write, types.NamedTuple, types.Integer)
def _write_record(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = context.get_value_type(signature.args[0])
    with builder.if_then(builder.icmp_unsigned("!=", arguments[1], arguments[1].type(0))):
        pointer = builder.inttoptr(arguments[1], kind.as_pointer())
        builder.store(_detached(context, builder, signature.args[0], arguments[0]), pointer)
    return context.get_constant(types.intp, context.get_abi_sizeof(kind))


@kernel
def store(record: Any, address: int) -> int:
    """Write a named tuple of arrays to memory, unless the address is 0, and return its size in bytes.

    The memory is valid as long as the arrays are.
    """
    return _write(record, address)
