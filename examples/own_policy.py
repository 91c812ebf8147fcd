"""Write a policy, play it against an evolved team, and benchmark it against every team of the zoo and every script.

Run: `python examples/own_policy.py`. It takes 12 CPU-seconds, and 13 more the first time, to compile. It prints

    against modern-3v1/prey/seed-500-late: 0.11 of the prey caught, 137 steps an episode
    held out      : 0.06 of the prey of 9 teams caught
    older held out: 0.19 of the prey of 27 teams caught
    zoo           : 0.15 of the prey of 36 teams caught
    scripts       : 0.48 of the prey of 4 teams caught
    rating -352: number 76 of 78

So this simple chase is no match for evolved prey. The same table by a command, with intervals and a leaderboard:
`cd examples; esp-trainer benchmark --policy own_policy:Weavers --role predators --task 3v1 --leaderboard board.md`.
"""

import random
import sys

from esp_trainer import WORLDS, Arena, Gauntlet, load_team, load_zoo
from esp_trainer.benchmark.gauntlet import PARTS

PREY = "modern-3v1/prey/seed-500-late"


class Weavers:
    """Go to the nearest prey, along either leg of the way with a probability in proportion to it; no base class."""

    def reset(self, seed=None):
        self.random = random.Random(seed)  # an episode starts; all randomness follows from its seed

    def act(self, observations):
        """Return an action for each agent: 0 east, 1 west, 2 north, 3 south, 4 idle; offsets are in cells."""
        return {agent: self._move(seen.tolist()) for agent, seen in observations.items()}

    def _move(self, seen):
        ways = [(abs(dx) + abs(dy), dx, dy) for dx, dy in zip(seen[::2], seen[1::2], strict=True) if dx or dy]
        if not ways:  # all prey are caught, and seen at (0, 0)
            return 4
        length, dx, dy = min(ways)
        if length % 2:  # nobody lands on a prey that moves too from an odd distance: wait once
            return 4
        if self.random.random() * length < abs(dx):
            return 0 if dx > 0 else 1
        return 2 if dy > 0 else 3


if __name__ == "__main__":
    n_episodes = 1 if "--quick" in sys.argv else 64
    policy, config = Weavers(), WORLDS["3v1"]

    found = Arena(config, n_episodes, seed=0).meet(policy, "predators", load_team(PREY))
    print(f"against {PREY}: {found.captured.mean():.2f} of the prey caught, {found.steps.mean():.0f} steps an episode")

    gauntlet = Gauntlet(load_zoo("3v1"), config, "predators", n_episodes, seed=0)
    rows = list(gauntlet.play(policy))
    for part in PARTS:
        caught = [row.caught.rate for row in rows if row.part == part]
        print(f"{part:14}: {sum(caught) / len(caught):.2f} of the prey of {len(caught)} teams caught")
    standing = gauntlet.standing(rows)
    print(f"rating {standing.rating.rate:.0f}: number {standing.rank} of {standing.of}")
