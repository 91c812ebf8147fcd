"""Rules written once, for one world or for sixteen at a time.

Every compiled rule of this project is written over *values*. A value is one number, or :data:`LANES` numbers side by
side in vector registers, one for each of ``LANES`` worlds that are played together. Numba compiles the same source for
both, so the fast path of the trainer and the PettingZoo environment cannot drift apart.

A rule may use ``+ - *`` and, on floats, ``/``, comparisons, ``&`` and ``|`` on masks, and the functions of this module.
A rule never branches on a value, because the lanes would have to part ways; it selects with :func:`where`. Its
constants are integers or ``np.float32``, so that one number is not computed in higher precision than sixteen. Values
live in arrays whose *rows* are values: C-contiguous, ``(rows,)`` for one world, ``(rows, LANES)`` for a block of
worlds.

The vectors are explicit LLVM vectors rather than loops that a compiler may or may not vectorise: compilation is short,
and the speed does not depend on an optimiser. Each operation is an IEEE one: nothing is reassociated, and multiply-add
is fused only by :func:`fma`. So one lane gives the same bits as one number.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import TypeAlias

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.base import BaseContext
from numba.core.datamodel import DataModelManager, models
from numba.extending import intrinsic, register_model

from predprey_env.jit.linking import inlined
from predprey_env.jit.values import FloatRows, IntegerRows, Mask, Value

Emit: TypeAlias = Callable[..., ir.Value]
"""A function that writes the instructions of an operation."""

LANES = 16
"""Number of worlds played side by side: two AVX2 registers or one AVX-512 register of 32-bit numbers."""

_ELEMENTS = {types.float32: ir.FloatType(), types.int32: ir.IntType(32), types.boolean: ir.IntType(1)}
_I32 = ir.IntType(32)


class Lanes(types.Type):
    """Numba type of ``LANES`` numbers of one element type."""

    def __init__(self, element: types.Type) -> None:
        self.element = element
        super().__init__(f"Lanes({element} x {LANES})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: DataModelManager, lanes: Lanes) -> None:
        super().__init__(manager, lanes, ir.VectorType(_ELEMENTS[lanes.element], LANES))


FLOATS, INTEGERS, _MASK = Lanes(types.float32), Lanes(types.int32), Lanes(types.boolean)
_OF_ELEMENT = {types.float32: FLOATS, types.int32: INTEGERS}


def is_lanes(*values: types.Type) -> bool:
    """Return whether any of the given Numba types is a :class:`Lanes`."""
    return any(isinstance(value, Lanes) for value in values)


def spread(context: BaseContext, builder: ir.IRBuilder, lanes: Lanes, given: types.Type, value: ir.Value) -> ir.Value:
    """Return a vector: lanes unchanged, or a number cast to the element type and repeated in every lane."""
    if isinstance(given, Lanes):
        return value
    number = context.cast(builder, value, given, lanes.element)
    first = builder.insert_element(ir.Constant(ir.VectorType(number.type, LANES), ir.Undefined), number, _I32(0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(_I32, LANES), [0] * LANES))


def lane_zeros(kind: type, *shape: int) -> np.ndarray:
    """Return zeros of a 32-bit type, of shape ``(*shape, LANES)``, whose rows begin on a cache line.

    No load then crosses a cache line, and no two threads write to the same one. Raises :class:`ValueError` if Numba's
    compilation is disabled, because uncompiled rules play one world at a time.
    """
    if numba.config.DISABLE_JIT:
        raise ValueError(
            "NUMBA_DISABLE_JIT must be unset to play many worlds at a time; only parallel_env, env and team_view play "
            "uncompiled"
        )
    n = LANES * math.prod(shape)
    room: np.ndarray = np.zeros(n + LANES, kind)
    first = -room.ctypes.data % (room.itemsize * LANES) // room.itemsize
    return room[first : first + n].reshape(*shape, LANES)


# -- arithmetic and comparison ------------------------------------------------------------------------------------


def _define_operator(python_operator: Callable[..., Value], emit: Emit, *, gives_mask: bool) -> None:
    @intrinsic
    def lanes_operator(_context, a, b):
        lanes = a if isinstance(a, Lanes) else b

        def codegen(context, builder, signature, arguments):
            pair = zip(signature.args, arguments, strict=True)
            return emit(builder, lanes, *(spread(context, builder, lanes, given, value) for given, value in pair))

        return (_MASK if gives_mask else lanes)(a, b), codegen

    @inlined(python_operator)
    def _on_lanes(a, b):
        return (lambda a, b: lanes_operator(a, b)) if is_lanes(a, b) else None


def _arithmetic(of_floats: str, of_integers: str) -> Emit:
    return lambda builder, lanes, a, b: getattr(builder, of_floats if lanes is FLOATS else of_integers)(a, b)


def _comparison(symbol: str) -> Emit:
    def emit(builder: ir.IRBuilder, lanes: Lanes, a: ir.Value, b: ir.Value) -> ir.Value:
        if lanes is not FLOATS:
            return builder.icmp_signed(symbol, a, b)
        # NaN is unequal to everything, and every other comparison with it is false.
        return (builder.fcmp_unordered if symbol == "!=" else builder.fcmp_ordered)(symbol, a, b)

    return emit


_define_operator(operator.add, _arithmetic("fadd", "add"), gives_mask=False)
_define_operator(operator.sub, _arithmetic("fsub", "sub"), gives_mask=False)
_define_operator(operator.mul, _arithmetic("fmul", "mul"), gives_mask=False)
_define_operator(operator.truediv, _arithmetic("fdiv", "sdiv"), gives_mask=False)
_define_operator(operator.and_, _arithmetic("and_", "and_"), gives_mask=False)
_define_operator(operator.or_, _arithmetic("or_", "or_"), gives_mask=False)
for _python, _symbol in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):
    _define_operator(_python, _comparison(_symbol), gives_mask=True)
_define_operator(operator.eq, _comparison("=="), gives_mask=True)
_define_operator(operator.ne, _comparison("!="), gives_mask=True)


# -- selection, memory --------------------------------------------------------------------------------------------


def where(mask: Mask, a: Value, b: Value) -> Value:
    """Return ``a`` where the mask holds, else ``b``; both are always evaluated."""
    return a if mask else b


@intrinsic
def _select(_context, mask, a, b):
    known = a if isinstance(a, Lanes) else b
    if isinstance(known, Lanes):
        lanes = known
    else:
        lanes = INTEGERS if isinstance(a, types.Integer) and isinstance(b, types.Integer) else FLOATS

    def codegen(context, builder, signature, arguments):
        pair = zip(signature.args[1:], arguments[1:], strict=True)
        return builder.select(arguments[0], *(spread(context, builder, lanes, given, value) for given, value in pair))

    return lanes(mask, a, b), codegen


@inlined(where)
def _where(mask, a, b):
    if is_lanes(mask):
        return lambda mask, a, b: _select(mask, a, b)
    return lambda mask, a, b: a if mask else b


def any_of(mask: Mask) -> bool:
    """Return whether the mask holds in any lane."""
    return bool(mask)


@intrinsic
def _any_lane(_context, mask):
    def codegen(_context, builder, _signature, arguments):
        bits = builder.bitcast(arguments[0], ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, bits.type(0))

    return types.boolean(mask), codegen


@inlined(any_of)
def _any_of(mask):
    return (lambda mask: _any_lane(mask)) if is_lanes(mask) else (lambda mask: mask)


def load(array: FloatRows | IntegerRows, row: int) -> Value:
    """Return the value in a row of an array of shape ``(rows,)`` or ``(rows, LANES)``, C-contiguous."""
    return array[row]


def store(array: FloatRows | IntegerRows, row: int, value: Value) -> None:
    """Put a value into a row of an array of shape ``(rows,)`` or ``(rows, LANES)``, C-contiguous."""
    array[row] = value


def row_pointer(
    context: BaseContext, builder: ir.IRBuilder, array_type: types.Array, array: ir.Value, row: ir.Value
) -> ir.Value:
    """Return a vector pointer to the beginning of a row of an array of shape ``(rows, LANES)``."""
    base = context.make_array(array_type)(context, builder, array).data
    start = builder.gep(base, [builder.mul(row, row.type(LANES))])
    return builder.bitcast(start, ir.VectorType(_ELEMENTS[array_type.dtype], LANES).as_pointer())


@intrinsic
def _load_lanes(_context, array, row):
    def codegen(context, builder, signature, arguments):
        value = builder.load(row_pointer(context, builder, signature.args[0], *arguments))
        value.align = 4
        return value

    return _OF_ELEMENT[array.dtype](array, types.intp), codegen


@intrinsic
def _store_lanes(_context, array, row, value):
    lanes = _OF_ELEMENT[array.dtype]

    def codegen(context, builder, signature, arguments):
        repeated = spread(context, builder, lanes, signature.args[2], arguments[2])
        builder.store(repeated, row_pointer(context, builder, signature.args[0], *arguments[:2])).align = 4
        return context.get_dummy_value()

    return types.void(array, types.intp, value), codegen


@inlined(load)
def _load(array, row):
    if array.layout != "C":
        return None
    if array.ndim == 2:
        return lambda array, row: _load_lanes(array, row)
    return lambda array, row: array[row]


@inlined(store)
def _store(array, row, value):
    if array.layout != "C":
        return None
    if array.ndim == 2:
        return lambda array, row, value: _store_lanes(array, row, value)

    def store_number(array, row, value):
        array[row] = value

    return store_number
