"""Measurements of a run, from its champions alone; all opponents are fixed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from race.measure import Arrays, behaviours, measured_file

from esp_trainer.analysis.best_response import evolve_response
from esp_trainer.analysis.comparison import caught_by_each, script_panel
from esp_trainer.analysis.cross_play import own_cross_play
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import write_npz
from esp_trainer.sweep.plan import PlannedRun
from predprey_env.agents import other_team

GENERATIONS = 46
"""Generations of a run that meet each other: every tenth of the paper's 450."""
WATCHED = 24
"""Generations whose champions are watched for behaviours."""
PANEL = 3
"""Champions of each held-out run that everyone is measured against: after each third of it."""
RESPONSE_GENERATIONS = 60
RESPONSE_SEED = 2000


def measure(place: Path, run: PlannedRun, panel: Sequence[Path], thorough: bool) -> None:
    """Measure a run against itself, the runs of a panel and scripts; if ``thorough``, behaviours and responses too."""
    history = History.of_run(place / run.name)
    evaluator = FusedEvaluator(history.config.env, threads=1)
    generations = history.sample(GENERATIONS)
    met = own_cross_play(history, evaluator, n_generations=GENERATIONS)
    found: Arrays = {f"curve.{name}": values.astype(np.float32) for name, values in history.curves.items()}
    found |= {"config": np.array(run.config.model_dump_json()), "generations": generations, "met": met.met}
    found |= {f"own.{name}": getattr(met, name).astype(np.int16) for name in ("captured", "none_caught", "all_caught")}
    for role in history.champions:
        mine, other = history.entrants(role, generations), other_team(role)
        members = map(History.of_run, panel)
        held_out = [each.entrants(other, len(each) * np.arange(1, PANEL + 1) // PANEL - 1) for each in members]
        for name, opponents in {"panel": held_out, "scripts": script_panel()[other]}.items():
            found[f"{name}.{role}"] = caught_by_each(role, mine, opponents, evaluator).astype(np.float32)
        if thorough:
            seed = RESPONSE_SEED + run.config.seed
            n_generations = min(RESPONSE_GENERATIONS, len(history))  # fewer in small
            answer = evolve_response(history, role, evaluator, n_generations=n_generations, seed=seed)
            found[f"response.{role}"] = np.array([answer.before, answer.after])
    if thorough:
        found["watched"] = history.sample(WATCHED)
        found |= behaviours(history, evaluator, found["watched"])
    write_npz(measured_file(place, run), found)
