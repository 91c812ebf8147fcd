"""The runs of ``learning_curves.py``: PPO, evolution, and what stands beside them."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from esp_trainer import WORLDS, Arena, FusedEvaluator, History, load_team, load_zoo, preset
from esp_trainer.benchmark.match import Challenger
from esp_trainer.files import write_text
from esp_trainer.types import Role, ScriptedTeams
from predprey_env import EnvConfig
from predprey_env.tasks import DEFAULT_OPPONENTS

EXAMPLES = Path(__file__).parents[2] / "examples"
STEPS = {"pond": 500_000, "meadow": 1_000_000, "steppe": 2_000_000}
"""Steps of agents in a run, by task."""
LONG: dict[tuple[str, Role], int] = {
    ("steppe", "predators"): 100_000_000,
    ("3v1", "predators"): 100_000_000,
    ("3v2", "predators"): 100_000_000,
}
"""The same of the tuned setting, on hard tasks, by task and by who learns."""
SEEDS, EVOLVED_SEEDS = range(5), range(3)
OPPONENT = DEFAULT_OPPONENTS["predators"]
POINTS, EPISODES, GENERATIONS = 10, 400, 100
HELD_OUT_EPISODES = 3600
"""Against all held-out teams together."""
SEE = "nearest_first"
"""Observations in the curves, beside the offsets."""
SIGHT_ARMS: dict[str, dict[str, Any]] = {
    "offsets alone": {},
    "team-mates": {"see": "teammates"},
    "identity": {"see": "identity"},
    "offsets scaled": {"see": "scaled"},
    "entropy 0.01": {"entropy": 0.01},
    "nearest first": {"see": SEE},
    "all three": {"see": "teammates,identity,nearest_first"},
    "nearest first, scaled": {"see": "nearest_first,scaled"},
    "nearest first; entropy 0.01": {"see": SEE, "entropy": 0.01},
    "nearest first; gamma 0.95": {"see": SEE, "gamma": 0.95},
    "nearest first; lambda 0.95": {"see": SEE, "trace": 0.95},
    "nearest first; learning rate 0.002": {"see": SEE, "learning_rate": 0.002},
    "nearest first; 128 hidden neurons": {"see": SEE, "n_hidden": 128},
}
"""Settings of predators on meadow, one run each."""
TUNED: dict[str, Any] = {
    "see": "teammates,nearest_first",
    "opponent": "pool",
    "gamma": 0.97,
    "entropy": 0.003,
    "n_worlds": 1024,
    "epochs": 1,
    "n_minibatches": 24,
}
"""The setting of the long runs."""
TUNED_ARMS: dict[str, dict[str, Any]] = {
    "as tuned": {},
    "the script alone as opponent": {"opponent": ""},
    "team-mates not seen": {"see": "nearest_first"},
    "prey in a fixed order": {"see": "teammates"},
    "offsets scaled": {"see": "teammates,nearest_first,scaled"},
    "gamma 0.99": {"gamma": 0.99},
    "128 hidden neurons": {"n_hidden": 128},
}
"""Settings changed from the baseline, each tried with some seeds for 5 million steps."""
ARM_STEPS, ARM_SEEDS = 5_000_000, range(3)


STANDING: dict[tuple[str, Role], tuple[str, ...]] = {
    ("steppe", "predators"): ("intercept", "race-steppe/predators/seed-500-late"),
    ("3v1", "predators"): ("intercept", "race-3v1/predators/seed-501-late"),
    ("3v2", "predators"): ("intercept", "drawn-3v2/predators/seed-500-late"),
}
"""Teams compared with the long runs: a script, and the best evolved team of the leaderboard."""


def levels(team: Challenger, world: EnvConfig, role: Role, task: str | None) -> list[float]:
    """Return the fraction of prey caught against the default script, and against the held-out teams of a task."""

    def caught(opponents: Sequence[Challenger], n_episodes: int) -> float:
        arena = Arena(world, n_episodes, seed=1)
        return float(np.mean([arena.meet(team, role, each).captured.mean() for each in opponents])) / world.n_prey

    script = caught([DEFAULT_OPPONENTS[role]], EPISODES)
    if task is None:
        return [script]
    held_out = [load_team(each.name) for each in load_zoo(task).teams if each.role != role and each.held_out]
    return [script, caught(held_out, HELD_OUT_EPISODES // len(held_out))]


def learn(file: Path, settings: dict[str, Any]) -> None:
    """Train once, and write the curve: steps, CPU seconds, and the fractions caught with sampled and greedy actions.

    On hard tasks the fraction of the held-out teams' prey too, with sampled actions.
    """
    sys.path.insert(0, str(EXAMPLES))
    from ppo_one_team import Args, train

    from esp_trainer import TorchPolicy

    args = Args(**settings)
    world, points, measured = WORLDS[args.task].replace(**args.sight), [], (args.task, args.team) in LONG
    train(replace(args, n_worlds=2, steps=1))  # compiles, which is not counted
    began = process_time()

    def report(steps: int, policy: Any) -> None:
        nonlocal began
        spent = process_time() - began
        if steps >= args.steps * len(points) / POINTS:
            sampled, greedy = (TorchPolicy(policy, world.team(args.team), drawn=drawn) for drawn in (True, False))
            script, *held_out = levels(sampled, world, args.team, args.task if measured else None)
            points.append((steps, spent, script, *levels(greedy, world, args.team, None), *held_out))
        began = process_time() - spent

    train(args, report)
    write(file, points)


def play(file: Path, settings: dict[str, Any]) -> None:
    """Play a script or a team of the zoo, and write one point: nothing spent, and the fractions of prey caught."""
    task, role, name = settings["task"], settings["role"], settings["team"]
    team = load_team(name) if "/" in name else ScriptedTeams(name)
    script, held_out = levels(team, WORLDS[task], role, task)
    write(file, [(0, 0.0, script, script, held_out)])


def evolve(file: Path, settings: dict[str, Any]) -> None:
    """Evolve once, and write the curve of the champions as :func:`learn` does; steps are at most these."""
    config = preset("race-pond").with_fields(settings)
    evaluator = FusedEvaluator(config.env)
    History.evolve(config.with_fields({"generations": 1}), evaluator)  # compiles, which is not counted
    spent, points = [process_time()], []
    history = History.evolve(config, evaluator, watch=lambda: spent.append(process_time()))
    a_generation = config.esp.n_trials * config.esp.n_episodes * config.env.max_cycles * config.env.n_agents
    for number in np.unique(np.geomspace(1, config.generations, POINTS).astype(int)):
        (caught,) = levels(history.team("predators", number - 1), config.env, "predators", None)
        points.append((int(number) * a_generation, spent[number] - spent[0], caught, caught))
    write(file, points)


def write(file: Path, points: list[tuple[float, ...]]) -> None:
    """Write a run whole, with as many digits as its figures have."""
    rounded = [[int(steps), round(spent, 2), *(round(each, 4) for each in caught)] for steps, spent, *caught in points]
    file.parent.mkdir(parents=True, exist_ok=True)
    write_text(file, json.dumps(rounded))


PLAN: dict[str, tuple[Callable[[Path, dict[str, Any]], None], dict[str, Any]]] = {
    **{
        f"{task}, {team}/{seed}": (learn, {"task": task, "team": team, "seed": seed, "steps": steps, "see": SEE})
        for task, steps in STEPS.items()
        for seed in SEEDS
        for team in DEFAULT_OPPONENTS
    },
    **{
        f"option, {name}/0": (learn, {"task": "meadow", "seed": 0, "steps": STEPS["meadow"], **changed})
        for name, changed in SIGHT_ARMS.items()
    },
    **{
        f"tuned, {name}/{seed}": (learn, {"task": "steppe", "seed": seed, "steps": ARM_STEPS, **TUNED, **changed})
        for name, changed in TUNED_ARMS.items()
        for seed in ARM_SEEDS
    },
    **{
        f"long, {task}, {team}/{seed}": (learn, {"task": task, "team": team, "seed": seed, "steps": steps, **TUNED})
        for (task, team), steps in LONG.items()
        for seed in SEEDS
    },
    **{
        f"standing, {task}, {team}/0": (play, {"task": task, "role": role, "team": team})
        for (task, role), teams in STANDING.items()
        for team in teams
    },
    **{
        f"evolved, {name}/{seed}": (evolve, {"seed": seed, "generations": GENERATIONS, **changed})
        for name, changed in {"race": {}, "flee_nearest alone": {"prey.policy": OPPONENT}}.items()
        for seed in EVOLVED_SEEDS
    },
}
"""The function and the settings of each run, by its name: what, and the seed."""


def small() -> dict[str, tuple[Callable[[Path, dict[str, Any]], None], dict[str, Any]]]:
    """Return one or two runs of each kind that take seconds and mean nothing."""
    less = {learn: {"steps": 1, "n_worlds": 4}, play: {}, evolve: {"generations": 2, "esp.n_trials": 100}}
    beginnings = (
        *("pond, ", "option, offsets alone", "option, team", "tuned, as tuned/0", "long, steppe, predators/0"),
        *("standing, steppe", "evolved, race"),
    )
    return {
        name: (function, settings | less[function])
        for name, (function, settings) in PLAN.items()
        if name.startswith(beginnings) and name[-1] in "01"
    }
