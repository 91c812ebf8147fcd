"""An episode as the detectors read it, and the functions with which they query it at a row.

Detectors are rules (see :mod:`predprey_env.jit.compilation`) over one episode, so that the same code is compiled for
Python and translated to JavaScript for the page of a report. They compute with integers and 64-bit floats. Functions do
not check that a row exists: a detector asks :func:`reaches` or :func:`is_free_around` before it looks back or ahead.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple, TypeAlias

from predprey_env.jit import rule
from predprey_env.jit.values import Array
from predprey_env.rules.torus import displacement, manhattan

Vector: TypeAlias = tuple[int, int]
"""A displacement (x, y), in cells: east is +x, north is +y."""


class Episode(NamedTuple):
    """An episode. Row 0 is the start, row ``t`` is after step ``t``, and rows after the end repeat the last one."""

    cells: Array
    """Unwrapped cells of all agents, predators first, int64 ``(n_rows, n_agents, 2)``: a step across the seam of the
    torus changes a coordinate by 1 like any other step."""

    offsets: Array
    """Displacement from each prey to each agent, the shortest way round: int64 ``(n_rows, n_agents, n_prey, 2)``."""

    capture_times: Array
    """Row at which each prey is caught; at least ``n_rows`` if it never is: int ``(n_prey,)``."""

    length: int
    """Index of the last row: the number of steps."""

    n_predators: int

    n_prey: int

    attacks: Array
    """Mask of which predators attack which prey: bool ``(n_rows, n_predators, n_prey)``, see :mod:`.roles`."""

    blocks: Array
    """Mask of which predators block which prey: bool ``(n_rows, n_predators, n_prey)``, see :mod:`.roles`."""


class Episodes(NamedTuple):
    """A set of episodes of the same teams. Arrays are those of :class:`Episode`, with a first axis of episodes."""

    cells: Array
    offsets: Array
    capture_times: Array
    lengths: Array
    n_predators: int
    n_prey: int
    attacks: Array
    blocks: Array


# -- preparation --------------------------------------------------------------------------------------------------


@rule
def episode_of(episodes: Episodes, number: int) -> Episode:
    """Return one episode of a set; its arrays are those of the set."""
    return Episode(
        episodes.cells[number],
        episodes.offsets[number],
        episodes.capture_times[number],
        episodes.lengths[number],
        episodes.n_predators,
        episodes.n_prey,
        episodes.attacks[number],
        episodes.blocks[number],
    )


@rule
def unwrap(trace: Array, length: int, size: int, cells: Array) -> None:
    """Write the unwrapped cells of an episode, from its cells in [0, size)."""
    for agent in range(len(cells[0])):
        for axis in range(2):
            cells[0, agent, axis] = trace[0, agent, axis]
            for row in range(1, len(cells)):
                step = displacement(trace[row - 1, agent, axis], trace[row, agent, axis], size) if row <= length else 0
                cells[row, agent, axis] = cells[row - 1, agent, axis] + step


@rule
def measure_offsets(trace: Array, n_predators: int, size: int, offsets: Array) -> None:
    """Write the displacement from each prey to each agent, from the cells of an episode in [0, size)."""
    for row in range(len(offsets)):
        for agent in range(len(offsets[0])):
            for prey in range(len(offsets[0]) - n_predators):
                for axis in range(2):
                    start, end = trace[row, n_predators + prey, axis], trace[row, agent, axis]
                    offsets[row, agent, prey, axis] = displacement(start, end, size)


# -- vectors ------------------------------------------------------------------------------------------------------


@rule
def dot(one: Vector, other: Vector) -> int:
    """Return the scalar product."""
    return one[0] * other[0] + one[1] * other[1]


@rule
def cross(one: Vector, other: Vector) -> int:
    """Return the cross product: positive where ``other`` points to the left of ``one``."""
    return one[0] * other[1] - one[1] * other[0]


@rule
def cosine(one: Vector, other: Vector) -> float:
    """Return the cosine of the angle between two vectors; 1 where one of them is 0."""
    squares = 1.0 * dot(one, one) * dot(other, other)  # as a float, because a product of squares may not fit
    return dot(one, other) / sqrt(squares) if squares > 0 else 1.0


# -- time ---------------------------------------------------------------------------------------------------------


@rule
def reaches(episode: Episode, row: int, back: int, on: int) -> bool:
    """Return whether the episode has ``back`` rows before a row and ``on`` rows after it."""
    return row >= back and row + on <= episode.length


@rule
def is_free(episode: Episode, row: int, prey: int) -> bool:
    """Return whether a prey is not yet caught at a row of the episode."""
    return row <= episode.length and row < episode.capture_times[prey]


@rule
def is_free_around(episode: Episode, row: int, prey: int, back: int, on: int) -> bool:
    """Return whether a prey is free from ``back`` rows earlier to ``on`` rows later."""
    # Prey are never freed, so a prey that is free at a row was free at all rows before it.
    return reaches(episode, row, back, on) and is_free(episode, row + on, prey)


@rule
def was_free(episode: Episode, row: int, prey: int, rows: int) -> bool:
    """Return whether a prey was free for the ``rows`` rows before a row."""
    return reaches(episode, row, rows, 0) and is_free(episode, row - 1, prey)


# -- agents -------------------------------------------------------------------------------------------------------


@rule
def way(episode: Episode, start: int, end: int, agent: int) -> Vector:
    """Return the displacement of an agent between two rows."""
    return (
        episode.cells[end, agent, 0] - episode.cells[start, agent, 0],
        episode.cells[end, agent, 1] - episode.cells[start, agent, 1],
    )


@rule
def extent(episode: Episode, row: int, agent: int, rows: int) -> int:
    """Return the longer side, in steps, of the box that holds a path over a row and the ``rows`` rows before it."""
    longer = 0
    for axis in range(2):
        low, high = episode.cells[row, agent, axis], episode.cells[row, agent, axis]
        for earlier in range(row - rows, row):
            low = min(low, episode.cells[earlier, agent, axis])
            high = max(high, episode.cells[earlier, agent, axis])
        longer = max(longer, high - low)
    return longer


@rule
def turned(episode: Episode, row: int, agent: int) -> bool:
    """Return whether an agent's step to a row, at least 2, differs from its step before."""
    one, other = way(episode, row - 2, row - 1, agent), way(episode, row - 1, row, agent)
    return one[0] != other[0] or one[1] != other[1]


@rule
def offset(episode: Episode, row: int, agent: int, prey: int) -> Vector:
    """Return the displacement from a prey to another agent, the shortest way round."""
    return episode.offsets[row, agent, prey, 0], episode.offsets[row, agent, prey, 1]


@rule
def distance_to_prey(episode: Episode, row: int, agent: int, prey: int) -> int:
    """Return the toroidal Manhattan distance between a prey and another agent, in steps."""
    steps: int = manhattan(episode.offsets[row, agent, prey, 0], episode.offsets[row, agent, prey, 1])
    return steps


@rule
def approached(episode: Episode, row: int, predator: int, prey: int, rows: int) -> int:
    """Return by how many steps a predator came nearer to a prey in the ``rows`` rows before a row."""
    return distance_to_prey(episode, row - rows, predator, prey) - distance_to_prey(episode, row, predator, prey)


@rule
def led_towards(episode: Episode, row: int, predator: int, prey: int) -> bool:
    """Return whether a predator's step to a row, at least 1, led towards the prey's cell before the step."""
    return dot(way(episode, row - 1, row, predator), offset(episode, row - 1, predator, prey)) < 0


@rule
def running(episode: Episode, row: int, prey: int, run: int) -> Vector:
    """Return the direction of a prey's last ``run`` steps if they all went the same way, else 0."""
    agent = episode.n_predators + prey
    if not reaches(episode, row, run, 0):
        return 0, 0
    for each in range(row - run + 2, row + 1):
        if turned(episode, each, agent):
            return 0, 0
    return way(episode, row - 1, row, agent)


@rule
def in_the_way(episode: Episode, row: int, predator: int, prey: int, run: int, path: int, lane: int) -> bool:
    """Return whether a predator is in the way of a prey.

    The prey has run ``run`` steps in one direction, and the predator is at most ``path`` ahead of it and at most
    ``lane`` to the side of its line.
    """
    direction, there = running(episode, row, prey, run), offset(episode, row, predator, prey)
    forward = dot(there, direction)
    return forward > 0 and forward <= path and abs(cross(there, direction)) <= lane


@rule
def nearest_distance(episode: Episode, row: int, prey: int) -> int:
    """Return the distance from a prey to its nearest predator, in steps."""
    least = distance_to_prey(episode, row, 0, prey)
    for predator in range(1, episode.n_predators):
        least = min(least, distance_to_prey(episode, row, predator, prey))
    return least
