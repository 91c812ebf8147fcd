"""Make ``docs/leaderboard.md`` from nothing: scripts, late teams of the zoo, the learners of ``docs/benchmark.md``, and
the last champions of the long runs of ``docs/race.md``.

Each row is made by ``esp-trainer benchmark``, so a row can also be made alone by the command that it holds. It
takes some six minutes on two cores. The page begins with an answer, which is read off its rows.

    python scripts/make_leaderboard.py
    python scripts/make_leaderboard.py --tasks steppe               # only the rows of this task; the others stay
    python scripts/make_leaderboard.py --words                      # only write the words again, around the rows
    python scripts/make_leaderboard.py --quick --out runs/board.md  # few rows of few episodes, to see that it works
"""

from __future__ import annotations

import argparse
import contextlib
import io
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tqdm import tqdm

from esp_trainer.benchmark.leaderboard import read_leaderboard, write_leaderboard
from esp_trainer.cli import main as esp_trainer
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import known_teams
from esp_trainer.types import ROLES
from predprey_env.policies import SCRIPTS

BOARD = Path("docs/leaderboard.md")
LEARNERS = Path("docs/benchmark/teams")
LONG_RUNS = Path("docs/race/teams")
BENCHMARK_EPISODES = 512


def main() -> None:
    """Measure all candidates and write the leaderboard."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=BOARD, help=f"by default {BOARD}")
    parser.add_argument("--quick", action="store_true", help="few and short rows, to see that it works")
    parser.add_argument(
        "--words", action="store_true", help="measure nothing, and write the words around the rows again"
    )
    parser.add_argument("--tasks", nargs="+", choices=WORLDS, default=list(WORLDS), help="only the rows of these tasks")
    options = parser.parse_args()
    if options.words:
        write_leaderboard(options.out, read_leaderboard(options.out))
        return
    others = {
        title: rows
        for title, rows in read_leaderboard(options.out).items()
        if title.partition(",")[0] not in options.tasks
    }
    options.out.unlink(missing_ok=True)
    if others:
        write_leaderboard(options.out, others)
    todo = [candidate for candidate in candidates() if candidate[3] in options.tasks]
    episodes = BENCHMARK_EPISODES
    if options.quick:
        todo, episodes = todo[:2], 8
    with tempfile.TemporaryDirectory() as place:
        for spec, name, role, task in tqdm(todo, unit="row"):
            measured = ["benchmark", "--policy", spec, "--role", role, "--task", task, "--episodes", str(episodes)]
            kept = ["--name", name, "--out", place, "--leaderboard", str(options.out)]
            with contextlib.redirect_stdout(io.StringIO()):
                status = esp_trainer([*measured, *kept])
            if status:
                raise SystemExit(f"{spec} could not be measured")
    print(f"{options.out}: {len(todo)} rows")


def candidates() -> Iterator[tuple[str, str, str, str]]:
    """Yield SPEC, name, role and task of every row."""
    for task in WORLDS:
        for role in ROLES:
            for script in SCRIPTS[role]:
                yield script, script, role, task
            for team in known_teams().values():
                if (team.task, team.role, team.stage, team.held_out) == (task, role, "late", False):
                    yield team.name, team.name, role, task
    for role in ROLES:
        for file in sorted(LEARNERS.glob(f"*-{role}.safetensors")):
            yield str(file), f"{file.stem.removesuffix(f'-{role}')} (seed 700)", role, "3v2"
        for file in sorted(LONG_RUNS.glob(f"long-*-{role}.safetensors")):
            seed = file.stem.removeprefix("long-seed").removesuffix(f"-{role}")
            yield str(file), f"race-steppe, 10,000 generations (seed {seed})", role, "steppe"


if __name__ == "__main__":
    main()
