"""Runs that take a moment, and what they played."""

from __future__ import annotations

from typing import Any

import numpy as np

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.generation import Generation
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.esp.team import gather_genomes
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import ScriptedTeams, TrialBatch, TrialResult
from predprey_env import EnvConfig

PAIRINGS = ["cosample", "previous_champion", "hall_of_fame", "mixed"]


def small(kind: str = "split", **esp: Any) -> RunConfig:
    """Three predators and two prey on a small torus, with networks of three hidden neurons."""
    return RunConfig(
        env=EnvConfig(size=6, max_cycles=12),
        predators=SideConfig(controller=kind, n_hidden=3),
        prey=SideConfig(controller=kind, n_hidden=3),
        esp=EspConfig(**{"subpopulation_size": 12, "n_trials": 40, "n_episodes": 2, "hof_mates": 1, **esp}),
        champion=ChampionConfig(n_candidates=3, n_held_out=16),
    )


class Spy(FusedEvaluator):
    """Plays, and remembers the teams of each batch as they were."""

    def __init__(self, env: EnvConfig, threads: int | None = 1) -> None:
        super().__init__(env, threads)
        self.batches: list[TrialBatch] = []
        self.teams: list[dict[str, np.ndarray | None]] = []

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        self.batches.append(batch)
        sides = {"predators": batch.predators, "prey": batch.prey}
        self.teams.append(
            {
                role: None if isinstance(side, ScriptedTeams) else gather_genomes(side, np.arange(len(side.indices)))
                for role, side in sides.items()
            }
        )
        return super().evaluate(batch)


def evolve(config: RunConfig, n: int, evaluator: Any = None) -> tuple[Coevolution, list[Generation]]:
    run = Coevolution(config, new_sides(config), evaluator or FusedEvaluator(config.env, threads=1))
    return run, [run.step(number) for number in range(n)]
