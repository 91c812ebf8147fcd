"""32-bit floating-point operations on values for which Python has no operator. See :mod:`predprey_env.jit.lanes`."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.extending import intrinsic

from predprey_env.jit.lanes import FLOATS, INTEGERS, LANES, Lanes, is_lanes, row_pointer, spread
from predprey_env.jit.linking import inlined
from predprey_env.jit.values import FloatRows, Value, Values

_I32 = ir.IntType(32)

ROUNDER = np.float32(1.5 * 2**23 + 127)
"""Constant that rounds a number below 2**22 to an integer when it is added to the number.

The sum holds the integer, biased like an exponent, in its lowest bits. Subtracting the constant again gives the
integer."""


def _llvm(builder: ir.IRBuilder, name: str, *values: ir.Value) -> ir.Value:
    """Call an LLVM floating-point intrinsic on numbers or on vectors."""
    kind = values[0].type
    suffix = f"v{LANES}f32" if isinstance(kind, ir.VectorType) else "f32"
    function = ir.FunctionType(kind, [kind] * len(values))
    return builder.call(cgutils.get_or_insert_function(builder.module, function, f"llvm.{name}.{suffix}"), values)


def _as_integers(kind: ir.Type) -> ir.Type:
    return ir.VectorType(_I32, LANES) if isinstance(kind, ir.VectorType) else _I32


def _constant(kind: ir.Type, number: int) -> ir.Constant:
    return ir.Constant(kind, [number] * LANES if isinstance(kind, ir.VectorType) else number)


def fma(a: Value, b: Value, c: Value) -> Value:
    """Return ``a * b + c`` of 32-bit floats, rounded once."""
    product, term = np.float64(a) * np.float64(b), np.float64(c)  # the product is exact
    total = product + term
    rest = total - product
    error = (product - (total - rest)) + (term - rest)
    if error and not np.float64(total).view(np.int64) & 1:
        # Round the double to odd, so that it records on which side of a tie between two floats the exact sum is.
        total = np.nextafter(total, np.inf if error > 0 else -np.inf)
    return np.float32(total)


@intrinsic
def _fma(_context, a, b, c):
    result = next((value for value in (a, b, c) if isinstance(value, Lanes)), types.float32)

    def codegen(context, builder, signature, arguments):
        pair = zip(signature.args, arguments, strict=True)
        convert = spread if isinstance(result, Lanes) else _cast_to_float
        return _llvm(builder, "fma", *(convert(context, builder, result, given, value) for given, value in pair))

    return result(a, b, c), codegen


def _cast_to_float(
    context: BaseContext, builder: ir.IRBuilder, _float32: types.Type, given: types.Type, value: ir.Value
) -> ir.Value:
    return context.cast(builder, value, given, types.float32)


@inlined(fma)
def _fma_overload(a, b, c):
    return lambda a, b, c: _fma(a, b, c)


def power_of_two(shifted: Value) -> Value:
    """Return ``2 ** n`` of a 32-bit float that holds ``n`` in its lowest bits.

    ``shifted`` is the sum of :data:`ROUNDER` and a number that rounds to ``n``, in [-126, 127].
    """
    return np.left_shift(np.float32(shifted).view(np.int32), np.int32(23)).view(np.float32)


@intrinsic
def _power_of_two(_context, shifted):
    def codegen(_context, builder, _signature, arguments):
        kind = arguments[0].type
        bits = _as_integers(kind)
        return builder.bitcast(builder.shl(builder.bitcast(arguments[0], bits), _constant(bits, 23)), kind)

    return shifted(shifted), codegen


@inlined(power_of_two)
def _power_of_two_overload(shifted):
    return lambda shifted: _power_of_two(shifted)


def as_float(a: Value) -> Value:
    """Return an integer as a 32-bit float."""
    return np.float32(a)


@intrinsic
def _lanes_as_float(_context, a):
    def codegen(_context, builder, _signature, arguments):
        return builder.sitofp(arguments[0], ir.VectorType(ir.FloatType(), LANES))

    return FLOATS(a), codegen


@inlined(as_float)
def _as_float(a):
    return (lambda a: _lanes_as_float(a)) if is_lanes(a) else (lambda a: np.float32(a))


def as_integer(a: Value) -> Value:
    """Return a float as a 32-bit integer, rounded towards zero."""
    return np.int32(a)


@intrinsic
def _lanes_as_integer(_context, a):
    def codegen(_context, builder, _signature, arguments):
        return builder.fptosi(arguments[0], ir.VectorType(_I32, LANES))

    return INTEGERS(a), codegen


@inlined(as_integer)
def _as_integer(a):
    return (lambda a: _lanes_as_integer(a)) if is_lanes(a) else (lambda a: np.int32(a))


def bits_of(a: Value) -> Value:
    """Return the bits of a 32-bit float as an integer, for memory, whose rows hold integers."""
    return np.float32(a).view(np.int32)


def float_of(a: Value) -> Value:
    """Return the 32-bit float that has the bits of an integer."""
    return np.int32(a).view(np.float32)


@intrinsic
def _bits_of(_context, a):
    def codegen(_context, builder, _signature, arguments):
        return builder.bitcast(arguments[0], _as_integers(arguments[0].type))

    return (INTEGERS if isinstance(a, Lanes) else types.int32)(a), codegen


@intrinsic
def _float_of(_context, a):
    def codegen(_context, builder, _signature, arguments):
        kind = ir.VectorType(ir.FloatType(), LANES) if isinstance(a, Lanes) else ir.FloatType()
        return builder.bitcast(arguments[0], kind)

    return (FLOATS if isinstance(a, Lanes) else types.float32)(a), codegen


@inlined(bits_of)
def _bits_of_overload(a):
    return lambda a: _bits_of(a)


@inlined(float_of)
def _float_of_overload(a):
    return lambda a: _float_of(a)


def zeros(weights: FloatRows, blank: Values) -> Values:
    """Return as many zeros as ``blank`` has entries: 32-bit floats, or lanes if the rows of ``weights`` are lanes."""
    return tuple(weights[0] * 0 for _ in blank)


@intrinsic
def _zeros(_context, weights, blank):
    result = types.UniTuple(FLOATS if weights.ndim == 2 else types.float32, len(blank))

    def codegen(context, builder, signature, _arguments):
        zero = ir.Constant(context.get_value_type(signature.return_type.dtype), None)
        return context.make_tuple(builder, signature.return_type, [zero] * len(signature.return_type))

    return result(weights, blank), codegen


@inlined(zeros)
def _zeros_overload(weights, blank):
    return lambda weights, blank: _zeros(weights, blank)


def add_products(sums: Values, weights: FloatRows, row: int, factor: Value) -> Values:
    """Return each sum plus its weight times one factor, rounded once.

    The weights are the rows of ``weights`` from ``row`` on. The sums are a tuple, whose length is part of its type, so
    that they stay in registers.
    """
    return tuple(fma(weights[row + k], factor, total) for k, total in enumerate(sums))


@intrinsic
def _add_products(_context, sums, weights, row, factor):
    def codegen(context, builder, signature, arguments):
        sums, array, first, factor = arguments
        array_type, vector = signature.args[1], isinstance(signature.args[3], Lanes)
        results = []
        for k in range(len(signature.return_type)):
            at = builder.add(first, first.type(k))
            if vector:
                pointer = row_pointer(context, builder, array_type, array, at)
            else:
                pointer = builder.gep(context.make_array(array_type)(context, builder, array).data, [at])
            weight = builder.load(pointer)
            weight.align = 4
            results.append(_llvm(builder, "fma", weight, factor, builder.extract_value(sums, k)))
        return context.make_tuple(builder, signature.return_type, results)

    return sums(sums, weights, types.intp, factor), codegen


@inlined(add_products)
def _add_products_overload(sums, weights, row, factor):
    return lambda sums, weights, row, factor: _add_products(sums, weights, row, factor)
