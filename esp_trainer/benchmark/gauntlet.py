"""The gauntlet: a candidate plays every team of the zoo and every script, and is rated by the results."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.games import solve_matrix
from esp_trainer.analysis.progress import generalist
from esp_trainer.analysis.ratings import rate
from esp_trainer.arrays import Fractions
from esp_trainer.benchmark.match import Arena, Challenger, Meeting
from esp_trainer.seeding import stream
from esp_trainer.statistics import Rate, wilson_of
from esp_trainer.teams.zoo import FIRST_ZOO, HELD_OUT_PREFIX, Zoo, load_team
from esp_trainer.types import Contestant, Role, ScriptedTeams
from predprey_env.agents import other_team
from predprey_env.config import EnvConfig
from predprey_env.policies import SCRIPTS

PARTS = ("held out", "older held out", "zoo", "scripts")
"""Parts of the gauntlet: held-out teams of the race presets, held-out teams of the first zoo, teams that anyone may
train against, and scripts."""


@dataclass(frozen=True)
class OpponentResult:
    """Results of a candidate against one opponent."""

    opponent: str
    part: str
    """Name in :data:`PARTS`."""
    caught: Rate
    """Fraction of prey caught, whichever side is measured. The prey of one episode partly share their fate, so the
    interval counts each episode as one trial."""
    fitness: float
    """Fitness of the candidate, mean over its agents and the episodes."""
    all_caught_after: float | None
    """Mean length of the episodes in which all prey were caught, in steps; None if there was none."""


@dataclass(frozen=True)
class Standing:
    """Summary of all rows. A score is the fraction of prey caught for predators, and of prey not caught for prey."""

    generalist: dict[str, tuple[float, float]]
    """Part -> mean score, and mean score against the worst tenth of its opponents (Chong, Tino & Yao 2008)."""
    rating: Rate
    """Rating among all teams and scripts of the task, in points: 400 are ten to one (Bradley & Terry 1952)."""
    rank: int
    """Rank by rating: 1 if no team or script of the candidate's role has a higher rating."""
    of: int
    """Number of teams and scripts of the candidate's role, including the candidate."""
    gain: float
    """Score against the optimal mixture of all opponents, minus the value of the game between them and the zoo's own
    teams and scripts of the candidate's role. Above 0, the candidate exploits the gauntlet."""
    exploited: float
    """Value of the game (see ``gain``) minus the score against the worst opponent: 0 or less if no opponent exploits
    the candidate."""


class Gauntlet:
    """All opponents of a candidate of a role.

    Args:
        zoo: The teams of the task, with their results against each other.
        env: World of the task.
        role: Role of the candidate.
        n_episodes: Number of episodes against each opponent.
        seed: Seed of the starts; the same seed gives the same table.
    """

    def __init__(self, zoo: Zoo, env: EnvConfig, role: Role, n_episodes: int, seed: int) -> None:
        self.zoo, self.role, self.seed = zoo, role, seed
        self.n_episodes, self.n_prey = n_episodes, env.n_prey
        self.opponents = sorted(zoo.names(other_team(role)), key=lambda name: PARTS.index(part_of(name)))
        self._arena = Arena(env, n_episodes, seed)

    def play(self, candidate: Challenger) -> Iterator[OpponentResult]:
        """Yield the row of each opponent. Raises :class:`~esp_trainer.types.PolicyError` if the candidate fails."""
        for name in self.opponents:
            yield self._row(name, self._arena.meet(candidate, self.role, _opponent(name, other_team(self.role))))

    def _row(self, name: str, found: Meeting) -> OpponentResult:
        all_caught = found.captured == self.n_prey
        return OpponentResult(
            opponent=name,
            part=part_of(name),
            caught=wilson_of(float(found.captured.mean() / self.n_prey), self.n_episodes),
            fitness=float(found.fitness.mean()),
            all_caught_after=float(found.steps[all_caught].mean()) if all_caught.any() else None,
        )

    def standing(self, rows: list[OpponentResult]) -> Standing:
        """Return the summary of the rows of all opponents."""
        by_name = {row.opponent: row.caught.rate for row in rows}
        columns = self.zoo.names(other_team(self.role))
        found = np.array([by_name[name] for name in columns])
        scores, known = self._scores(found), self._scores(self.zoo.caught)
        known = known if self.role == "predators" else known.T  # rows are the candidate's role
        game = solve_matrix(known)
        parts = {part: [i for i, name in enumerate(columns) if part_of(name) == part] for part in PARTS}
        both = {part: generalist(scores[None, rows]) for part, rows in parts.items() if rows}
        rating, rank, of = self._rating(found)
        return Standing(
            generalist={part: (float(each.mean[0]), float(each.worst[0])) for part, each in both.items()},
            rating=rating,
            rank=rank,
            of=of,
            gain=float(scores @ game.prey - game.value),
            exploited=float(game.value - scores.min()),
        )

    def _scores(self, caught: Fractions) -> Fractions:
        return caught if self.role == "predators" else 1 - caught

    def _rating(self, found: Fractions) -> tuple[Rate, int, int]:
        """Return the candidate's rating, its rank, and the number of teams and scripts that are ranked.

        The candidate is one more row, or column, of the zoo's matrix.
        """
        caught, side = self.zoo.caught, 0 if self.role == "predators" else 1
        whole = np.concatenate([caught, np.expand_dims(found, side)], axis=side)
        episodes = np.full(whole.shape, self.zoo.n_episodes)
        episodes[(-1, slice(None)) if side == 0 else (slice(None), -1)] = self.n_episodes
        rated = rate(whole, episodes, stream(self.seed, "ratings"))[side]
        own = float(rated.rating[-1])
        return (
            Rate(own, float(rated.low[-1]), float(rated.high[-1])),
            int((rated.rating > own).sum()) + 1,
            len(rated.rating),
        )


def part_of(name: str) -> str:
    """Return the part of the gauntlet that an opponent belongs to."""
    if name.startswith(HELD_OUT_PREFIX):
        return "older held out" if name.removeprefix(HELD_OUT_PREFIX).startswith(FIRST_ZOO) else "held out"
    return "scripts" if any(name in scripts for scripts in SCRIPTS.values()) else "zoo"


def _opponent(name: str, role: Role) -> Contestant:
    return ScriptedTeams(name) if name in SCRIPTS[role] else load_team(name)
