"""The moment that shows each behaviour best, as figures 4 and 6 of the paper show theirs; picked by the detectors."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from esp_trainer.analysis import plots
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.history import History
from esp_trainer.analysis.moments import best_moment
from esp_trainer.analysis.watch import episodes
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import write_npz
from reproduction.results import StudyResults

_SHOWN = [name for name, detector in BEHAVIOURS.items() if detector.of_interaction]


def find(runs: Path, results: Mapping[str, StudyResults], kept: Path) -> None:
    """Keep a moment of each behaviour, in ``moments.npz``, from the run and generation in which it is seen most."""
    found: dict[str, np.ndarray] = {}
    for name in _SHOWN:
        arm = "paper-3v2" if BEHAVIOURS[name].min_prey > 1 else "paper-3v1"
        if arm in results and (moment := _best(runs, results[arm], name)):
            about, cells = moment
            found[name] = cells.astype(np.int16)
            found[f"{name}, about"] = np.array(json.dumps(about))
    if found:
        write_npz(kept / "moments.npz", found)


def _best(runs: Path, results: StudyResults, name: str) -> tuple[dict[str, object], np.ndarray] | None:
    """Return the origin of the best moment and its cells, int ``(n_steps, n_agents, 2)``; None if it was never seen."""
    rates = np.nan_to_num(results[f"behaviour.{name}"][..., 0].astype(float))
    run, watched = np.unravel_index(rates.argmax(), rates.shape)
    planned, generation = results.setting.runs[run], int(results["watched"][run][watched])
    path = runs / planned.name
    if rates[run, watched] <= 0 or not path.exists():
        return None
    history = History.of_run(path)
    moment = best_moment(name, *episodes(history, FusedEvaluator(history.config.env), generation))
    if moment is None:
        return None
    first, last = moment.shown
    about = {"arm": planned.cell, "seed": planned.config.seed, "generation": generation}
    about["rate"] = float(rates[run, watched])
    return about, moment.cells[first : last + 1]


def draw(results: Mapping[str, StudyResults], kept: Path, place: Path) -> None:
    """Draw all moments in one figure; a behaviour that no detector ever saw has an empty panel that says so."""
    file = kept / "moments.npz"
    moments = dict(np.load(file)) if file.exists() else {}
    figure, axes = plots.panels(len(_SHOWN), width=2.6, height=2.8, columns=4)
    rows: list[tuple[object, ...]] = []
    for panel, name in zip(axes, _SHOWN, strict=True):
        if name not in moments:
            panel.set(title=f"{name}: never seen", xticks=[], yticks=[])
            continue
        about, cells = json.loads(str(moments[f"{name}, about"])), moments[name].astype(int)
        env = results[about["arm"]].setting.config.env
        middle = env.size // 2 - cells[-1, env.n_predators]  # the torus has no edge: the prey goes to the middle
        data = plots.trajectories(panel, (cells + middle) % env.size, env.n_predators, env.size)
        panel.set_title(f"{name}\n{about['arm']}, seed {about['seed']}, gen. {about['generation']}", fontsize=8)
        rows += [(name, *row) for row in zip(*data.values(), strict=True)]
    columns = zip(*rows, strict=True) if rows else [()] * 5
    plots.save(figure, place / "moments.png", dict(zip(("behaviour", "step", "agent", "x", "y"), columns, strict=True)))
