"""What is measured of a run, from its champions alone: everything here is against opponents that stand still."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from tqdm import tqdm

from esp_trainer.analysis.behaviours.counts import count_behaviours
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.best_response import best_response
from esp_trainer.analysis.cross_play import cross_play, own_cross_play
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.seeding import stream
from esp_trainer.types import ROLES, Role, ScriptedTeams, Teams, TrialBatch
from predprey_env.policies import SCRIPTS
from reproduction.arms import ARMS, Arm, world_of
from reproduction.evolve import history_file

GENERATIONS = 46
"""Generations of a run that meet each other: every tenth of the paper's 450."""
WATCHED = 24
"""Generations whose champions are watched for behaviours."""
WATCHED_EPISODES = 128
PANEL_GENERATIONS = (99, 199, 299)
"""Of each held-out run, the champions that everyone is measured against."""
RESPONSE_GENERATIONS = 60
_RESPONSE_SEED = 2000

Measured = dict[str, np.ndarray]


def measured_file(place: Path, arm: Arm, seed: int) -> Path:
    """Where the measurements of a run are kept."""
    return place / arm.name / f"seed-{seed}.npz"


def measure(place: Path, arms: Iterable[Arm], workers: int) -> None:
    """Measure what has not been measured yet."""
    todo = [(arm, seed) for arm in arms for seed in arm.seeds if not measured_file(place, arm, seed).exists()]
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        runs = [pool.submit(_measure_run, place, arm, seed) for arm, seed in todo]
        try:
            for run in tqdm(as_completed(runs), total=len(runs), unit="run"):
                run.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _measure_run(place: Path, arm: Arm, seed: int) -> None:
    history = History.load(history_file(place, arm, seed))
    evaluator = FusedEvaluator(history.config.env, threads=1)
    found: Measured = {f"curve.{name}": values.astype(np.float32) for name, values in history.curves.items()}
    found |= _among_themselves(history, evaluator)
    found |= _against_panel(place, history, evaluator)
    found |= _against_scripts(history, evaluator)
    found |= _behaviours(history, evaluator)
    if arm.part == "paper":
        found |= _best_responses(history, evaluator)
    beside = measured_file(place, arm, seed).with_suffix(".part")
    with beside.open("wb") as file:
        np.savez_compressed(file, **found)
    beside.replace(measured_file(place, arm, seed))


def _among_themselves(history: History, evaluator: FusedEvaluator) -> Measured:
    met = own_cross_play(history, evaluator, n_generations=GENERATIONS)
    counts = {"captured": met.captured, "none_caught": met.none_caught, "all_caught": met.all_caught}
    return {"generations": history.sample(GENERATIONS), "met": met.met} | {
        f"own.{name}": values.astype(np.int16) for name, values in counts.items()
    }


def _against_panel(place: Path, history: History, evaluator: FusedEvaluator) -> Measured:
    """Shares of prey caught, ``(GENERATIONS, n_panel)`` for predators of the run and for its prey."""
    generations, found = history.sample(GENERATIONS), {}
    for role in history.champions:
        columns = []
        for member in _panel(place, history):
            opponents = member.entrants(_other(role), np.array(PANEL_GENERATIONS))
            columns.append(_caught(role, history.entrants(role, generations), opponents, evaluator))
        found[f"panel.{role}"] = np.concatenate(columns, axis=1).astype(np.float32)
    return found


def _panel(place: Path, history: History) -> Iterator[History]:
    """The held-out runs of a world: their seeds are no arm's."""
    for arm in ARMS.values():
        if arm.part == "panel" and world_of(arm.config) == world_of(history.config):
            for seed in arm.seeds:
                yield History.load(history_file(place, arm, seed))


def _against_scripts(history: History, evaluator: FusedEvaluator) -> Measured:
    generations, found = history.sample(GENERATIONS), {}
    for role in history.champions:
        mine = history.entrants(role, generations)
        columns = [_caught(role, mine, ScriptedTeams(script), evaluator) for script in SCRIPTS[_other(role)]]
        found[f"scripts.{role}"] = np.concatenate(columns, axis=1).astype(np.float32)
    return found


def _caught(role: Role, mine: Teams, theirs: Teams, evaluator: FusedEvaluator) -> np.ndarray:
    """Shares of prey caught: a row for each of mine, a column for each of theirs."""
    if role == "predators":
        return cross_play(mine, theirs, evaluator).caught
    return cross_play(theirs, mine, evaluator).caught.T


def _behaviours(history: History, evaluator: FusedEvaluator) -> Measured:
    """Rates and null rates of every behaviour in champion against champion, ``(WATCHED, 2)``."""
    generations = history.sample(WATCHED)
    starts = evaluator.starts.held_out(stream(0, "watched"), WATCHED_EPISODES)
    rows: dict[str, list[tuple[float, float]]] = {}
    for generation in generations:
        teams = [history.player(role, int(generation)).as_teams(WATCHED_EPISODES) for role in ROLES]
        batch = TrialBatch(*teams, starts)
        trace, captured = evaluator.trace(batch)[:, 0], evaluator.evaluate(batch).captured[:, 0]
        paths = Paths.of_trace(trace, evaluator.env.n_predators, evaluator.env.size, captured)
        for name, rate in count_behaviours(paths, stream(0, "null", int(generation))).items():
            rows.setdefault(name, []).append((rate.rate, rate.null))
    found = {f"behaviour.{name}": np.array(rates, np.float32) for name, rates in rows.items()}
    return {"watched": generations} | found


def _best_responses(history: History, evaluator: FusedEvaluator) -> Measured:
    """What fresh evolution takes from either side of the last generation: shares caught before and after."""
    found = {}
    for role in history.champions:
        seed = _RESPONSE_SEED + history.config.seed
        answer = best_response(history, role, evaluator, n_generations=RESPONSE_GENERATIONS, seed=seed)
        found[f"response.{role}"] = np.array([answer.before, answer.after])
    return found


def _other(role: Role) -> Role:
    return ROLES[1 - ROLES.index(role)]
