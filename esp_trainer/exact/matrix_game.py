"""Equilibria of zero-sum matrix games in compiled code, for the many small games that make up a stochastic game."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from predprey_env.jit.compilation import rule

_LEAST_COST = 1e-11
"""Reduced costs below this count as zero: payoffs are in [0, 1], in double precision."""
_LEAST_PIVOT = 1e-9
"""Smallest pivot; smaller ones, left by rounding in place of zeros, would spoil the tableau."""
_LARGEST_GAP = 1e-7
"""Largest gap between the payoffs that the two strategies secure, and so the precision of a value."""
_GRAIN = 1e-8
"""Unit to which payoffs are rounded if the unrounded game cannot be solved."""
_PIVOTS = 10
"""Largest number of pivots for each row and column; about five in all are usual."""


class Workspace(NamedTuple):
    """Scratch arrays for solving a game of ``m`` rows and ``n`` columns. The caller fills the payoffs."""

    payoffs: Any
    """Payoffs of the row player: float64 ``(m, n)``."""
    tableau: Any
    """Condensed simplex tableau: float64 ``(m + 1, n + 1)``."""
    basis: Any
    """Variable of each row of the tableau: int64 ``(m,)``."""
    free: Any
    """Variable of each column of the tableau: int64 ``(n,)``."""
    support: Any
    """Columns that the column player uses: int64 ``(n,)``."""
    tight: Any
    """Rows that limit the column player: int64 ``(n,)``."""
    system: Any
    """Linear equations for the strategies, between ``support`` and ``tight``: float64 ``(n, n + 1)``."""
    rows: Any
    """Equilibrium strategy of the row player: float64 ``(m,)``."""
    columns: Any
    """Equilibrium strategy of the column player: float64 ``(n,)``."""


def make_workspace(n_rows: int, n_columns: int) -> Workspace:
    """Return a workspace for games of one size; each thread needs its own."""
    return Workspace(
        np.zeros((n_rows, n_columns)),
        np.zeros((n_rows + 1, n_columns + 1)),
        np.zeros(n_rows, np.int64),
        np.zeros(n_columns, np.int64),
        np.zeros(n_columns, np.int64),
        np.zeros(n_columns, np.int64),
        np.zeros((n_columns, n_columns + 1)),
        np.zeros(n_rows),
        np.zeros(n_columns),
    )


@rule
def equilibrium(work: Workspace) -> float:
    """Return the value of the game in the workspace, and write both equilibrium strategies there.

    The payoffs are in [0, 1], or of that order. A saddle point is returned if there is one. Otherwise the simplex
    method solves the column player's linear programme, ``max sum(y)`` with ``(payoffs + 1) y <= 1``, on a condensed
    tableau; the row player's strategy is its dual. The result is checked: both strategies must secure the same payoff.
    If rounding errors have spoilt steepest ascent, Bland's rule is tried, then both again with payoffs rounded to eight
    digits. If all four fail, the value is nan.
    """
    row, column = saddle_point(work.payoffs)
    if row >= 0:
        work.rows[:] = 0.0
        work.columns[:] = 0.0
        work.rows[row] = 1.0
        work.columns[column] = 1.0
        return work.payoffs[row, column]
    for attempt in range(4):  # steepest ascent, Bland's rule, and both again with rounded payoffs
        if attempt == 2:
            _round(work.payoffs)
        value = _simplex(work, attempt % 2 == 0)
        if _gap(work) < _LARGEST_GAP:
            return value
    return np.nan


@rule
def _round(payoffs: Any) -> None:
    """Round the payoffs, so that payoffs whose difference is only a rounding error become equal."""
    for i in range(payoffs.shape[0]):
        for j in range(payoffs.shape[1]):
            payoffs[i, j] = np.round(payoffs[i, j] / _GRAIN) * _GRAIN


@rule
def _simplex(work: Workspace, steepest: bool) -> float:
    m, n = work.payoffs.shape
    _begin(work, m, n)
    for _ in range(_PIVOTS * (m + n)):
        entering = _entering(work, m, n, steepest)
        leaving = _leaving(work, entering, m, n, steepest) if entering >= 0 else -1
        if leaving < 0:
            break
        _pivot(work.tableau, leaving, entering, m, n)
        work.basis[leaving], work.free[entering] = work.free[entering], work.basis[leaving]
    return _strategies(work, m, n)


@rule
def _strategies(work: Workspace, m: int, n: int) -> float:
    """Return the value of the basis, and write both strategies.

    They are computed anew from the payoffs, so that pivots on small numbers in the tableau do no harm.
    """
    k = 0
    for i in range(m):
        if work.basis[i] < n:
            work.support[k] = work.basis[i]
            k += 1
    k = 0
    for j in range(n):
        if work.free[j] >= n:
            work.tight[k] = work.free[j] - n
            k += 1
    work.rows[:] = 0.0
    work.columns[:] = 0.0
    for i in range(k):
        for j in range(k):
            work.system[i, j] = work.payoffs[work.tight[j], work.support[i]] + 1.0
    _solve_for_strategy(work.system, k, work.tight, work.rows)
    for i in range(k):
        for j in range(k):
            work.system[i, j] = work.payoffs[work.tight[i], work.support[j]] + 1.0
    return 1.0 / _solve_for_strategy(work.system, k, work.support, work.columns) - 1.0


@rule
def _solve_for_strategy(system: Any, k: int, which: Any, strategy: Any) -> float:
    """Solve ``k`` equations whose right sides are 1; write the solution divided by its sum, and return the sum."""
    for i in range(k):
        system[i, k] = 1.0
    _eliminate(system, k)
    total = 0.0
    for i in range(k):
        total += system[i, k]
    positive = 0.0  # rounding may leave a probability just below 0, so negative ones count as 0
    for i in range(k):
        positive += max(0.0, system[i, k])
    for i in range(k):
        strategy[which[i]] = max(0.0, system[i, k]) / positive
    return total


@rule
def _eliminate(system: Any, k: int) -> None:
    """Solve ``k`` linear equations by Gauss-Jordan elimination with pivoting. Column ``k`` holds their right sides; the
    solution replaces it.
    """
    for column in range(k):
        best = column
        for row in range(column + 1, k):
            if abs(system[row, column]) > abs(system[best, column]):
                best = row
        for j in range(k + 1):
            system[column, j], system[best, j] = system[best, j], system[column, j]
        for row in range(k):
            if row != column and system[row, column] != 0.0:
                factor = system[row, column] / system[column, column]
                for j in range(column, k + 1):
                    system[row, j] -= factor * system[column, j]
    for row in range(k):
        system[row, k] /= system[row, row]


@rule
def _gap(work: Workspace) -> float:
    """Return the row player's best payoff against the column player's strategy, minus what its own strategy secures."""
    m, n = work.payoffs.shape
    secured, allowed = np.inf, -np.inf
    for j in range(n):
        won = 0.0
        for i in range(m):
            won += work.rows[i] * work.payoffs[i, j]
        secured = min(secured, won)
    for i in range(m):
        lost = 0.0
        for j in range(n):
            lost += work.columns[j] * work.payoffs[i, j]
        allowed = max(allowed, lost)
    return allowed - secured


@rule
def saddle_point(payoffs: Any) -> Any:
    """Return the first row and column whose payoff is the minimum of its row and the maximum of its column, or (-1,
    -1).
    """
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
    """Write the tableau at ``y = 0``: the slack variables, numbered from ``n`` on, are the basis."""
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
def _entering(work: Workspace, m: int, n: int, steepest: bool) -> int:
    """Return the entering column among those that would raise the sum, or -1 if there is none.

    It is the steepest column or, by Bland's rule, the column of the lowest variable.
    """
    found = -1
    for j in range(n):
        if work.tableau[m, j] < -_LEAST_COST and (
            found < 0
            or (steepest and work.tableau[m, j] < work.tableau[m, found])
            or (not steepest and work.free[j] < work.free[found])
        ):
            found = j
    return found


@rule
def _leaving(work: Workspace, entering: int, m: int, n: int, steepest: bool) -> int:
    """Return the row that limits the entering variable most, or -1 if there is none.

    Of rows with the same limit it is the one with the largest pivot or, by Bland's rule, the one of the lowest
    variable.
    """
    found, limit = -1, 0.0
    for i in range(m):
        pivot = work.tableau[i, entering]
        if pivot > _LEAST_PIVOT:
            ratio = work.tableau[i, n] / pivot
            if (
                found < 0
                or ratio < limit
                or (ratio == limit and steepest and pivot > work.tableau[found, entering])
                or (ratio == limit and not steepest and work.basis[i] < work.basis[found])
            ):
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
