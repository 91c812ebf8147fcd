"""Configs of runs that take a moment."""

from __future__ import annotations

from typing import Any

from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from predprey_env import EnvConfig


def small(kind: str = "split", **esp: Any) -> RunConfig:
    """Three predators and two prey on a small torus, with networks of three hidden neurons."""
    return RunConfig(
        env=EnvConfig(size=6, max_cycles=12),
        predators=SideConfig(controller=kind, n_hidden=3),
        prey=SideConfig(controller=kind, n_hidden=3),
        esp=EspConfig(**{"subpopulation_size": 12, "n_trials": 40, "n_episodes": 2, "hof_mates": 1, **esp}),
        champion=ChampionConfig(n_candidates=3, n_held_out=16),
    )
