"""The world as text and as a picture."""

from __future__ import annotations

import numpy as np

from predprey_env.config import EnvConfig
from predprey_env.dynamics import World

PAPER, INK, PREDATOR, PREY = (250, 250, 247), (190, 190, 186), (213, 94, 0), (0, 114, 178)
"""Background, a caught prey, and the two teams in colours that the colour-blind tell apart (Okabe & Ito 2008)."""

# Larger worlds are drawn smaller.
_LARGEST_TEXT = (50, 25)  # columns, lines
_PICTURE = 400  # pixels


def text(world: World, config: EnvConfig, steps: int) -> str:
    """A frame for a terminal: predators ``1 2 3``, prey ``a b``, caught prey ``x``; north is up."""
    columns, lines = (min(config.size, most) for most in _LARGEST_TEXT)
    cells = np.full((lines, columns), "·" if config.size <= columns else " ")
    column = world.x * columns // config.size
    line = lines - 1 - world.y * lines // config.size
    for agent in reversed(range(config.n_agents)):
        cells[line[agent], column[agent]] = _symbol(world, config, agent)
    caught = config.n_prey - int(world.alive.sum())
    body = "\n".join(f"│{''.join(row)}│" for row in cells)
    edge = "─" * columns
    return f"step {steps}/{config.max_cycles}, caught {caught}/{config.n_prey}\n┌{edge}┐\n{body}\n└{edge}┘"


def _symbol(world: World, config: EnvConfig, agent: int) -> str:
    prey = agent - config.n_predators
    if prey < 0:
        return "123456789"[agent % 9]
    return "abcdefghijklm"[prey % 13] if world.alive[prey] else "x"


def picture(world: World, config: EnvConfig) -> np.ndarray:
    """An RGB frame, uint8 ``(height, width, 3)``: predators round, prey square, caught prey grey; north is up."""
    side = config.size * max(1, _PICTURE // config.size) if config.size <= _PICTURE else _PICTURE
    scale = side / config.size
    frame = np.full((side, side, 3), PAPER, np.uint8)
    radius = max(2.0, side / 65, scale / 2)
    pixels = np.arange(side) + 0.5
    for agent in reversed(range(config.n_agents)):
        # The torus has no edge: an agent at the border shows on both sides of the picture.
        across = _away(pixels - (world.x[agent] + 0.5) * scale, side)[None, :]
        up = _away(pixels - (config.size - world.y[agent] - 0.5) * scale, side)[:, None]
        prey = agent - config.n_predators
        if prey < 0:
            frame[across**2 + up**2 <= radius**2] = PREDATOR
        else:
            frame[np.maximum(abs(across), abs(up)) <= 0.85 * radius] = PREY if world.alive[prey] else INK
    return frame


def _away(offset: np.ndarray, side: int) -> np.ndarray:
    return (offset + side / 2) % side - side / 2
