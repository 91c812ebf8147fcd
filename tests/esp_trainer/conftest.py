"""What several test files of the trainer share: random teams to play, and evaluators without a world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import settings

from esp_trainer.coevolution.sides import EvolvingSide, new_sides
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import gather_genomes
from esp_trainer.evaluation.starts import CellStarts, SeedStarts
from esp_trainer.seeding import stream
from esp_trainer.types import ROLES, EvolvedTeams, ScriptedTeams, TeamBatch, TrialBatch, TrialResult

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

settings.register_profile("esp_trainer", deadline=None, derandomize=True, max_examples=40)
settings.load_profile("esp_trainer")


@pytest.fixture(scope="session")
def random_batch() -> Callable[..., TrialBatch]:
    """``random_batch(config, n_trials, n_episodes=1, seed=0)``: random teams, and scripts where the config has them."""

    def draw(config: RunConfig, n_trials: int, n_episodes: int = 1, seed: int = 0) -> TrialBatch:
        generator = stream(seed, "random batch")
        teams: dict[str, TeamBatch] = {
            role: side.algorithm.draw(generator, n_trials) if isinstance(side, EvolvingSide) else side
            for role, side in new_sides(config.replace(seed=seed)).items()
        }
        starts = CellStarts(config.env).draw(generator, n_trials, n_episodes)
        return TrialBatch(teams["predators"], teams["prey"], starts)

    return draw


def genomes_of(teams: TeamBatch) -> np.ndarray | None:
    """What the teams of all trials are made of, copied; nothing of a script."""
    if isinstance(teams, ScriptedTeams):
        return None
    return gather_genomes(teams, np.arange(len(teams.indices)))


class FakeEvaluator:
    """Scores genomes instead of playing, and remembers what it was asked.

    ``score(predators, prey, starts)`` gets the genomes ``(n_trials, n_agents, n_networks, n_hidden, n_genes)`` of both
    sides (None for a script) and the seeds ``(n_trials, n_episodes)``, and returns the fitness of every agent,
    ``(n_trials, n_episodes, n_agents)``.
    """

    def __init__(self, score: Callable[..., np.ndarray], n_prey: int = 2) -> None:
        self.starts = SeedStarts(n_prey)
        self.score = score
        self.n_prey = n_prey
        self.batches: list[TrialBatch] = []
        self.genomes: list[dict[str, np.ndarray | None]] = []
        """Of each batch, both sides' teams as they were when it was asked for."""

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        genomes = {role: genomes_of(getattr(batch, role)) for role in ROLES}
        self.batches.append(batch)
        self.genomes.append(genomes)
        shape = batch.starts.shape
        fitness = np.asarray(self.score(genomes["predators"], genomes["prey"], batch.starts), float)
        return TrialResult(fitness, np.zeros((*shape, self.n_prey), bool), np.ones(shape, int))


@pytest.fixture(scope="session")
def fake_evaluator() -> type[FakeEvaluator]:
    """The class :class:`FakeEvaluator`."""
    return FakeEvaluator


@pytest.fixture(scope="session")
def members() -> Callable[[EvolvedTeams], Any]:
    """``members(teams)``: the genomes of all trials' teams, ``(n_trials, n_agents, n_networks, n_hidden, n_genes)``."""
    return genomes_of


@pytest.fixture(scope="session")
def snapshot() -> Callable[[Path], dict[str, bytes]]:
    """``snapshot(path)``: the bytes of every file but ``timing.jsonl``, which holds wall seconds."""

    def read(path: Path) -> dict[str, bytes]:
        files = (file for file in sorted(path.rglob("*")) if file.is_file() and file.name != "timing.jsonl")
        return {str(file.relative_to(path)): file.read_bytes() for file in files}

    return read
