"""The value of the game on small tori, and how far learners are from optimal play: tables of ``docs/optimal_play.md``.

    python scripts/optimal_play.py [--quick] [--seeds N] [--work DIR]

Some two hours on two cores. A learner that is found in ``--work`` is not measured again. Needs PyTorch and TensorBoard
for PPO; ``--quick`` only shows that it works, without PPO.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from study import table
from tqdm import tqdm

from esp_trainer import Team
from esp_trainer.analysis.history import History
from esp_trainer.analysis.inference import summary
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.match import match
from esp_trainer.exact.chances import chances
from esp_trainer.exact.parity import by_parity, means_by_parity
from esp_trainer.exact.response import best_responses
from esp_trainer.exact.solution import Solution, solve
from esp_trainer.files import write_text
from esp_trainer.presets import preset
from esp_trainer.types import ROLES, Role, ScriptedTeams
from predprey_env.config import EnvConfig

DUEL_EPISODES = 1024  # in which a learner's two sides meet
PPO_STEPS = 10_000_000
MEASURED_SCRIPTS: dict[Role, tuple[str, ...]] = {
    "predators": ("random", "greedy_chase", "parity_chase", "surround"),
    "prey": ("random", "flee_nearest"),
}


class SmallGame(NamedTuple):
    """A torus, a time limit, and what differs from three predators and a prey by the paper's rules."""

    size: int
    steps: int
    fields: dict[str, Any]
    prototype: str = ""
    """Values that another program had found: all starts, and by the number of predators at an even distance."""

    @property
    def name(self) -> str:
        """Name in the table."""
        return ", ".join([f"{self.size} x {self.size}, {self.steps}", *(f"{k} {v}" for k, v in self.fields.items())])


GAMES = [
    SmallGame(6, 5, {}, "0.798: 0.704 / 0.777 / 0.830 / 0.872"),
    SmallGame(6, 10, {}, "0.994: 0.991 / 0.993 / 0.995 / 0.996"),
    SmallGame(6, 20, {"predator_idle": False}, "0.123: 0.000 / 0.000 / 0.023 / 1.000"),
    SmallGame(6, 5, {"move_order": "prey_first"}, "1.000: 0.997 / 1.000 / 1.000 / 1.000"),
    SmallGame(8, 10, {}, "0.853: 0.823 / 0.844 / 0.863 / 0.881"),
    SmallGame(10, 15, {}, "0.841: 0.821 / 0.835 / 0.848 / 0.860"),
    SmallGame(9, 15, {"predator_idle": False}, "0.380: 0.372 / 0.383 / 0.382 / 0.373"),
    *(
        SmallGame(size, size * 3 // 2, fields)
        for size in (4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16)
        for fields in ({}, {"predator_idle": False})
    ),
    *(
        SmallGame(size, size * 3 // 2, {"n_predators": n_predators, "n_prey": n_prey})
        for n_predators, n_prey in ((1, 1), (2, 1), (3, 1), (4, 1), (2, 2), (3, 2))
        for size in ((4, 6) if n_predators == 4 else (4, 6, 8))
    ),
]
"""At one and a half times the size, as the paper's 150 steps are on 100, but for what a prototype had found."""


class LearningRun(NamedTuple):
    """A run of a learner, and how often it is measured."""

    name: str
    size: int
    looks: int
    """At the first generation, the last, and between; or at the checkpoints of PPO."""
    preset: str = ""
    fields: dict[str, Any] = {}  # noqa: RUF012 - never changed
    entropy: float = 0.0
    """Entropy bonus of PPO."""


LEARNING_RUNS = [
    LearningRun("paper-3v1", 6, 8, "paper-3v1"),
    LearningRun("modern-3v1", 6, 8, "modern-3v1"),
    LearningRun("drawn-3v1", 6, 8, "drawn-3v1"),
    LearningRun("paper-3v1, actions drawn", 6, 8, "paper-3v1", {"predators.choice": "drawn", "prey.choice": "drawn"}),
    LearningRun("PPO, self-play", 6, 5, entropy=0.005),
    LearningRun("PPO, self-play, entropy 0.05", 6, 5, entropy=0.05),
    LearningRun("paper-3v1", 8, 8, "paper-3v1"),
    LearningRun("drawn-3v1", 8, 4, "drawn-3v1"),
    LearningRun("paper-3v1", 10, 5, "paper-3v1"),
    LearningRun("paper-3v1", 12, 2, "paper-3v1"),
]


def value(game: SmallGame) -> list[str]:
    """Return a row: the fraction caught under optimal play over all starts and by parity, and when half is caught."""
    solution = solve(EnvConfig(**{"size": game.size, "n_prey": 1, **game.fields}), game.steps)
    curve = [by_parity(solution, steps)[0] for steps in range(1, game.steps + 1)]
    mean, by_even = by_parity(solution, game.steps)
    half = f"{np.searchsorted(curve, 0.5) + 1} steps" if mean >= 0.5 else "-"
    found = f"{mean:.3f}: {' / '.join(f'{each:.3f}' for each in by_even)}"
    return [game.name, found, game.prototype, half, f"{len(solution.states.cells):,}"]


def answered(policy: Team | ScriptedTeams, role: Role, solution: Solution) -> list[float]:
    """Return the fraction caught within 1, 2, ... ``size`` steps when a policy meets the best response for just so many
    steps.
    """
    fixed, size = chances(policy, role, solution.config), solution.config.size
    answers = islice(best_responses(fixed, role, solution.config, size), size)
    return [means_by_parity(values, solution)[0] for values in answers]


def course(learner: LearningRun, seed: int, generations: int, place: Path, solution: Solution) -> dict[str, Any]:
    """Return how exploitable a learner's two sides are at each look, as JSON values; keep it in a file."""
    name = f"{learner.name}-{learner.size}".replace(", ", "-").replace(" ", "-")
    kept, asked = place / name / f"seed-{seed}.json", {**learner._asdict(), "generations": generations}
    if kept.exists() and (found := json.loads(kept.read_text()))["asked"] == asked:
        return dict(found)
    found = {"asked": asked, "looks": [], "predators": [], "prey": [], "met": []}
    for look, teams in looks(learner, seed, generations, solution.config, place):
        found["looks"].append(look)
        for role in ROLES:
            found[role].append(answered(teams[role], role, solution))
        found["met"].append(match(teams["predators"], teams["prey"], solution.config, DUEL_EPISODES, seed).caught.rate)
    kept.parent.mkdir(parents=True, exist_ok=True)
    write_text(kept, json.dumps(found))
    return found


def looks(
    learner: LearningRun, seed: int, generations: int, env: EnvConfig, place: Path
) -> Iterator[tuple[int, dict[Role, Team]]]:
    """Yield when the learner is looked at, and its teams then."""
    if not learner.preset:
        run = place / f"ppo-{env.size}-entropy-{learner.entropy}" / f"seed-{seed}"
        if not (run / "prey-10.safetensors").exists():
            shutil.rmtree(run, ignore_errors=True)  # what was cut off
            script = [sys.executable, str(Path(__file__).with_name("train_ppo.py")), "both", "--seed", str(seed)]
            world = ["--task", "3v1", "--size", str(env.size), "--entropy", str(learner.entropy)]
            subprocess.run([*script, *world, "--steps", str(PPO_STEPS), "--out", str(run)], check=True)
        for part in np.linspace(1, 10, learner.looks).round().astype(int).tolist():
            yield part, {role: Team.load(run / f"{role}-{part:02d}.safetensors") for role in ROLES}
        return
    config = preset(learner.preset).replace(seed=seed, generations=generations, env=env).with_fields(learner.fields)
    history = History.evolve(config, FusedEvaluator(env))
    for generation in np.unique(np.linspace(0, generations - 1, learner.looks).round().astype(int)).tolist():
        yield generation, {role: history.team(role, generation) for role in ROLES}


def torus(size: int, learners: list[LearningRun], seeds: int, generations: int, place: Path) -> str:
    """Return the tables of a torus: the last of each learner answered optimally, and its prey while they learn."""
    solution = solve(EnvConfig(size=size, n_prey=1, max_cycles=size * 3 // 2), size)
    optimal = np.array([by_parity(solution, steps)[0] for steps in range(1, size + 1)])
    half = int(np.abs(optimal - 0.5).argmin()) + 1
    early = max(1, half // 2)  # too few for predators that know a prey to catch all of it
    columns = sorted({early, half, size})
    rows = [["both sides play optimally", *(f"{optimal[steps - 1]:.4f}" for steps in columns)]]
    for role, names in MEASURED_SCRIPTS.items():
        for name in names:
            curve = answered(ScriptedTeams(name), role, solution)
            rows.append([f"{role}, `{name}`", *(f"{curve[steps - 1]:.4f}" for steps in columns)])
    tables = []
    for learner in learners:
        found = [course(learner, seed, generations, place, solution) for seed in tqdm(range(seeds), desc=learner.name)]
        sides = {role: np.array([each[role] for each in found]) for role in ROLES}
        rows += [
            [f"{role}, {learner.name}", *(summary(sides[role][:, -1, steps - 1]) for steps in columns)]
            for role in ROLES
        ]
        lines = [
            [f"within {steps}", *(summary(looked) for looked in sides["prey"][:, :, steps - 1].T)]
            for steps in (early, half)
        ]
        lines.append(["met", *(f"{met:.2f}" for met in np.mean([each["met"] for each in found], axis=0))])
        tables.append(table([f"{size} x {size}, prey of {learner.name}", *found[0]["looks"]], lines, "---:"))
    heads = [f"{size} x {size}, policy", *(f"within {steps}" for steps in columns)]
    return "\n\n".join([table(heads, rows, "---:"), *tables])


def main() -> None:
    """Measure, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small, to see that it works")
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="of each learner")
    parser.add_argument("--work", type=Path, default=Path("runs/optimal-play"), help="where what is measured is kept")
    options = parser.parse_args()
    games, learners, seeds, generations = GAMES, LEARNING_RUNS, options.seeds, 450
    if options.quick:
        games, seeds, generations = [GAMES[0], GAMES[2], *GAMES[7:9]], 2, 4
        learners = [learner._replace(size=4, looks=2) for learner in LEARNING_RUNS[:4]]
    heads = ["torus, steps", "value", "prototype", "half caught within", "positions"]
    print(table(heads, [value(game) for game in tqdm(games, unit="game")]), end="\n\n", flush=True)
    with TemporaryDirectory() as name:
        work = Path(name) if options.quick else options.work
        for size in sorted({learner.size for learner in learners}):
            there = [learner for learner in learners if learner.size == size]
            print(torus(size, there, seeds, generations, work), end="\n\n", flush=True)


if __name__ == "__main__":
    main()
