"""A benchmark's table, as text, as JSON and as a figure. The same seed gives the same bytes."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.analysis import plots
from esp_trainer.benchmark.gauntlet import PARTS, OpponentResult, Standing
from esp_trainer.files import to_json, write, write_text
from esp_trainer.statistics import in_points
from esp_trainer.types import Role
from predprey_env.settings import counted

_HEADS = ("caught [95% interval]", "fitness", "all caught after")


@dataclass(frozen=True)
class BenchmarkResult:
    """Results of a candidate in the gauntlet, with all that is needed to reproduce them."""

    name: str
    spec: str
    digest: str
    """SHA-256 of the candidate's file."""
    drawn: bool
    """True if actions were sampled from the candidate's probabilities; False if they were the most likely ones."""
    role: Role
    task: str
    n_episodes: int
    seed: int
    zoo: str
    """SHA-256 of the zoo's index."""
    rows: Sequence[OpponentResult]
    standing: Standing | None
    """Summary of the rows; None if the candidate did not finish."""

    def as_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        return {"complete": self.standing is not None, "version": version("predprey-esp"), **asdict(self)}

    @property
    def command(self) -> str:
        """Command line that gives the same table again."""
        return (
            f"esp-trainer benchmark --policy {shlex.quote(self.spec)} --role {self.role} --task {self.task} "
            f"--episodes {self.n_episodes} --seed {self.seed}{' --drawn' if self.drawn else ''}"
        )


def benchmark_table(result: BenchmarkResult) -> str:
    """Return the table as text: the rows by part, and their summary."""
    width = max([len(row.opponent) for row in result.rows], default=10) + 2
    episodes = f"{counted(result.n_episodes, 'episode')} each from held-out starts (seed {result.seed})"
    lines = [f"{result.name}: {result.role} of {result.task}, {episodes}"]
    for part in PARTS:
        rows = [row for row in result.rows if row.part == part]
        if rows:
            heads = "".join(f"{head:>24}" if i == 0 else f"{head:>18}" for i, head in enumerate(_HEADS))
            lines += ["", f"{part:{width}}{heads}", *(_line(row, width) for row in rows)]
    return "\n".join([*lines, "", *(_standing(result) if result.standing else ["the candidate did not finish"])])


def _line(row: OpponentResult, width: int) -> str:
    after = "-" if row.all_caught_after is None else f"{row.all_caught_after:.1f} steps"
    return f"{row.opponent:{width}}{row.caught!s:>24}{row.fitness:>18.2f}{after:>18}"


def _standing(result: BenchmarkResult) -> list[str]:
    standing = result.standing
    assert standing is not None
    scored = "prey caught" if result.role == "predators" else "prey not caught"
    return [
        *(
            f"{part:14} {mean:.3f} {scored}, {worst:.3f} against the worst tenth"
            for part, (mean, worst) in standing.generalist.items()
        ),
        f"rating         {in_points(standing.rating)} points, number {standing.rank} of {standing.of}",
        f"gain           {standing.gain:+z.3f} against the best mixture of opponents, less the value of their game",
        f"exploited      {standing.exploited:z.3f} less than that value against its worst opponent",
    ]


def save_benchmark(result: BenchmarkResult, place: Path) -> None:
    """Write ``results.json``, ``table.txt`` and, if anything was played, ``scores.png`` with its data."""
    place.mkdir(parents=True, exist_ok=True)
    write(place / "results.json", to_json(result.as_dict()))
    write_text(place / "table.txt", f"{benchmark_table(result)}\n\n{result.command}\n")
    if result.rows:
        _draw(result, place / "scores.png")


def _draw(result: BenchmarkResult, path: Path) -> None:
    rows = [row for part in PARTS for row in result.rows if row.part == part][::-1]
    figure, (axes,) = plots.panels(1, width=7.2, height=1 + 0.19 * len(rows), columns=1)
    for number, part in enumerate(PARTS):
        at = [y for y, row in enumerate(rows) if row.part == part]
        if not at:
            continue
        rates = [rows[y].caught for y in at]
        means = np.array([rate.rate for rate in rates])
        ends = np.abs(np.array([(rate.low, rate.high) for rate in rates]).reshape(-1, 2).T - means)
        colour, marker = plots.COLOURS[number], "osD^"[number]
        axes.errorbar(means, at, xerr=ends, fmt=marker, color=colour, markersize=4, linewidth=1, label=part)
    axes.set(yticks=range(len(rows)), xlim=(-0.02, 1.02), xlabel="fraction of prey caught")
    axes.set_yticklabels([row.opponent for row in rows], fontsize=7)
    axes.set_title(f"{result.name}, {result.role} of {result.task}", parse_math=False)
    axes.margins(y=0.01)
    plots.legend_above(axes)
    data: dict[str, list[object]] = {
        "opponent": [row.opponent for row in rows],
        "part": [row.part for row in rows],
        "caught": [row.caught.rate for row in rows],
        "low": [row.caught.low for row in rows],
        "high": [row.caught.high for row in rows],
    }
    plots.save(figure, path, data)
