"""The world as text, small enough for a terminal of 80 columns and 24 lines."""

from __future__ import annotations

from string import ascii_lowercase

import numpy as np

from predprey_env.config import EnvConfig
from predprey_env.rules.dynamics import World

_LINES = 20
"""Largest number of lines of the world. Larger worlds are drawn smaller: with its title and edges, a frame of this
height leaves a line for the prompt."""

_CAUGHT = "x"
PREY_LETTERS = ascii_lowercase.replace(_CAUGHT, "")


def text(world: World, config: EnvConfig, steps: int) -> str:
    """Return a frame for a terminal: predators ``0 1 2``, prey ``a b``, caught prey ``x``; north is up.

    A character is twice as high as wide, so the world is drawn two characters wide for each line.
    """
    lines = min(config.size, _LINES)
    cells = np.full((lines, 2 * lines + 1), " ")
    if config.size <= lines:
        cells[:, 1::2] = "·"
    column = 1 + 2 * lines * world.x // config.size
    line = lines - 1 - lines * world.y // config.size
    for agent in reversed(range(config.n_agents)):
        cells[line[agent], column[agent]] = _symbol(world, config, agent)
    caught = config.n_prey - int(world.alive.sum())
    body = "\n".join(f"│{''.join(row)}│" for row in cells)
    edge = "─" * cells.shape[1]
    return f"step {steps}/{config.max_cycles}, caught {caught}/{config.n_prey}\n┌{edge}┐\n{body}\n└{edge}┘"


def _symbol(world: World, config: EnvConfig, agent: int) -> str:
    prey = agent - config.n_predators
    if prey < 0:
        return str(agent % 10)
    return PREY_LETTERS[prey % len(PREY_LETTERS)] if world.alive[prey] else _CAUGHT
