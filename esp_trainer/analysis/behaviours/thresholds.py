"""The numbers in the definitions, with reasons. None is in the paper."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """Lengths are in cells, distances Manhattan ones (= steps), windows in steps.

    They were set by looking at what fires, on evolved and scripted teams on a torus of 100; a claim that hangs on one
    of them should be looked at with others: ``dataclasses.replace(Thresholds(), near=8)``.
    """

    near: int = 10
    """Who is this close matters now: two who run at each other from here meet in five steps."""

    chase: int = 15
    """A chase is seen over this many steps. A random walk goes towards the prey on 2 of 5 steps, so that it keeps it up
    for 14 of 15 only about once in 40,000 windows."""

    slips: int = 1
    """Steps of a chase that need not go towards the prey: one idle step mends the parity."""

    post: int = 15
    """A blocker has kept to its place for this many steps, as long as a chase is."""

    area: int = 3
    """Longest side of a small area, in steps: 4 x 4 cells, room for a beat or a small circle."""

    run: int = 6
    """An agent that goes as many steps in one direction runs; a random walk of four moves does once in 1,000."""

    path: int = 10
    """How far ahead a path is blocked, as :attr:`near`."""

    lane: int = 2
    """Half the width of a path: who stands 2 cells off it closes it in 2 steps (phase 8 in section VI.B: "a couple of
    steps away from the straight line path of the prey")."""

    wait: int = 8
    """A prey that stays in a tiny area this long waits: twice round the smallest circle, or four times there and
    back."""

    pause: int = 2
    """Longest side of that area, in steps: one that meanders on leaves it."""

    converged: int = 6
    """Who converges on a prey comes this close: three steps before they would meet head-on."""

    approach: int = 4
    """Whoever comes nearer by this much over :attr:`wait` steps approaches: half its steps or more, net."""

    escape: int = 10
    """A dodge is judged this many steps later: who was near could have met the prey twice over."""

    tail: int = 4
    """A predator on a prey's tail is at most so far away."""

    circle: int = 24
    """The longest way round a small circle, in steps: 6 x 6 cells."""

    herd: int = 20
    """Herding is seen over this many steps."""

    gathered: int = 10
    """How much nearer to each other two prey are driven in that time, of the 40 that they could come: 5 each."""

    driven: float = 0.7
    """The share of that time for which both have a predator behind them."""

    reach: int = 15
    """How far away a predator may be that drives a prey, or that holds it from one side."""

    together: int = 5
    """Captures within so many steps are simultaneous: a predator among them could not have caught one and gone for the
    other, were they farther apart."""
