"""An observation outside the package with the arithmetic of the paper's, as a user would write it."""

from __future__ import annotations

from typing import Any, NamedTuple

from predprey_env import observe, offset_to
from predprey_env.jit import as_float, rule, store


class OwnSight(NamedTuple):
    """The offsets to the opponents."""

    teammates: bool = False

    def n_seen(self, n_agents: int, n_opponents: int) -> int:  # noqa: ARG002
        """Return the length of an observation."""
        return 2 * n_opponents

    def groups(self, n_agents: int, n_opponents: int) -> list[list[int]]:  # noqa: ARG002
        """Return the entries of each opponent."""
        return [[2 * i, 2 * i + 1] for i in range(n_opponents)]

    def bounds(self, n_agents: int, n_opponents: int, size: int) -> tuple[int, int]:  # noqa: ARG002
        """Return the lowest and the highest offset."""
        return -(size // 2), size - size // 2 - 1


@rule
def own_sight(sight: Any, world: Any, moved: Any, agent: int, rules: Any, out: Any, row: int) -> int:  # noqa: ARG001
    """Write the offsets to the opponents of an agent."""
    hunts = agent < rules.n_predators
    first = rules.n_predators if hunts else 0
    for other in range(first, first + (rules.n_prey if hunts else rules.n_predators)):
        dx, dy = offset_to(world, agent, other, rules)
        store(out, row, as_float(dx))
        store(out, row + 1, as_float(dy))
        row += 2
    return row


observe.register(OwnSight, own_sight)
