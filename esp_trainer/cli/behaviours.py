"""``behaviours``: rates of the champions' behaviours, on the terminal."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.inference import MIN_SEEDS, over_seeds
from esp_trainer.analysis.watch import watch_behaviours
from esp_trainer.arrays import GenerationIndices, SeedValues
from esp_trainer.cli.runs import check_world, read_runs
from esp_trainer.cli.streams import say
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import check_place, write_table
from predprey_env.settings import counted

_COLUMNS = 7  # generations that fit on a terminal


def behaviours(runs: list[Path], generations: int, episodes: int, table: Path | None) -> int:
    """Print the rate of each behaviour beyond chance by generation; with several runs the mean."""
    if table:
        check_place(table)
    histories = read_runs(runs)
    config, shown = histories[0].config, histories[0].sample(generations)
    check_world("behaviours", runs[0], config)
    evaluator = FusedEvaluator(config.env)
    found = []
    for run, history in zip(runs, histories, strict=True):
        say(f"watching {run} ...")
        found.append(watch_behaviours(history, evaluator, shown, n_episodes=episodes))
    names = list(found[0])
    rates = np.array([[[(r.rate, r.null, r.excess) for r in rows[name]] for name in names] for rows in found])
    if table:
        _write(table, runs, shown, names, rates)
    columns = np.unique(np.linspace(0, len(shown) - 1, _COLUMNS).round().astype(int))
    print(
        f"{counted(episodes, 'episode')} a generation, champion against champion; "
        "rate minus rate by chance, in per cent"
    )
    print(f"{'generation':22}" + "".join(f"{shown[column]:>8}" for column in columns))
    for name, excess in zip(names, np.moveaxis(100 * rates[..., 2], 1, 0), strict=True):
        cells = "".join(f"{_cell(excess[:, column]):>8}" for column in columns)
        print(f"{name:22}{cells}")
    if np.isnan(rates[:, :, columns, 2]).all(axis=0).any():
        print(
            "- is not known: no episode can show the behaviour, or too few can be used to estimate the rate by chance"
        )
    print("idling and parity idle are plain rates: they are behaviours of single agents, without a rate by chance")
    if len(runs) > 1:
        intervals = ", with half their 95% intervals behind ±" if len(runs) >= MIN_SEEDS else ""
        print(f"means of {len(runs)} runs{intervals}")
    return 0


def _cell(values: SeedValues) -> str:
    known = values[~np.isnan(values)]
    if not len(known):
        return "-"
    if len(known) < MIN_SEEDS:
        return f"{known.mean():z.0f}"
    estimate = over_seeds(known)
    return f"{estimate.mean:z.0f}±{estimate.high - estimate.mean:.0f}"


def _write(path: Path, runs: list[Path], generations: GenerationIndices, names: list[str], rates: np.ndarray) -> None:
    lines: list[list[object]] = [["run", "generation", "behaviour", "rate", "rate by chance", "meaning"]]
    for run, of_run in zip(runs, rates, strict=True):
        for name, of_name in zip(names, of_run, strict=True):
            meaning = BEHAVIOURS[name].meaning if name in BEHAVIOURS else "predators keep to a role"
            for generation, (rate, null, _) in zip(generations, of_name, strict=True):
                lines.append([run, generation, name, f"{rate:.6g}", f"{null:.6g}", meaning])
    write_table(path, lines)
    print(f"every generation is in {path}")
