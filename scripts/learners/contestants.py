"""Who is compared: for each kind of team how it is made, and with which seeds."""

from __future__ import annotations

from dataclasses import dataclass, replace

TASK = "3v2"
SEEDS = (700, 701, 702, 703, 704)
PPO_STEPS = 15_000_000
"""Of agents, of one side; self-play has as many for each."""
GENERATIONS = 450
LONGER = 7
"""How many times the usual generations the longer runs have: about the CPU time of PPO for both sides."""


@dataclass(frozen=True)
class Contestant:
    """A kind of team."""

    name: str
    meaning: str
    method: str
    """``ppo``, ``evolved``, ``answer`` (evolved against frozen PPO) or ``script``."""
    roles: tuple[str, ...] = ("predators", "prey")
    """Which sides it has."""
    seeds: tuple[int, ...] = SEEDS
    reward: str = "dense"
    """Of PPO."""
    trained: str = "apart"
    """Of PPO: the sides ``apart``, each against the zoo, or ``together``, against each other."""
    part: int = 10
    """Of PPO: which of ten checkpoints it is."""
    steps: int = PPO_STEPS
    n_worlds: int = 8
    """Of PPO, for each opponent."""
    preset: str = ""
    """Of evolved ones."""
    generations: int = GENERATIONS

    @property
    def run(self) -> str:
        """The run that it comes from; several contestants may share one."""
        return f"{self.trained}-{self.reward}" if self.method == "ppo" else self.name


CONTESTANTS = [
    Contestant("ppo", "PPO against the zoo, dense rewards", "ppo"),
    Contestant("ppo, early", "the same after a tenth of the steps", "ppo", part=1),
    Contestant("ppo, terminal", "PPO against the zoo, terminal rewards", "ppo", reward="terminal"),
    Contestant("ppo, self-play", "PPO against PPO, present and past", "ppo", trained="together", n_worlds=48),
    Contestant("paper", "evolved, `paper-3v2`", "evolved", preset="paper-3v2"),
    Contestant(
        "paper, longer",
        f"the same with {LONGER} times the generations",
        "evolved",
        preset="paper-3v2",
        generations=LONGER * GENERATIONS,
    ),
    Contestant("modern", "evolved, `modern-3v2`", "evolved", preset="modern-3v2"),
    Contestant(
        "modern, longer",
        f"the same with {LONGER} times the generations",
        "evolved",
        preset="modern-3v2",
        generations=LONGER * GENERATIONS,
    ),
    Contestant("drawn", "evolved, `drawn-3v2`", "evolved", preset="drawn-3v2"),
    Contestant(
        "answer",
        "evolved as `drawn`, against the frozen `ppo, self-play` of its seed",
        "answer",
        preset="drawn-3v2",
    ),
    *(
        Contestant(script, "scripted predators", "script", roles=("predators",), seeds=(0,))
        for script in ("greedy_chase", "parity_chase", "intercept", "surround")
    ),
    *(
        Contestant(script, "scripted prey", "script", roles=("prey",), seeds=(0,))
        for script in ("flee_nearest", "flee_centroid", "run_straight")
    ),
    Contestant("random", "at random", "script", seeds=(0,)),
]
"""In the order of the tables."""


def small(contestant: Contestant) -> Contestant:
    """The same in seconds."""
    seeds = contestant.seeds[:2]
    return replace(
        contestant, seeds=seeds, steps=150_000, n_worlds=1, generations=max(2, contestant.generations // 200)
    )
