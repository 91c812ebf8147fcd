"""32-bit floating point, on lanes and on numbers, against NumPy and against exact arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numba import njit

from predprey_env.jit.floats import ROUNDER, as_float, fma, power_of_two
from predprey_env.jit.lanes import LANES, load, store

FLOATS = st.floats(-(2.0**60), 2.0**60, width=32).filter(lambda number: number == 0 or abs(number) > 2.0**-60)


@njit(_nrt=False)
def compiled_fma(a, b, c, out):
    store(out, 0, fma(load(a, 0), load(b, 0), load(c, 0)))


@njit(_nrt=False)
def compiled_fma_with_number(a, number, c, out):
    store(out, 0, fma(number, load(a, 0), load(c, 0)))


@njit(_nrt=False)
def compiled_rounding(a, out):
    store(out, 0, load(a, 0) + ROUNDER - ROUNDER)


@njit(_nrt=False)
def compiled_power_of_two(a, out):
    store(out, 0, power_of_two(load(a, 0)))


@njit(_nrt=False)
def compiled_as_float(a, out):
    store(out, 0, as_float(load(a, 0)))


def on_lanes_and_alone(compiled, *columns: np.ndarray) -> np.ndarray:
    """Results for ``LANES`` columns at once, after a check that each column alone gives the same bits."""
    out, alone = np.empty((1, LANES), np.float32), np.empty(1, np.float32)
    compiled(*(column[None] if isinstance(column, np.ndarray) else column for column in columns), out)
    for lane in range(LANES):
        compiled(*(column[lane : lane + 1] if isinstance(column, np.ndarray) else column for column in columns), alone)
        assert alone.tobytes() == out[0, lane : lane + 1].tobytes()
    return out[0]


def rounded(exact: Fraction) -> np.float32:
    """The float32 nearest to an exact number; a tie goes to the even mantissa."""
    guess = np.float32(float(exact))
    near = [np.nextafter(guess, np.float32(-np.inf)), guess, np.nextafter(guess, np.float32(np.inf))]
    return min(near, key=lambda number: (abs(Fraction(float(number)) - exact), int(number.view(np.int32)) & 1))


TIE = 2.0**-12 + 2.0**-35, 2.0**-12 - 2.0**-35, 1 + 2.0**-23  # a * b + c lies just below a tie of float32


@given(a=FLOATS, b=FLOATS, c=FLOATS)
@example(*TIE)
@example(0.1, 10.0, -1.0)
def test_compiled_fma_rounds_once(a: float, b: float, c: float) -> None:
    columns = [np.full(LANES, number, np.float32) for number in (a, b, c)]
    exact = rounded(Fraction(float(columns[0][0])) * Fraction(float(columns[1][0])) + Fraction(float(columns[2][0])))
    assert (on_lanes_and_alone(compiled_fma, *columns) == exact).all()


@given(a=FLOATS, b=FLOATS, c=FLOATS)
@example(*TIE)
@example(0.1, 10.0, -1.0)
def test_the_python_source_of_fma_rounds_once(a: float, b: float, c: float) -> None:
    a, b, c = (np.float32(number) for number in (a, b, c))
    assert fma(a, b, c) == rounded(Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c)))


def test_fma_keeps_its_lanes_apart_and_takes_numbers() -> None:
    a, c = np.arange(LANES, dtype=np.float32), np.linspace(0, 1, LANES, dtype=np.float32)
    b = np.roll(a, 1)
    in_doubles = (a.astype(np.float64) * b + c).astype(np.float32)
    assert on_lanes_and_alone(compiled_fma, a, b, c).tolist() == in_doubles.tolist()
    halved = (a.astype(np.float64) * 0.5 + c).astype(np.float32)
    assert on_lanes_and_alone(compiled_fma_with_number, a, 0.5, c).tolist() == halved.tolist()


def test_the_rounder_rounds_and_sends_halves_to_the_even_integer() -> None:
    halves = np.array(
        [-2.5, -1.5, -0.5, 0.5, 1.5, 2.5, -0.4, 0.6, 63.7, -7, 0, 3.49, 3.51, -3.51, 126.5, -126], np.float32
    )
    odd = ROUNDER % 2 == 1  # what is even is decided by the sum
    found = on_lanes_and_alone(compiled_rounding, halves)
    nearest = np.rint(halves + 1) - 1 if odd else np.rint(halves)
    assert found.tolist() == nearest.tolist()


def test_power_of_two_is_exact_over_its_range() -> None:
    exponents = np.arange(-126, 130).clip(max=127).reshape(-1, LANES).astype(np.float32)
    for row in exponents:
        exact = [2.0 ** int(exponent) for exponent in row]
        assert on_lanes_and_alone(compiled_power_of_two, row + ROUNDER).tolist() == exact
        assert [float(power_of_two(exponent + ROUNDER)) for exponent in row] == exact


@pytest.mark.parametrize("top", [50, 2**24, 2**31 - 1])
def test_as_float_converts_integers(top: int) -> None:
    integers = np.linspace(-top, top, LANES).astype(np.int32)
    assert on_lanes_and_alone(compiled_as_float, integers).tolist() == integers.astype(np.float32).tolist()
    assert as_float(7) == 7
    assert isinstance(as_float(7), np.float32)
