"""Equilibria of matrix games: values worked out by hand, and those of SciPy's linear programming."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from esp_trainer.exact.matrix_game import Workspace, equilibrium, make_workspace
from predprey_env.jit.compilation import entry_point


@entry_point
def value_of(work: Workspace) -> float:
    return equilibrium(work)


def solved(payoffs: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return the value of a game, and an equilibrium strategy of the row player and of the column player."""
    work = make_workspace(*payoffs.shape)
    work.payoffs[:] = payoffs
    return float(value_of(work)), work.rows, work.columns


def value_by_scipy(payoffs: np.ndarray) -> float:
    m, n = payoffs.shape
    done = linprog(
        np.r_[np.zeros(n), 1.0],
        A_ub=np.c_[payoffs, -np.ones(m)],
        b_ub=np.zeros(m),
        A_eq=[np.r_[np.ones(n), 0.0]],
        b_eq=[1.0],
        bounds=[(0, None)] * n + [(None, None)],
    )
    return float(done.fun)


@pytest.mark.parametrize(
    ("payoffs", "value", "rows", "columns"),
    [
        ([[0.25]], 0.25, [1], [1]),
        ([[1, 0], [0, 1]], 1 / 2, [1 / 2, 1 / 2], [1 / 2, 1 / 2]),
        ([[3, 1], [0, 2]], 3 / 2, [1 / 2, 1 / 2], [1 / 4, 3 / 4]),
        ([[1, 2, 0], [0, 1, 2], [2, 0, 1]], 1, [1 / 3] * 3, [1 / 3] * 3),  # rock, paper, scissors
        ([[0, 1, 0.5], [1, 0, 0.5]], 1 / 2, [1 / 2, 1 / 2], None),  # the last column is as good as the mixture
        ([[2, 3], [1, 4]], 2, [1, 0], [1, 0]),  # a saddle point
        ([[0, 0], [0, 0], [0, 0]], 0, [1, 0, 0], [1, 0]),
    ],
)
def test_games_worked_out_by_hand(
    payoffs: list[list[float]], value: float, rows: list[float], columns: list[float] | None
) -> None:
    found = solved(np.array(payoffs, float))
    assert found[0] == pytest.approx(value, abs=1e-12)
    assert found[1] == pytest.approx(rows, abs=1e-12)
    if columns is not None:
        assert found[2] == pytest.approx(columns, abs=1e-12)


KINDS = {
    "uniform": lambda rng, shape: rng.random(shape),
    "few values": lambda rng, shape: rng.integers(0, 3, shape) / 2,
    "zeros and ones": lambda rng, shape: rng.integers(0, 2, shape).astype(float),
    "nearly equal": lambda rng, shape: rng.integers(0, 3, shape) / 2 + 10.0 ** -rng.integers(6, 14, shape),
    "equal rows": lambda rng, shape: np.round(rng.random((1, shape[1])), 1) * rng.integers(0, 2, (shape[0], 1)),
}


@given(st.sampled_from(sorted(KINDS)), st.integers(1, 125), st.integers(1, 16), st.integers(0, 2**32 - 1))
def test_values_are_those_of_linear_programming_and_strategies_secure_them(
    kind: str, m: int, n: int, seed: int
) -> None:
    payoffs = KINDS[kind](np.random.default_rng(seed), (m, n))
    value, rows, columns = solved(payoffs)
    assert value == pytest.approx(value_by_scipy(payoffs), abs=1e-7)
    for strategy in (rows, columns):
        assert strategy.min() >= 0
        assert strategy.sum() == pytest.approx(1, abs=1e-9)
    assert (rows @ payoffs).min() >= value - 1e-7
    assert (payoffs @ columns).max() <= value + 1e-7
