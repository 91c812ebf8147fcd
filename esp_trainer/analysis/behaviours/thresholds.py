"""Thresholds in the definitions of the behaviours, with reasons. The paper gives none of them."""

from __future__ import annotations

from typing import NamedTuple


class Thresholds(NamedTuple):
    """Thresholds of the detectors: distances are Manhattan distances in cells (= steps), windows are in steps.

    The values were chosen by looking at what they detect in evolved and scripted teams on a torus of 100 x 100 cells. A
    claim that depends on one of them should be checked with other values, for example
    ``Thresholds(near=8)``.
    """

    near: int = 10
    """Maximum distance of a predator that matters to a prey now: two agents that run at each other meet in 5 steps."""

    chase: int = 15
    """Length of a chase, in steps. A random walk goes towards the prey in 2 of 5 steps, so it does so in 14 of 15 steps
    only in about 1 of 40,000 windows."""

    slips: int = 1
    """Number of steps of a chase that need not go towards the prey: a predator may idle once to correct the parity."""

    post: int = 15
    """Number of steps for which a blocker has kept to its place: the length of a chase."""

    area: int = 3
    """Maximum side of a blocker's area, in steps: 4 x 4 cells, enough to walk to and fro or in a small circle."""

    run: int = 6
    """Number of successive steps in one direction that count as a run. A random walk with four moves does this with
    probability 1/1,000."""

    path: int = 10
    """Maximum distance ahead at which a path is blocked, equal to :attr:`near`."""

    lane: int = 2
    """Maximum distance of a blocker from the line of a path, which it can then close in 2 steps (phase 8 in section
    VI.B: "a couple of steps away from the straight line path of the prey")."""

    wait: int = 8
    """Number of steps in a tiny area that count as waiting: twice round the smallest circle, or four times there and
    back."""

    pause: int = 2
    """Maximum side of that tiny area, in steps: a prey that moves on, even slowly, leaves it."""

    converged: int = 6
    """Maximum distance of a predator that has converged on a prey: three steps before they would meet head-on."""

    approach: int = 4
    """Minimum decrease of the distance over :attr:`wait` steps that counts as an approach: half the steps, net."""

    escape: int = 10
    """Number of steps after which an evasion is judged: twice as long as a near predator needs to meet the prey."""

    tail: int = 4
    """Maximum distance of a predator on a prey's tail."""

    circle: int = 24
    """Maximum length of a small circle, in steps: once round a square of 7 x 7 cells."""

    herd: int = 20
    """Number of steps over which herding is detected."""

    gathered: int = 10
    """Minimum decrease of the distance between two herded prey: 5 steps each, of the 40 that it could decrease by."""

    driven: float = 0.7
    """Minimum fraction of the steps in which both herded prey have a predator behind them."""

    reach: int = 15
    """Maximum distance of a predator that drives a prey, or that keeps it from going to one side."""

    together: int = 5
    """Maximum number of steps between simultaneous captures. In this time a predator cannot catch one prey and then
    another, unless the two are close together."""
