"""Equilibria of zero-sum matrix games in compiled code, for the many small ones that a stochastic game consists of."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from predprey_env.compilation import entry_point, rule

_LEAST = 1e-11
"""A reduced cost or a pivot below this counts as none: payoffs are shares in [0, 1], in double precision."""


class Workspace(NamedTuple):
    """What a game of ``m`` rows and ``n`` columns is solved in. The payoffs are the caller's to fill."""

    payoffs: Any
    """float64 ``(m, n)``: what the row player wins."""
    tableau: Any
    """float64 ``(m + 1, n + 1)``."""
    basis: Any
    """int64 ``(m,)``: which variable each row of the tableau stands for."""
    free: Any
    """int64 ``(n,)``: which variable each of its columns stands for."""
    rows: Any
    """float64 ``(m,)``: the row player's equilibrium strategy."""
    columns: Any
    """float64 ``(n,)``: the column player's."""


def make_workspace(n_rows: int, n_columns: int) -> Workspace:
    """A workspace for games of one size; each thread needs one of its own."""
    return Workspace(
        np.zeros((n_rows, n_columns)),
        np.zeros((n_rows + 1, n_columns + 1)),
        np.zeros(n_rows, np.int64),
        np.zeros(n_columns, np.int64),
        np.zeros(n_rows),
        np.zeros(n_columns),
    )


@rule
def equilibrium(work: Workspace) -> float:
    """The value of the game whose payoffs the workspace holds, all of them at least 0; both strategies are left there.

    The column player's linear programme, ``max sum(y)`` with ``(payoffs + 1) y <= 1``, by the simplex method on a
    condensed tableau with Bland's rule, which does not cycle; the row player's strategy is its dual. A game with a
    saddle point has its value without it.
    """
    work.rows[:] = 0.0
    work.columns[:] = 0.0
    row, column = saddle_point(work.payoffs)
    if row >= 0:
        work.rows[row] = 1.0
        work.columns[column] = 1.0
        return work.payoffs[row, column]  # type: ignore[no-any-return]
    m, n = work.payoffs.shape
    _begin(work, m, n)
    entering = _entering(work, m, n)
    while entering >= 0:
        leaving = _leaving(work, entering, m, n)
        _pivot(work.tableau, leaving, entering, m, n)
        work.basis[leaving], work.free[entering] = work.free[entering], work.basis[leaving]
        entering = _entering(work, m, n)
    total = work.tableau[m, n]
    for i in range(m):
        if work.basis[i] < n:
            work.columns[work.basis[i]] = max(0.0, work.tableau[i, n] / total)
    for j in range(n):
        if work.free[j] >= n:
            work.rows[work.free[j] - n] = max(0.0, work.tableau[m, j] / total)
    return 1.0 / total - 1.0  # type: ignore[no-any-return]


@rule
def saddle_point(payoffs: Any) -> Any:
    """The first row and column whose payoff is the least of its row and the most of its column; (-1, -1) if none."""
    m, n = payoffs.shape
    safest, floor = 0, -1.0
    for i in range(m):
        least = payoffs[i, 0]
        for j in range(1, n):
            least = min(least, payoffs[i, j])
        if least > floor:
            safest, floor = i, least
    for j in range(n):
        most = payoffs[0, j]
        for i in range(1, m):
            most = max(most, payoffs[i, j])
        if most <= floor:
            return safest, j
    return -1, -1


@rule
def _begin(work: Workspace, m: int, n: int) -> None:
    """The tableau at ``y = 0``: the slack variables, numbered from ``n`` on, are the basis."""
    for i in range(m):
        for j in range(n):
            work.tableau[i, j] = work.payoffs[i, j] + 1.0
        work.tableau[i, n] = 1.0
        work.basis[i] = n + i
    for j in range(n):
        work.tableau[m, j] = -1.0
        work.free[j] = j
    work.tableau[m, n] = 0.0


@rule
def _entering(work: Workspace, m: int, n: int) -> int:
    """Of the columns that would raise the sum, the one whose variable has the lowest number; -1 if there is none."""
    found = -1
    for j in range(n):
        if work.tableau[m, j] < -_LEAST and (found < 0 or work.free[j] < work.free[found]):
            found = j
    return found


@rule
def _leaving(work: Workspace, entering: int, m: int, n: int) -> int:
    """The row that limits the entering variable most; of equal ones the one whose variable has the lowest number."""
    found, limit = -1, 0.0
    for i in range(m):
        if work.tableau[i, entering] > _LEAST:
            ratio = work.tableau[i, n] / work.tableau[i, entering]
            if found < 0 or ratio < limit or (ratio == limit and work.basis[i] < work.basis[found]):
                found, limit = i, ratio
    return found


@rule
def _pivot(tableau: Any, row: int, column: int, m: int, n: int) -> None:
    """Exchange a basic and a free variable."""
    pivot = 1.0 / tableau[row, column]
    for j in range(n + 1):
        if j != column:
            tableau[row, j] *= pivot
    for i in range(m + 1):
        if i != row:
            factor = tableau[i, column]
            if factor != 0.0:
                for j in range(n + 1):
                    if j != column:
                        tableau[i, j] -= factor * tableau[row, j]
            tableau[i, column] = -factor * pivot
    tableau[row, column] = pivot


@entry_point
def _solve(work: Workspace) -> float:
    return equilibrium(work)


def solve_game(payoffs: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Value, and an equilibrium strategy of each player, of the game in which the row player wins ``payoffs``.

    Args:
        payoffs: Numbers of at least 0, ``(m, n)``.
    """
    work = make_workspace(*payoffs.shape)
    work.payoffs[:] = payoffs
    if not (work.payoffs >= 0).all():
        raise ValueError("payoffs must be at least 0")
    value = float(_solve(work))
    return value, work.rows, work.columns
