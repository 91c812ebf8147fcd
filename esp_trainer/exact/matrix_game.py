"""Equilibria of zero-sum matrix games in compiled code, for the many small ones that a stochastic game consists of."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from predprey_env.compilation import entry_point, rule

_LEAST_COST = 1e-11
"""A reduced cost below this counts as none: payoffs are shares in [0, 1], in double precision."""
_LEAST_PIVOT = 1e-9
"""Likewise a pivot; smaller ones, which rounding leaves of zeros, would spoil the tableau."""
_LARGEST_GAP = 1e-7
"""Between what the two strategies secure: how exact a value is."""
_GRAIN = 1e-8
"""What payoffs are rounded to where they must be."""
_PIVOTS = 10
"""For each row and column; some five in all are usual."""


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
    support: Any
    """int64 ``(n,)``: columns that the column player uses."""
    tight: Any
    """int64 ``(n,)``: rows that limit it."""
    system: Any
    """float64 ``(n, n + 1)``: the equations between the two."""
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
        np.zeros(n_columns, np.int64),
        np.zeros(n_columns, np.int64),
        np.zeros((n_columns, n_columns + 1)),
        np.zeros(n_rows),
        np.zeros(n_columns),
    )


@rule
def equilibrium(work: Workspace) -> float:
    """The value of the game whose payoffs the workspace holds, all of them in [0, 1] or so; both strategies are left
    there.

    A saddle point if there is one; else the column player's linear programme, ``max sum(y)`` with
    ``(payoffs + 1) y <= 1``, by the simplex method on a condensed tableau, and the row player's strategy is its dual.
    What is found is checked: the two strategies must secure the same. If rounding has led the steepest ascent astray,
    Bland's rule tries, then both with payoffs rounded to eight digits; if all fail the value is nan.
    """
    row, column = saddle_point(work.payoffs)
    if row >= 0:
        work.rows[:] = 0.0
        work.columns[:] = 0.0
        work.rows[row] = 1.0
        work.columns[column] = 1.0
        return work.payoffs[row, column]  # type: ignore[no-any-return]
    for attempt in range(4):
        if attempt == 2:
            _round(work.payoffs)
        value = _simplex(work, attempt % 2 == 0)
        if _gap(work) < _LARGEST_GAP:
            return value
    return np.nan


@rule
def _round(payoffs: Any) -> None:
    """Make payoffs equal that differ by less than counts."""
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
    """Both strategies and the value that belong to the basis, worked out anew from the payoffs: what pivots on small
    numbers have done to the tableau does not matter.
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
    _solve_for_chances(work.system, k, work.tight, work.rows)
    for i in range(k):
        for j in range(k):
            work.system[i, j] = work.payoffs[work.tight[i], work.support[j]] + 1.0
    return 1.0 / _solve_for_chances(work.system, k, work.support, work.columns) - 1.0


@rule
def _solve_for_chances(system: Any, k: int, which: Any, chances: Any) -> float:
    """Solve ``k`` equations whose right sides are 1; write the solution's shares of its sum, and return the sum."""
    for i in range(k):
        system[i, k] = 1.0
    _eliminate(system, k)
    total = 0.0
    for i in range(k):
        total += system[i, k]
    positive = 0.0  # rounding may leave one just below 0
    for i in range(k):
        positive += max(0.0, system[i, k])
    for i in range(k):
        chances[which[i]] = max(0.0, system[i, k]) / positive
    return total


@rule
def _eliminate(system: Any, k: int) -> None:
    """Solve ``k`` linear equations, whose right sides are the column after theirs; the solution takes their place."""
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
    """How much more the row player may win against the column player's strategy than its own secures."""
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
def _entering(work: Workspace, m: int, n: int, steepest: bool) -> int:
    """Of the columns that would raise the sum the steepest, or that with the lowest variable; -1 if there is none."""
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
    """The row that limits the entering variable most; of equal ones that with the largest pivot or lowest variable."""
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


@entry_point
def _solve(work: Workspace) -> float:
    return equilibrium(work)


def solve_game(payoffs: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Value, and an equilibrium strategy of each player, of the game in which the row player wins ``payoffs``.

    Args:
        payoffs: Shares in [0, 1], ``(m, n)``; other numbers from 0 on, as long as they are of that size.
    """
    work = make_workspace(*payoffs.shape)
    work.payoffs[:] = payoffs
    if not (work.payoffs >= 0).all():
        raise ValueError("payoffs must be at least 0")
    value = float(_solve(work))
    return value, work.rows, work.columns
