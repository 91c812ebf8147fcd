"""Making the contestants: each run on one core, as many at once as there are cores, none twice."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from esp_trainer import Team, preset
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import write_text
from esp_trainer.jobs import in_processes
from esp_trainer.types import ROLES, Role
from learners.contestants import TASK, TeamKind

Job = tuple[Any, ...]
"""A function and its arguments."""
_PPO = Path(__file__).parents[1] / "train_ppo.py"


def team_file(place: Path, contestant: TeamKind, role: Role, seed: int) -> Path:
    """Return where a team is kept."""
    run = place / contestant.run / f"seed-{seed}"
    if contestant.method != "ppo":
        return run / f"{role}.safetensors"
    return (run if contestant.trained == "together" else run / role) / f"{role}-{contestant.part:02d}.safetensors"


def spent_file(place: Path, contestant: TeamKind, role: Role, seed: int) -> Path:
    """Return where a team's CPU seconds and agents' steps are kept; PPO writes them for all its parts."""
    if contestant.method == "ppo":
        return curve_file(place, contestant, role, seed)
    return team_file(place, contestant, role, seed).with_suffix(".json")


def curve_file(place: Path, contestant: TeamKind, role: Role, seed: int) -> Path:
    """Return the file that PPO writes while it learns."""
    return team_file(place, contestant, role, seed).with_name("curve.csv")


def train(contestants: Iterable[TeamKind], place: Path, workers: int) -> None:
    """Make what is missing; answers to PPO last, as they need it."""
    made = list(contestants)
    for stage in (("ppo", "evolved"), ("answer",)):
        jobs: dict[str, Job] = {}
        for each in made:
            jobs |= _jobs(each, place) if each.method in stage else {}
        in_processes(_do, list(jobs.values()), workers, " and ".join(stage))


def _do(work: Callable[..., None], *arguments: object) -> None:
    work(*arguments)


def publish(contestants: Iterable[TeamKind], place: Path, out: Path) -> None:
    """Copy the teams of everybody's first seed to where others find them."""
    out.mkdir(parents=True, exist_ok=True)
    for each in contestants:
        for role in each.roles if each.method != "script" else ():
            name = each.name.replace(", ", "-")
            shutil.copy(team_file(place, each, role, each.seeds[0]), out / f"{name}-{role}.safetensors")


def _jobs(contestant: TeamKind, place: Path) -> dict[str, Job]:
    """Return what is still to run for a contestant, by name, as contestants may share runs."""
    jobs: dict[str, Job] = {}
    for seed in contestant.seeds:
        missing = [role for role in contestant.roles if not team_file(place, contestant, role, seed).exists()]
        out = place / contestant.run / f"seed-{seed}"
        evolution = contestant.preset, contestant.generations, seed, out
        if contestant.method == "evolved" and missing:
            jobs[f"{contestant.name}, {seed}"] = evolve, *evolution
        elif contestant.method == "answer" and missing:
            jobs[f"{contestant.name}, {seed}"] = evolve, *evolution, place / "together-dense" / f"seed-{seed}"
        elif contestant.trained == "together" and missing:
            jobs[f"{contestant.run}, {seed}"] = ppo, contestant, "both", seed, out
        else:
            jobs |= {f"{contestant.run}, {role}, {seed}": (ppo, contestant, role, seed, out / role) for role in missing}
    return jobs


def ppo(contestant: TeamKind, role: str, seed: int, out: Path) -> None:
    """Train one side, or both, from nothing."""
    shutil.rmtree(out, ignore_errors=True)  # what is there was not finished
    options: dict[str, object] = {
        "--task": TASK,
        "--reward": contestant.reward,
        "--seed": seed,
        "--steps": contestant.steps * (2 if role == "both" else 1),
        "--n-worlds": contestant.n_worlds,
        "--out": out,
    }
    command = [sys.executable, str(_PPO), role, *(str(word) for option in options.items() for word in option)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command[1:3])} failed: {done.stderr.strip().splitlines()[-1]}")


def evolve(name: str, generations: int, seed: int, out: Path, frozen: Path | None = None) -> None:
    """Coevolve both sides, or evolve each against the other's frozen team of PPO; keep the last champions."""
    config = preset(name).replace(seed=seed, generations=generations)
    evaluator = FusedEvaluator(config.env, threads=1)
    evaluator.compile()
    for roles in [ROLES] if frozen is None else [(role,) for role in ROLES]:
        fixed = {each: Team.load(frozen / f"{each}-10.safetensors") for each in ROLES if frozen and each not in roles}
        start = time.process_time()
        history = History.evolve(config, evaluator, fixed=fixed)
        spent = time.process_time() - start
        for role in roles:
            _keep(history, role, out, spent)


def _keep(history: History, role: Role, out: Path, spent: float) -> None:
    out.mkdir(parents=True, exist_ok=True)
    config = history.config
    steps = (
        config.generations * config.esp.n_trials * config.esp.n_episodes * config.env.max_cycles * config.env.n_agents
    )
    write_text(out / f"{role}.json", json.dumps({"cpu_seconds": spent, "steps": steps}))
    history.team(role, len(history) - 1).save(out / f"{role}.safetensors")
