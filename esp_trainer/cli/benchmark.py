"""``benchmark``: a policy against the gauntlet, on the terminal."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from esp_trainer.benchmark.gauntlet import Gauntlet, OpponentResult
from esp_trainer.benchmark.leaderboard import append, read_leaderboard
from esp_trainer.benchmark.report import BenchmarkResult, benchmark_table, save_benchmark
from esp_trainer.benchmark.specs import Candidate, load_candidate
from esp_trainer.cli.candidate import tell_about
from esp_trainer.cli.streams import say
from esp_trainer.files import check_place
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import load_zoo
from esp_trainer.types import PolicyError, Role
from predprey_env.settings import counted


@dataclass(frozen=True)
class BenchmarkOptions:
    """Settings of a benchmark: side, task, episodes per opponent, and seed."""

    role: Role
    task: str
    episodes: int
    seed: int
    drawn: bool = False
    """If true, ``sb3:`` and ``torch:`` policies sample actions from their probabilities, else take the most likely."""


def benchmark(
    spec: str, name: str | None, settings: BenchmarkOptions, out: Path | None, leaderboard: Path | None
) -> int:
    """Play the gauntlet, then print and save the table. If a policy fails midway, the results so far are saved."""
    # Files are checked before the gauntlet, which takes long, rather than after it.
    if leaderboard:
        read_leaderboard(leaderboard)
        check_place(leaderboard)
    env = WORLDS[settings.task]
    candidate, name = load_candidate(spec, settings.role, env, drawn=settings.drawn), name or spec
    tell_about(candidate)
    place = out or Path("benchmarks") / re.sub(r"[^\w.-]+", "-", f"{name}-{settings.role}-{settings.task}")
    place.mkdir(parents=True, exist_ok=True)
    check_place(place / "results.json")
    gauntlet = Gauntlet(load_zoo(settings.task), env, settings.role, settings.episodes, settings.seed)
    rows: list[OpponentResult] = []
    try:
        meetings, total = gauntlet.play(candidate.player), len(gauntlet.opponents)
        with tqdm(meetings, total=total, unit="opponent", leave=False, disable=None) as bar:  # no bar in log files
            for row in bar:
                rows.append(row)  # noqa: PERF402 - rows before an error are kept
    except (PolicyError, KeyboardInterrupt):
        if rows:
            save_benchmark(_result(candidate, name, settings, gauntlet, rows), place)
            say(f"{len(rows)} of {counted(total, 'opponent')} met; the table so far is in {place}")
        raise
    result = _result(candidate, name, settings, gauntlet, rows)
    save_benchmark(result, place)
    print(benchmark_table(result))
    print(f"\nthe table, its numbers and a figure are in {place}")
    if leaderboard:
        append(leaderboard, result)
        print(f"on the leaderboard: {leaderboard}")
    sys.stdout.flush()
    return 0


def _result(
    candidate: Candidate, name: str, settings: BenchmarkOptions, gauntlet: Gauntlet, rows: list[OpponentResult]
) -> BenchmarkResult:
    return BenchmarkResult(
        name=name,
        spec=candidate.spec,
        digest=candidate.digest,
        drawn=settings.drawn,
        role=settings.role,
        task=settings.task,
        n_episodes=settings.episodes,
        seed=settings.seed,
        zoo=gauntlet.zoo.digest,
        rows=rows,
        standing=gauntlet.standing(rows) if len(rows) == len(gauntlet.opponents) else None,
    )
