"""What is measured of a run, from its champions alone: everything here is against opponents that stand still."""

from __future__ import annotations

import json
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from tqdm import tqdm

from esp_trainer import RunConfig
from esp_trainer.analysis.best_response import evolve_response
from esp_trainer.analysis.comparison import caught_by_each, scripts
from esp_trainer.analysis.cross_play import own_cross_play
from esp_trainer.analysis.history import History
from esp_trainer.analysis.watch import watch
from esp_trainer.evaluation.fused import FusedEvaluator
from predprey_env.agents import other_team
from reproduction.arms import Arm, world_of
from reproduction.evolve import history_file

GENERATIONS = 46
"""Generations of a run that meet each other: every tenth of the paper's 450."""
WATCHED = 24
"""Generations whose champions are watched for behaviours."""
PANEL = 3
"""Champions of each held-out run that everyone is measured against: after each third of it."""
RESPONSE_GENERATIONS = 60
_RESPONSE_SEED = 2000

Measured = dict[str, np.ndarray]


def measured_file(place: Path, arm: Arm, seed: int) -> Path:
    """Return the file for the measurements of a run."""
    return place / arm.name / f"seed-{seed}.npz"


def is_measured(place: Path, arm: Arm, seed: int) -> bool:
    """Whether a run of this very setting has been measured."""
    file = measured_file(place, arm, seed)
    if not file.exists():
        return False
    with np.load(file) as arrays:
        return "about" in arrays and config_of(str(arrays["about"])) == arm.run(seed)


def config_of(about: str) -> RunConfig | None:
    """The config that a measurement says it is of; a field that did not exist then has its default. None for no
    config.
    """
    try:
        return RunConfig.from_dict(json.loads(about))
    except ValueError:
        return None


def measure(place: Path, arms: Iterable[Arm], panels: Iterable[Arm], workers: int) -> None:
    """Measure the runs that have not been measured yet, against the held-out runs of their world."""
    panels = list(panels)
    runs = [(arm, seed) for arm in arms for seed in arm.seeds]
    todo = [(arm, seed) for arm, seed in runs if not is_measured(place, arm, seed)]
    if not todo:
        return
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        jobs = [pool.submit(_measure_run, place, arm, seed, _panel(place, arm, panels)) for arm, seed in todo]
        try:
            for job in tqdm(as_completed(jobs), total=len(jobs), unit="run", desc="measuring"):
                job.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _panel(place: Path, arm: Arm, panels: Iterable[Arm]) -> list[Path]:
    """The held-out runs of an arm's world: their seeds are no arm's."""
    same_world = [panel for panel in panels if world_of(panel.config) == world_of(arm.config)]
    return [history_file(place, panel, seed) for panel in same_world for seed in panel.seeds]


def _measure_run(place: Path, arm: Arm, seed: int, panel: list[Path]) -> None:
    history = History.load(history_file(place, arm, seed))
    evaluator = FusedEvaluator(history.config.env, threads=1)
    found: Measured = {f"curve.{name}": values.astype(np.float32) for name, values in history.curves.items()}
    found |= _among_themselves(history, evaluator)
    found |= _against_panel(panel, history, evaluator)
    found |= _against_scripts(history, evaluator)
    if arm.part == "paper":
        found |= _behaviours(history, evaluator)
        found |= _best_responses(history, evaluator)
    beside = measured_file(place, arm, seed).with_suffix(".part")
    with beside.open("wb") as file:
        np.savez_compressed(file, about=np.array(json.dumps(history.config.model_dump())), **found)
    beside.replace(measured_file(place, arm, seed))


def _among_themselves(history: History, evaluator: FusedEvaluator) -> Measured:
    met = own_cross_play(history, evaluator, n_generations=GENERATIONS)
    counts = {"captured": met.captured, "none_caught": met.none_caught, "all_caught": met.all_caught}
    return {"generations": history.sample(GENERATIONS), "met": met.met} | {
        f"own.{name}": values.astype(np.int16) for name, values in counts.items()
    }


def _against_panel(panel: list[Path], history: History, evaluator: FusedEvaluator) -> Measured:
    """Shares of prey caught, ``(GENERATIONS, n_panel)`` for predators of the run and for its prey."""
    generations, found = history.sample(GENERATIONS), {}
    for role in history.champions:
        opponents = [
            member.entrants(other_team(role), len(member) * np.arange(1, PANEL + 1) // PANEL - 1)
            for member in map(History.load, panel)
        ]
        caught = caught_by_each(role, history.entrants(role, generations), opponents, evaluator)
        found[f"panel.{role}"] = caught.astype(np.float32)
    return found


def _against_scripts(history: History, evaluator: FusedEvaluator) -> Measured:
    generations, found = history.sample(GENERATIONS), {}
    for role in history.champions:
        opponents = scripts()[other_team(role)]
        caught = caught_by_each(role, history.entrants(role, generations), opponents, evaluator)
        found[f"scripts.{role}"] = caught.astype(np.float32)
    return found


def _behaviours(history: History, evaluator: FusedEvaluator) -> Measured:
    """Rates and null rates of every behaviour in champion against champion, ``(WATCHED, 2)``."""
    generations = history.sample(WATCHED)
    rates = watch(history, evaluator, generations)
    found = {f"behaviour.{name}": np.array([(r.rate, r.null) for r in row], np.float32) for name, row in rates.items()}
    return {"watched": generations} | found


def _best_responses(history: History, evaluator: FusedEvaluator) -> Measured:
    """Return the fractions caught before and after fresh evolution against either side of the last generation."""
    found = {}
    for role in history.champions:
        seed = _RESPONSE_SEED + history.config.seed
        answer = evolve_response(history, role, evaluator, n_generations=RESPONSE_GENERATIONS, seed=seed)
        found[f"response.{role}"] = np.array([answer.before, answer.after])
    return found
