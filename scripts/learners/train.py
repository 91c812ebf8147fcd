"""Making the contestants: each run on one core, as many at once as there are cores, none twice."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from tqdm import tqdm

from esp_trainer import Team, preset
from esp_trainer.analysis.history import History
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import ROLES, Role
from learners.contestants import TASK, Contestant
from predprey_env.agents import other_team

_PPO = Path(__file__).parents[1] / "train_ppo.py"


def team_file(place: Path, contestant: Contestant, role: Role, seed: int) -> Path:
    """Where a team is kept."""
    run = place / contestant.run / f"seed-{seed}"
    if contestant.method != "ppo":
        return run / f"{role}.safetensors"
    return (run if contestant.trained == "together" else run / role) / f"{role}-{contestant.part:02d}.safetensors"


def spent_file(place: Path, contestant: Contestant, role: Role, seed: int) -> Path:
    """Where it is written what a team cost: its CPU seconds, and the agents' steps; PPO writes it for all its parts."""
    if contestant.method == "ppo":
        return curve_file(place, contestant, role, seed)
    return team_file(place, contestant, role, seed).with_suffix(".json")


def curve_file(place: Path, contestant: Contestant, role: Role, seed: int) -> Path:
    """What PPO writes while it learns."""
    return team_file(place, contestant, role, seed).with_name("curve.csv")


def train(contestants: Iterable[Contestant], place: Path, workers: int) -> None:
    """Make what is missing; answers to PPO last, as they need it."""
    made = [each for each in contestants if each.method != "script"]
    for stage in (("ppo", "evolved"), ("answer",)):
        jobs: dict[str, Callable[[], None]] = {}
        for each in made:
            if each.method in stage:
                jobs |= _jobs(each, place)
        if not jobs:
            continue
        with ThreadPoolExecutor(workers) as pool:
            running = [pool.submit(job) for job in jobs.values()]
            for done in tqdm(as_completed(running), total=len(running), unit="run", desc=" and ".join(stage)):
                done.result()


def publish(contestants: Iterable[Contestant], place: Path, out: Path) -> None:
    """Copy the teams of everybody's first seed to where others find them."""
    out.mkdir(parents=True, exist_ok=True)
    for each in contestants:
        for role in each.roles if each.method != "script" else ():
            name = each.name.replace(", ", "-")
            shutil.copy(team_file(place, each, role, each.seeds[0]), out / f"{name}-{role}.safetensors")


def _jobs(contestant: Contestant, place: Path) -> dict[str, Callable[[], None]]:
    """What is still to run for a contestant, by name, as contestants may share runs."""
    jobs: dict[str, Callable[[], None]] = {}
    for seed in contestant.seeds:
        missing = [role for role in contestant.roles if not team_file(place, contestant, role, seed).exists()]
        if contestant.method != "ppo" and missing:
            jobs[f"{contestant.name}, {seed}"] = _command(contestant, place, seed)
        elif contestant.trained == "together" and missing:
            jobs[f"{contestant.run}, {seed}"] = _ppo(contestant, place, "both", seed)
        elif missing:
            jobs |= {f"{contestant.run}, {role}, {seed}": _ppo(contestant, place, role, seed) for role in missing}
    return jobs


def _ppo(contestant: Contestant, place: Path, role: str, seed: int) -> Callable[[], None]:
    out = place / contestant.run / f"seed-{seed}" / ("" if role == "both" else role)
    options: dict[str, object] = {
        "--task": TASK,
        "--reward": contestant.reward,
        "--seed": seed,
        "--steps": contestant.steps * (2 if role == "both" else 1),
        "--n-worlds": contestant.n_worlds,
        "--out": out,
    }
    words = [str(word) for option in options.items() for word in option]

    def job() -> None:
        shutil.rmtree(out, ignore_errors=True)  # what is there was not finished
        _run([str(_PPO), role, *words])

    return job


def _command(contestant: Contestant, place: Path, seed: int) -> Callable[[], None]:
    """In a process of its own, so that its CPU seconds are its own."""
    made = "evolve" if contestant.method == "evolved" else "answer"
    options = [contestant.preset, contestant.generations, seed, str(place / contestant.run / f"seed-{seed}")]
    if made == "answer":
        options.append(str(place / "together-dense" / f"seed-{seed}"))
    code = (
        f"import sys; sys.path.insert(0, {str(_PPO.parent)!r}); from learners.train import {made}; {made}(*{options!r})"
    )
    return lambda: _run(["-c", code])


def _run(arguments: list[str]) -> None:
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(arguments[:3])} failed: {done.stderr.strip().splitlines()[-1]}")


def evolve(name: str, generations: int, seed: int, out: str) -> None:
    """Coevolve both sides, and keep the last champions."""
    config = preset(name).replace(seed=seed, generations=generations)
    evaluator = FusedEvaluator(config.env, threads=1)
    evaluator.compile()
    start = time.process_time()
    history = History.evolve(config, evaluator)
    spent = time.process_time() - start
    for role in ROLES:
        _keep(history, role, Path(out), spent)


def answer(name: str, generations: int, seed: int, out: str, frozen: str) -> None:
    """Evolve each side against the other's frozen team of PPO, and keep the last champions."""
    config = preset(name).replace(seed=seed, generations=generations)
    evaluator = FusedEvaluator(config.env, threads=1)
    evaluator.compile()
    for role in ROLES:
        other = other_team(role)
        team = Team.load(Path(frozen) / f"{other}-10.safetensors")
        start = time.process_time()
        history = History.evolve(config, evaluator, fixed={other: team})
        _keep(history, role, Path(out), time.process_time() - start)


def _keep(history: History, role: Role, out: Path, spent: float) -> None:
    out.mkdir(parents=True, exist_ok=True)
    config = history.config
    steps = (
        config.generations * config.esp.n_trials * config.esp.n_episodes * config.env.max_cycles * config.env.n_agents
    )
    (out / f"{role}.json").write_text(json.dumps({"cpu_seconds": spent, "steps": steps}))
    history.team(role, len(history) - 1).save(out / f"{role}.safetensors")
