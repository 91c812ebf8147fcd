"""Matches that are recorded when a page is made, for pages that cannot compute them.

The page can compute a match only if all rules have a translation to JavaScript. A network or an observation of the
user's may have none. Then a few generations of each side play each other here, and the page shows their cells.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from math import isqrt
from typing import Any

import numpy as np

from esp_trainer.analysis.history import History
from esp_trainer.arrays import GenerationIndices
from esp_trainer.coevolution.sides import side_config
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.report.measure import MeasuredRuns
from esp_trainer.types import ROLES, Role, TrialBatch
from predprey_env.arrays import Starts
from predprey_env.config import EnvConfig

BUDGET = 2**20
"""Maximum size of all recorded cells in a page, in bytes before base64; half of it for the moments at most."""
RECORDED_GENERATIONS = 12
"""Maximum number of generations of each side; fewer if a match is large, but one at least."""
STARTS = 4
"""Maximum number of starts of each pairing."""


def recorded(runs: Sequence[MeasuredRuns], moments: Sequence[dict[str, Any]], starts: Starts) -> dict[str, Any]:
    """Return the part of the page's data that holds recorded matches.

    In each run, each chosen generation of the predators meets each of the prey, from each chosen start.

    Args:
        runs: Runs of the same predator-prey world.
        moments: Moments to show; those for which there is no room are left out.
        starts: Starts to choose from, int ``(n, n_agents, 2)``.

    Returns:
        The ``runs`` with the generations to choose from, the ``starts``, the ``moments``, and the ``recorded`` matches
        (see :func:`record_matches`), each with the index of its ``run``.
    """
    evaluator = FusedEvaluator(runs[0].source.config.env)
    size = _bytes_of_match(evaluator.env)
    shown = moments[: BUDGET // 2 // size]
    room = (BUDGET - len(shown) * size) // size // len(runs)
    n_generations = min(RECORDED_GENERATIONS, max(1, isqrt(room // STARTS)))
    chosen = _spread(starts, STARTS)
    offered: list[dict[str, Any]] = []
    matches: list[dict[str, Any]] = []
    for number, run in enumerate(runs):
        history, sides = run.source.history, None
        if history is not None and run.own is not None:
            predators, prey = (_spread(each, n_generations) for each in (run.own.predators, run.own.prey))
            pairs = [(p, q, start) for p in predators.tolist() for q in prey.tolist() for start in chosen]
            pairs += [(m["generation"], m["generation"], np.array(m["start"])) for m in shown if m["run"] == number]
            matches += [{"run": number, **match} for match in record_matches(history, evaluator, pairs)]
            sides = {"predators": _side(history, "predators", predators), "prey": _side(history, "prey", prey)}
        offered.append({"name": run.source.name, "sides": sides})
    return {"runs": offered, "starts": chosen.tolist(), "moments": shown, "recorded": matches}


def _side(history: History, role: Role, generations: GenerationIndices) -> dict[str, Any]:
    """Return the generations of an evolved side, or the name of a script."""
    if role in history.champions:
        return {"generations": generations.tolist()}
    return {"name": side_config(history.config, role).policy}


def record_matches(
    history: History, evaluator: FusedEvaluator, pairs: Sequence[tuple[int, int, Starts]]
) -> list[dict[str, Any]]:
    """Play matches between champions of a run.

    Args:
        history: The run.
        evaluator: Evaluator of the run's world.
        pairs: Generation of the predators, generation of the prey, and start ``(n_agents, 2)`` of each match.

    Returns:
        For each match the generation of the evolved sides, the step ``caught`` in which each prey was caught (0 for
        never), and the ``cells`` of all agents by step: base64 of ``uint8``, or of little-endian ``uint16`` on a torus
        of more than 256 cells a side.
    """
    generations = {"predators": np.array([p for p, _, _ in pairs]), "prey": np.array([q for _, q, _ in pairs])}
    teams = {role: history.entrants(role, generations[role]) for role in ROLES}
    starts = np.stack([start for _, _, start in pairs])[:, None]
    result, trace = evaluator.play(TrialBatch(teams["predators"], teams["prey"], starts))
    cells = trace.cells[:, 0].astype(_cell(evaluator.env))
    return [
        {
            **{role: int(generations[role][i]) for role in history.champions},
            "caught": trace.caught_at[i, 0].tolist(),
            "cells": base64.b64encode(cells[i, : result.steps[i, 0] + 1].tobytes()).decode(),
        }
        for i in range(len(pairs))
    ]


def _cell(env: EnvConfig) -> str:
    """Return the type of a coordinate."""
    return "u1" if env.size <= 256 else "<u2"


def _bytes_of_match(env: EnvConfig) -> int:
    return (env.max_cycles + 1) * env.n_agents * 2 * np.dtype(_cell(env)).itemsize


def _spread(values: np.ndarray, n: int) -> np.ndarray:
    """Return at most ``n`` of some values, evenly spread from the first to the last."""
    return values[np.unique(np.linspace(0, len(values) - 1, n).round().astype(int))]
