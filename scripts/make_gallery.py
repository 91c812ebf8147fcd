"""Find in the zoo the episodes that show the paper's behaviours best, and make a GIF of each: ``docs/gallery``.

    python scripts/make_gallery.py

Every predator team of the zoo plays every prey team of its task, and the detectors choose. Teams that sample their
actions are left out, as they do not play the same again from the same start. It takes some minutes.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from gymnasium.utils import seeding
from tqdm import tqdm

from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.teams.zoo import ZooTeam, known_teams, load_team
from esp_trainer.types import TrialBatch
from predprey_env import EnvConfig
from predprey_env.rules.starts import draw_starts

SHOWN = {"herding": "3v2", "scattering": "3v2", "baiting": "3v1", "sidestepping": "3v1", "role switch": "3v1"}
"""The behaviours that the paper names, and the task that it saw them in."""
SEEDS = 48
BEFORE, AFTER = 25, 20  # steps of a clip around what it shows
FOLLOW = 40  # cells across a picture, which follows the chase


class Found(NamedTuple):
    """An episode in which a behaviour is seen, from its ``first`` to its ``last`` step."""

    merit: tuple[int, ...]
    predators: str
    prey: str
    seed: int
    first: int
    last: int

    def command(self, out: Path) -> list[str]:
        """Return the command that makes the clip."""
        pair = [self.predators, "--against", self.prey, "--seed", str(self.seed)]
        clip = ["--from", str(max(0, self.first - BEFORE)), "--until", str(self.last + AFTER)]
        return ["esp-trainer", "replay", *pair, *clip, "--follow", str(FOLLOW), "--gif", str(out)]


def main() -> None:
    """Search, and draw the clips."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/gallery"))
    parser.add_argument("--seeds", type=int, default=SEEDS, help="episodes of each pair of teams")
    options = parser.parse_args()
    best: dict[str, Found] = {}
    for task in dict.fromkeys(SHOWN.values()):
        names = [name for name, of in SHOWN.items() if of == task]
        for name, found in search(task, names, options.seeds):
            if name not in best or found.merit > best[name].merit:
                best[name] = found
    options.out.mkdir(parents=True, exist_ok=True)
    for name in SHOWN:
        if name not in best:
            print(f"{name}: never seen in the zoo")
            continue
        command = best[name].command(options.out / f"{name.replace(' ', '-')}.gif")
        print(shlex.join(command), flush=True)
        told = subprocess.run(
            [sys.executable, "-m", "esp_trainer", *command[1:]], check=True, capture_output=True, text=True
        )
        assert name in told.stdout, f"the replay does not show {name}: {told.stdout}"


def search(task: str, names: list[str], n_seeds: int) -> Iterator[tuple[str, Found]]:
    """Yield every episode of every pair of teams in which one of the behaviours is seen."""
    env = EnvConfig(n_prey=int(task[-1]))
    evaluator = FusedEvaluator(env)
    starts = np.stack([draw_starts(seeding.np_random(seed)[0], 1, env) for seed in range(n_seeds)])
    teams = {
        role: [team for team in known_teams().values() if fits(team, task, role)] for role in ("predators", "prey")
    }
    pairs = [(hunters, hunted) for hunters in teams["predators"] for hunted in teams["prey"]]
    for hunters, hunted in tqdm(pairs, desc=task):
        batch = TrialBatch(load_team(hunters.name).as_teams(n_seeds), load_team(hunted.name).as_teams(n_seeds), starts)
        _, trace = evaluator.play(batch)
        paths = Paths.of_trace(trace.cells[:, 0], env.n_predators, env.size, trace.caught_at[:, 0])
        for name in names:
            rows = BEHAVIOURS[name].rule(paths, Thresholds())
            for seed in np.flatnonzero(rows.any(axis=1)).tolist():
                yield name, judged(name, rows[seed], paths, seed, hunters.name, hunted.name)


def fits(team: ZooTeam, task: str, role: str) -> bool:
    """Return whether a team plays a role in a task, and plays the same each time."""
    return team.task == task and team.role == role and "drawn" not in team.name


def judged(name: str, rows: np.ndarray, paths: Paths, seed: int, predators: str, prey: str) -> Found:
    """Return an episode with its merit: whether the behaviour helped those that show it, then how long it lasts."""
    first = int(rows.argmax())
    last = first + int(np.append(~rows[first:], True).argmax()) - 1
    caught = paths.capture_times[seed]
    soon = int(((caught >= first) & (caught <= last + AFTER)).sum())
    helped = soon if BEHAVIOURS[name].who == "predators" else paths.n_prey - int((caught < paths.n_rows).sum())
    return Found((helped, int(rows.sum()), -first), predators, prey, seed, first, last)


if __name__ == "__main__":
    main()
