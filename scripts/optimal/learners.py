"""How exploitable learners are while they learn, on tori where the best response is known: ESP, PPO, and scripts."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tqdm import tqdm

from esp_trainer import Team
from esp_trainer.analysis.history import History
from esp_trainer.analysis.inference import Estimate, over_seeds
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.match import match
from esp_trainer.exact.chances import chances
from esp_trainer.exact.response import best_responses
from esp_trainer.exact.solution import Solution, by_parity, means_by_parity, solve
from esp_trainer.presets import preset
from esp_trainer.types import ROLES, Role, ScriptedTeams
from predprey_env.config import EnvConfig

SCRIPTS: dict[Role, tuple[str, ...]] = {
    "predators": ("random", "greedy_chase", "parity_chase", "surround"),
    "prey": ("random", "flee_nearest"),
}
EPISODES = 1024
"""In which a learner's two sides meet."""
_PPO = Path(__file__).parents[1] / "train_ppo.py"


class Learner(NamedTuple):
    """Who learns, where, and how often it is looked at."""

    name: str
    size: int
    looks: int
    """At the first generation, the last, and between; or at the checkpoints of PPO."""
    preset: str = ""
    fields: dict[str, Any] = {}  # noqa: RUF012 - never changed
    entropy: float = 0.0
    """Of PPO."""


_SOFT = {"predators.choice": "drawn", "prey.choice": "drawn"}
LEARNERS = [
    Learner("paper-3v1", 6, 8, "paper-3v1"),
    Learner("modern-3v1", 6, 8, "modern-3v1"),
    Learner("drawn-3v1", 6, 8, "drawn-3v1"),
    Learner("paper-3v1, actions drawn", 6, 8, "paper-3v1", _SOFT),
    Learner("PPO, self-play", 6, 5, entropy=0.005),
    Learner("PPO, self-play, entropy 0.05", 6, 5, entropy=0.05),
    Learner("paper-3v1", 8, 8, "paper-3v1"),
    Learner("drawn-3v1", 8, 4, "drawn-3v1"),
    Learner("paper-3v1", 10, 5, "paper-3v1"),
    Learner("paper-3v1", 12, 2, "paper-3v1"),
]


class Course(NamedTuple):
    """How a learner did: arrays by seed, look, and steps within which prey are caught."""

    learner: Learner
    looks: np.ndarray
    """Generations; or steps of all agents, of PPO."""
    predators: np.ndarray
    """``(seeds, looks, horizon)``: prey caught of those that answer its predators optimally."""
    prey: np.ndarray
    """``(seeds, looks, horizon)``: its prey caught by predators that answer it optimally."""
    met: np.ndarray
    """``(seeds, looks)``: caught where its two sides meet, in whole episodes."""

    def at(self, role: Role, look: int, steps: int) -> Estimate:
        """Mean over seeds."""
        return over_seeds(getattr(self, role)[:, look, steps - 1])


class Torus(NamedTuple):
    """A torus and everybody on it, within 1, 2, ... ``size`` steps."""

    size: int
    optimal: np.ndarray
    """``(horizon,)``: both sides play optimally."""
    courses: list[Course]
    scripts: dict[tuple[str, Role], np.ndarray]
    """``(horizon,)``."""

    @property
    def half(self) -> int:
        """The number of steps in which optimal play catches nearest to half of the prey."""
        return int(np.abs(self.optimal - 0.5).argmin()) + 1

    @property
    def early(self) -> int:
        """Half of those: too few for predators that know a prey to catch all of it."""
        return max(1, self.half // 2)

    @property
    def columns(self) -> list[int]:
        """Numbers of steps for a table."""
        return sorted({self.early, self.half - 1, self.half, self.size})


def measure(learners: list[Learner], seeds: int, generations: int, place: Path) -> list[Torus]:
    """Let them learn, and answer them optimally; what is found in ``place`` is not done again."""
    tori = []
    with tqdm(total=len(learners) * seeds, unit="run", mininterval=10) as bar:
        for size in sorted({learner.size for learner in learners}):
            solution = solve(EnvConfig(size=size, n_prey=1, max_cycles=size * 3 // 2), size)
            courses = []
            for learner in (each for each in learners if each.size == size):
                found = []
                for seed in range(seeds):
                    found.append(_course(learner, seed, generations, place, solution))
                    bar.update()
                arrays = (np.array([each[key] for each in found]) for key in ("predators", "prey", "met"))
                courses.append(Course(learner, np.array(found[0]["looks"]), *arrays))
            optimal = np.array([by_parity(solution, steps)[0] for steps in range(1, size + 1)])
            tori.append(Torus(size, optimal, courses, _scripts(solution) if size == learners[0].size else {}))
    return tori


def _scripts(solution: Solution) -> dict[tuple[str, Role], np.ndarray]:
    config = solution.config
    return {
        (script, role): np.array(_answered(chances(ScriptedTeams(script), role, config), role, solution))
        for role, names in SCRIPTS.items()
        for script in names
    }


def _course(learner: Learner, seed: int, generations: int, place: Path, solution: Solution) -> dict[str, Any]:
    """One seed, as JSON values."""
    name = f"{learner.name}-{learner.size}".replace(", ", "-").replace(" ", "-")
    kept, asked = place / name / f"seed-{seed}.json", {**learner._asdict(), "generations": generations}
    if kept.exists() and (found := json.loads(kept.read_text()))["asked"] == asked:
        return dict(found)
    config = solution.config
    found = {"asked": asked, "looks": [], "predators": [], "prey": [], "met": []}
    for look, teams in _looks(learner, seed, generations, config, place):
        found["looks"].append(look)
        for role in ROLES:
            found[role].append(_answered(chances(teams[role], role, config), role, solution))
        found["met"].append(match(teams["predators"], teams["prey"], config, EPISODES, seed).caught.rate)
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.write_text(json.dumps(found))
    return found


def _looks(
    learner: Learner, seed: int, generations: int, env: EnvConfig, place: Path
) -> Iterator[tuple[int, dict[Role, Team]]]:
    """When the learner is looked at, and its teams then."""
    if not learner.preset:
        run = place / f"ppo-{env.size}-entropy-{learner.entropy}" / f"seed-{seed}"
        if not (run / "prey-10.safetensors").exists():
            shutil.rmtree(run, ignore_errors=True)  # what was cut off
            world = ["--task", "3v1", "--size", str(env.size), "--entropy", str(learner.entropy)]
            command = [sys.executable, str(_PPO), "both", *world, "--seed", str(seed)]
            subprocess.run([*command, "--steps", "10000000", "--out", str(run)], check=True)
        for part in np.linspace(1, 10, learner.looks).round().astype(int).tolist():
            teams = {role: Team.load(run / f"{role}-{part:02d}.safetensors") for role in ROLES}
            yield part * 1_000_000, teams
        return
    config = preset(learner.preset).replace(seed=seed, generations=generations, env=env)
    for field, value in learner.fields.items():
        section, name = field.split(".")
        config = config.replace(**{section: getattr(config, section).replace(**{name: value})})
    history = History.evolve(config, FusedEvaluator(env))
    for generation in np.unique(np.linspace(0, generations - 1, learner.looks).round().astype(int)).tolist():
        yield generation, {role: history.team(role, generation) for role in ROLES}


def _answered(fixed: np.ndarray, role: Role, solution: Solution) -> list[float]:
    """Share of prey caught within 1, 2, ... ``size`` steps when a policy meets the best response for just so many."""
    answers = islice(best_responses(fixed, role, solution.config, solution.config.size), solution.config.size)
    return [means_by_parity(values, solution)[0] for values in answers]
