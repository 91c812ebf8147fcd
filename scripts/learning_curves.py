"""How fast PPO learns each task, what its options do, and what evolution spends for the same; writes docs/learning.md.

    nice python scripts/learning_curves.py            # some 25 CPU-minutes; runs that are there are not made again
    python scripts/learning_curves.py --report        # only the page and the figure, from docs/learning/curves.json
    python scripts/learning_curves.py --quick         # small runs that mean nothing, into runs/learning-quick

The learner is that of examples/ppo_one_team.py. Needs PyTorch.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from study import StudyParser, fill, in_processes, table

from esp_trainer import WORLDS, Arena, FusedEvaluator, History, preset
from esp_trainer.analysis import plots
from esp_trainer.analysis.inference import summary
from predprey_env.tasks import DEFAULT_OPPONENTS

ROOT = Path(__file__).parents[1]
STEPS = {"pond": 500_000, "meadow": 1_000_000, "steppe": 2_000_000}
"""Steps of agents in a run, by task."""
SEEDS, EVOLVED_SEEDS = range(5), range(3)
OPPONENTS = DEFAULT_OPPONENTS["predators"]
POINTS, EPISODES, GENERATIONS = 10, 400, 100
SEE = "nearest_first"
"""What agents see in the curves, beside the offsets."""
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


def learn(file: Path, settings: dict[str, Any]) -> None:
    """Train once, and write the curve: steps, CPU seconds, and the fractions caught with sampled and greedy actions."""
    sys.path.insert(0, str(ROOT / "examples"))
    from ppo_one_team import Args, train

    from esp_trainer import TorchPolicy

    args = Args(**settings)
    world = WORLDS[args.task].replace(**args.sight)
    arena, points = Arena(world, EPISODES, seed=1), []
    train(replace(args, n_worlds=2, steps=1))  # compiles, which is not counted
    began = process_time()

    def report(steps: int, policy: Any) -> None:
        nonlocal began
        spent = process_time() - began
        if steps >= args.steps * len(points) / POINTS:
            teams = (TorchPolicy(policy, world.team(args.team), drawn=drawn) for drawn in (True, False))
            played = [arena.meet(team, args.team, DEFAULT_OPPONENTS[args.team]) for team in teams]
            points.append((steps, spent, *(float(each.captured.mean() / world.n_prey) for each in played)))
        began = process_time() - spent

    train(args, report)
    write(file, settings, points)


def evolve(file: Path, settings: dict[str, Any]) -> None:
    """Evolve once, and write the curve of the champions as :func:`learn` does; steps are at most these."""
    config = preset("race-pond").with_fields(settings)
    evaluator = FusedEvaluator(config.env)
    History.evolve(config.with_fields({"generations": 1}), evaluator)  # compiles, which is not counted
    spent = [process_time()]
    history = History.evolve(config, evaluator, watch=lambda: spent.append(process_time()))
    arena, points = Arena(config.env, EPISODES, seed=1), []
    a_generation = config.esp.n_trials * config.esp.n_episodes * config.env.max_cycles * config.env.n_agents
    for number in np.unique(np.geomspace(1, config.generations, POINTS).astype(int)):
        caught = arena.meet(history.team("predators", number - 1), "predators", "flee_nearest").captured.mean()
        points.append((int(number) * a_generation, spent[number] - spent[0], float(caught), float(caught)))
    write(file, settings, points)


def write(file: Path, settings: dict[str, Any], points: list[tuple[float, ...]]) -> None:
    """Write a run, with as many digits as its figures have."""
    file.parent.mkdir(parents=True, exist_ok=True)
    rounded = [
        [int(steps), round(spent, 2), round(caught, 4), round(greedy, 4)] for steps, spent, caught, greedy in points
    ]
    file.write_text(json.dumps({"settings": settings, "points": rounded}))


def jobs(quick: bool) -> dict[str, tuple[Any, dict[str, Any]]]:
    """Return the function and the settings of each run, by its name."""
    small = {"steps": 3000, "n_worlds": 4} if quick else {}
    few = {"generations": 2, "esp.n_trials": 100} if quick else {"generations": GENERATIONS}
    tasks, options = (["pond"], list(SIGHT_ARMS)[:2]) if quick else (list(STEPS), list(SIGHT_ARMS))
    found: dict[str, tuple[Any, dict[str, Any]]] = {}
    for task in tasks:
        for seed in SEEDS[:2] if quick else SEEDS:
            for team in DEFAULT_OPPONENTS:
                settings = {"task": task, "team": team, "seed": seed, "steps": STEPS[task], "see": SEE}
                found[f"{task}, {team}/{seed}"] = learn, settings | small
    for name in options:
        settings = {"task": "meadow", "seed": 0, "steps": STEPS["meadow"], **SIGHT_ARMS[name]}
        found[f"option, {name}/0"] = learn, settings | small
    for name, changed in {"race": {}, "flee_nearest alone": {"prey.policy": OPPONENTS}}.items():
        for seed in EVOLVED_SEEDS[: 1 if quick else None]:
            found[f"evolved, {name}/{seed}"] = evolve, {"seed": seed, **changed, **few}
    return found


def gather(runs: Path, names: list[str]) -> dict[str, list[list[list[float]]]]:
    """Return the points of the runs that are there, by what was run, a list for each seed."""
    found: dict[str, list[list[list[float]]]] = {}
    for name, file in ((name, runs / f"{name}.json") for name in names):
        if file.exists():
            found.setdefault(name.split("/")[0], []).append(json.loads(file.read_text())["points"])
    return found


def draw(curves: dict[str, list[list[list[float]]]], path: Path) -> None:
    """Draw the fraction caught by steps and by CPU seconds: a column for each task, evolution beside PPO on pond."""
    figure, axes = plots.panels(2 * len(STEPS), width=3.3)
    data: dict[str, np.ndarray] = {}
    for number, (panel, task) in enumerate(zip(axes, [*STEPS, *STEPS], strict=True)):
        by_time = number >= len(STEPS)
        for team, colour in {"predators": plots.PREDATORS, "prey": plots.PREY}.items():
            if f"{task}, {team}" not in curves:
                continue
            runs = [np.array(points).T for points in curves[f"{task}, {team}"]]
            grid = np.linspace(0, min(steps[-1] for steps, *_ in runs), POINTS + 1)
            caught = np.array([np.interp(grid, steps, sampled) for steps, _, sampled, _ in runs])
            seconds = np.mean([np.interp(grid, steps, spent) for steps, spent, *_ in runs], axis=0)
            x = seconds if by_time else grid / 1e6
            drawn = plots.curve(panel, x, caught, f"{team} learn", colour=colour, number=team == "prey")
            unit = "CPU seconds" if by_time else "million steps"
            data |= {f"{task}, {team}, {unit}": x} | {f"{task}, {key}": value for key, value in drawn.items()}
        panel.set(title=task, xlabel="CPU seconds" if by_time else "million steps of agents", ylim=(0, 1))
    axes[0].set_ylabel("fraction of prey caught")
    axes[len(STEPS)].set_ylabel("fraction of prey caught")
    plots.legend(axes[0])
    plots.save(figure, path, data)


def first(points: list[list[float]], level: float, column: int) -> float:
    """Return the steps (column 0) or CPU seconds (1) after which a run first catches a fraction; infinity if never."""
    return next((point[column] for point in points if point[2] >= level), np.inf)


def page(curves: dict[str, list[list[list[float]]]], place: Path) -> None:
    """Write the figure and the page."""
    draw(curves, place / "learning" / "curves.png")
    last = {name: [points[-1] for points in runs] for name, runs in curves.items()}

    def told(name: str, column: int = 2) -> str:
        return summary([point[column] for point in last[name]])

    def mean(name: str, column: int) -> float:
        return float(np.mean([point[column] for point in last[name]]))

    def reached(name: str, level: float) -> str:
        runs = curves[name]
        steps, seconds = (float(np.median([first(points, level, column) for points in runs])) for column in (0, 1))
        return f"{seconds:.1f} s, {steps / 1e6:.1f} M" if np.isfinite(steps) else "-"

    tasks = [n for task in STEPS for team in DEFAULT_OPPONENTS if (n := f"{task}, {team}") in curves]
    options = {name.removeprefix("option, "): name for name in curves if name.startswith("option, ")}
    ppo_and_evolution = ["pond, predators", *(name for name in curves if name.startswith("evolved, "))]
    values = {
        "tasks": table(
            ["task and team that learns", "runs", "steps", "CPU seconds", "prey caught, sampled", "greedy"],
            [[n, len(curves[n]), f"{mean(n, 0) / 1e6:.1f} M", f"{mean(n, 1):.0f}", told(n), told(n, 3)] for n in tasks],
        ),
        "options": table(
            ["changed", "prey caught, sampled", "greedy", "CPU seconds"],
            [[changed, told(n), told(n, 3), f"{mean(n, 1):.0f}"] for changed, n in options.items()],
        ),
        "evolution": table(
            ["predators of pond", "runs", "0.4 caught after", "0.8 caught after", "in the end", "spent"],
            [
                [
                    n,
                    len(curves[n]),
                    reached(n, 0.4),
                    reached(n, 0.8),
                    told(n),
                    f"{mean(n, 1):.0f} s, {mean(n, 0) / 1e6:.1f} M",
                ]
                for n in ppo_and_evolution
            ],
        ),
    }
    (place / "learning.md").write_text(fill(Path(__file__).with_name("learning.md"), values))


def main() -> None:
    """Train what is not there, and write the page."""
    parser = StudyParser(__doc__, "runs/learning", "runs/learning-quick")
    parser.add_argument("--only", default="", help="only runs whose name begins so; no page")
    options = parser.read()
    file, planned = options.out / "learning" / "curves.json", jobs(options.quick)
    if not options.report:
        for work in (learn, evolve):
            todo = [
                (options.runs / f"{name}.json", settings)
                for name, (function, settings) in planned.items()
                if function is work and name.startswith(options.only) and not (options.runs / f"{name}.json").exists()
            ]
            in_processes(work, todo, options.workers, work.__name__)
        if options.only:
            return
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(gather(options.runs, list(planned))))
    page(json.loads(file.read_text()), options.out)


if __name__ == "__main__":
    main()
