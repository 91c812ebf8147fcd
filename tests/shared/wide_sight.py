"""An observation of one's own that several files of tests use: its kernel takes ten seconds to compile."""

from __future__ import annotations

from typing import Any, NamedTuple

from predprey_env import move_of, observe, offset_to
from predprey_env.jit import as_float, rule, store

WIDE = f"{__name__}:Wide"
WIDTH = 40


class Wide(NamedTuple):
    """The offset to each opponent, its last move, and much that means nothing."""

    factor: float = 0.5

    def n_seen(self, n_agents: int, n_opponents: int) -> int:
        return WIDTH * n_opponents

    def groups(self, n_agents: int, n_opponents: int) -> list[range]:
        return [range(WIDTH * i, WIDTH * (i + 1)) for i in range(n_opponents)]

    def bounds(self, n_agents: int, n_opponents: int, size: int) -> tuple[list[float], float]:
        return [-float(size)] * (WIDTH * n_opponents), float(size)


@observe.register(Wide)
@rule
def wide(sight: Any, world: Any, moved: Any, agent: int, rules: Any, out: Any, row: int) -> int:
    hunts = agent < rules.n_predators
    first, n_opponents = (rules.n_predators, rules.n_prey) if hunts else (0, rules.n_predators)
    for other in range(first, first + n_opponents):
        dx, dy = offset_to(world, agent, other, rules)
        store(out, row, as_float(dx) * as_float(sight.factor))
        store(out, row + 1, as_float(dy) * as_float(sight.factor))
        mx, my = move_of(world, moved, agent, other, rules)
        store(out, row + 2, as_float(mx))
        store(out, row + 3, as_float(my))
        for i in range(4, WIDTH):
            store(out, row + i, as_float(0))
        row += WIDTH
    return row
