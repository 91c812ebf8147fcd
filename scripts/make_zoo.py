"""Make the zoo of evolved teams that ships with the package, ``esp_trainer/teams/zoo``.

For each task it evolves the race preset. The paper's worlds have teams of the first zoo too, of three presets: the
paper's, and those whose prey (``modern``) and predators (``drawn``) stood highest against held-out opponents in
``docs/reproduction.md``. No study of this project uses their seeds, except that two runs of ``race-3v2`` (500
and 501) were explored in ``docs/race-protocol.md``. Of each third of each run it keeps the champion of each
side that does best against the other runs, and then plays all against all, scripts too. Teams of the seeds in
``HELD_OUT_SEEDS`` are for reporting only. It takes more than an hour on two cores, and resumes where it was stopped.

    python scripts/make_zoo.py
    python scripts/make_zoo.py --tasks pond  # only this task's teams; the others stay as they are
    python scripts/make_zoo.py --quick --out runs/zoo  # small and meaningless, to see that it works
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from study import SMALL, commit
from tqdm import tqdm

from esp_trainer import Team, preset
from esp_trainer.analysis.comparison import caught_by_each
from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.history import History
from esp_trainer.analysis.inference import over_seeds
from esp_trainer.analysis.ratings import rate
from esp_trainer.cores import cores
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import SCHEMA, digest_of, to_json, write, write_arrays
from esp_trainer.presets import PRESETS
from esp_trainer.run.directory import versions
from esp_trainer.seeding import stream
from esp_trainer.sweep.plan import PlannedRun
from esp_trainer.sweep.run_all import run_all
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import FIRST_ZOO, HELD_OUT_PREFIX, PLACE
from esp_trainer.types import ROLES, Role, ScriptedTeams, TeamBatch
from predprey_env.agents import other_team
from predprey_env.policies import SCRIPTS

PRESET_KINDS = (*FIRST_ZOO, "race")
"""Presets, without the task."""
OWN_FIELDS = {"race-3v2": {"generations": 600}, "race-steppe": {"generations": 300}}
"""Fields that are not the preset's. Later prey of ``race-3v2`` are hardly ever caught."""
SEEDS = (500, 501, 502)
HELD_OUT_SEEDS = (900, 901, 902)
STAGES = ("early", "middle", "late")
SAMPLED = 45
"""Generations of a run that are candidates, a third of them for each stage."""
MATRIX_EPISODES = 512
"""Episodes of each meeting in the matrix that ships."""


@dataclass(frozen=True)
class Chosen:
    """A champion that goes into the zoo."""

    run: History
    role: Role
    stage: str
    generation: int

    @property
    def name(self) -> str:
        """Name in the zoo."""
        prefix, config = HELD_OUT_PREFIX if held_out(self.run) else "", self.run.config
        return f"{prefix}{config.preset}/{self.role}/seed-{config.seed}-{self.stage}"


def main() -> None:
    """Evolve, choose, play and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=PLACE, help="by default into the package")
    parser.add_argument("--quick", action="store_true", help="small and meaningless, to see that it works")
    parser.add_argument("--runs", type=Path, help="where runs are kept; by default runs/zoo, or runs/zoo-quick")
    parser.add_argument("--workers", type=int, default=cores(), help="processes; by default one a core")
    parser.add_argument(
        "--tasks", nargs="+", choices=WORLDS, default=list(WORLDS), help="only the teams of these tasks"
    )
    options = parser.parse_args()
    kept = options.runs or Path("runs/zoo-quick" if options.quick else "runs/zoo")
    runs = evolve(options.tasks, kept, options.quick, options.workers)
    entries = others(options.out, options.tasks)
    for task in options.tasks:
        entries += keep(task, choose(runs[task]), options.out, 16 if options.quick else MATRIX_EPISODES)
    matrices = {
        task: digest_of(matrix_file(options.out, task)) for task in sorted({entry["task"] for entry in entries})
    }
    about = {"schema": SCHEMA, "made_by": "python scripts/make_zoo.py", "commit": commit(), "versions": versions()}
    write(options.out / "index.json", to_json({**about, "matrices": matrices, "teams": entries}))
    print(f"{options.out}: {len(entries)} teams")


def others(place: Path, tasks: list[str]) -> list[dict[str, Any]]:
    """Return the entries of the zoo that is there, without those of some tasks."""
    index = place / "index.json"
    known = json.loads(index.read_bytes())["teams"] if index.exists() else []
    return [entry for entry in known if entry["task"] not in tasks]


def evolve(tasks: list[str], place: Path, quick: bool, workers: int) -> dict[str, list[History]]:
    """Do the runs of some tasks that are not whole yet; return all runs of each task."""
    names = [name for task in tasks for kind in PRESET_KINDS if (name := f"{kind}-{task}") in PRESETS]
    fields = dict.fromkeys(names, SMALL) if quick else OWN_FIELDS
    plan = [
        PlannedRun(name, preset(name).with_fields({**fields.get(name, {}), "seed": seed}))
        for name in names
        for seed in (*SEEDS, *HELD_OUT_SEEDS)
    ]
    run_all(place, plan, workers)
    return {
        task: [History.of_run(place / run.name) for run in plan if run.cell.partition("-")[2] == task] for task in tasks
    }


def held_out(run: History) -> bool:
    """Return whether the teams of a run are for reporting only."""
    return run.config.seed in HELD_OUT_SEEDS


def thirds(run: History) -> list[np.ndarray]:
    """Return the candidates of each stage."""
    return np.array_split(run.sample(SAMPLED), len(STAGES))


def choose(runs: list[History]) -> list[Chosen]:
    """Return the chosen champions of all runs of a task: of the first zoo's runs, and of those of the race presets.

    Each kind is chosen by itself, so the first zoo is what it was before there were race presets.
    """
    kinds = ([run for run in runs if run.config.preset.startswith(FIRST_ZOO) is is_first] for is_first in (True, False))
    return [chosen for same in kinds if same for chosen in _best(same)]


def _best(runs: list[History]) -> list[Chosen]:
    """Return, for each role, run and stage, the champion that does best, on average, against the last champions of each
    third of the other runs that are not held out.
    """
    evaluator = FusedEvaluator(runs[0].config.env)
    found = []
    for role in ROLES:
        for run in runs:
            mine, scores = run.entrants(role, run.sample(SAMPLED)), []
            for other in runs:
                if other is not run and not held_out(other):
                    panel = other.entrants(other_team(role), np.array([third[-1] for third in thirds(other)]))
                    caught = caught_by_each(role, mine, [panel], evaluator, seed=1)
                    scores.append(caught if role == "predators" else 1 - caught)
            means = np.split(np.mean(scores, axis=0).mean(axis=1), np.cumsum([len(t) for t in thirds(run)])[:-1])
            for stage, third, mean in zip(STAGES, thirds(run), means, strict=True):
                found.append(Chosen(run, role, stage, int(third[mean.argmax()])))
    return found


def keep(task: str, chosen: list[Chosen], place: Path, n_episodes: int) -> list[dict[str, Any]]:
    """Play all against all from fresh starts, write teams and matrix, and return the entries of the index."""
    names, captured = meet_all(task, chosen, n_episodes)
    header = {**names, "n_episodes": n_episodes, "n_prey": WORLDS[task].n_prey}
    path = _made(matrix_file(place, task))
    write_arrays(path, "zoo cross-play", header, {"captured": captured})
    caught = captured / (n_episodes * WORLDS[task].n_prey)
    ratings = dict(zip(ROLES, rate(caught, n_episodes, stream(0, "zoo ratings")), strict=True))
    entries = []
    for each in chosen:
        row, other = names[each.role].index(each.name), other_team(each.role)
        known = caught[row] if each.role == "predators" else 1 - caught[:, row]
        score = over_seeds(known[[name not in SCRIPTS[other] for name in names[other]]])
        rated = ratings[each.role]
        entry = {
            "name": each.name,
            "task": task,
            "role": each.role,
            "preset": each.run.config.preset,
            "seed": each.run.config.seed,
            "stage": each.stage,
            "generation": each.generation,
            "score": [score.mean, score.low, score.high],
            "rating": [float(values[row]) for values in (rated.rating, rated.low, rated.high)],
        }
        entries.append({**entry, "digest": _save(each, entry, place)})
    return entries


def meet_all(task: str, chosen: list[Chosen], n_episodes: int) -> tuple[dict[Role, list[str]], np.ndarray]:
    """Return the names on both sides, scripts last, and how many prey each of the predators catches of each of the
    prey.
    """
    evaluator = FusedEvaluator(WORLDS[task])
    sides: dict[Role, dict[str, TeamBatch]] = {}
    for role in ROLES:
        teams = [each for each in chosen if each.role == role]
        sides[role] = {t.name: t.run.entrants(role, np.array([t.generation])) for t in teams}
        sides[role] |= {script: ScriptedTeams(script) for script in SCRIPTS[role]}

    def captures(predators: TeamBatch, prey: TeamBatch) -> int:
        return int(cross_play(predators, prey, evaluator, n_episodes=n_episodes, seed=2).captured.sum())

    hunters = tqdm(sides["predators"].values(), desc=f"{task}, cross-play", unit="team")
    captured = np.array([[captures(predators, prey) for prey in sides["prey"].values()] for predators in hunters])
    return {role: list(side) for role, side in sides.items()}, captured


def _save(each: Chosen, entry: dict[str, Any], place: Path) -> str:
    """Write a team with its origin; return the digest of its file."""
    team = each.run.team(each.role, each.generation)
    origin = {
        **team.provenance,
        "zoo": {name: entry[name] for name in ("name", "stage", "score", "rating")},
        "commit": commit(),
    }
    whole = Team(team.role, team.side, team.controller, team.genomes, origin, team.n_seen)
    path = _made(place / f"{each.name}.safetensors")
    whole.save(path)
    return digest_of(path)


def matrix_file(place: Path, task: str) -> Path:
    """Return the file of the cross-play of a task."""
    return place / f"cross-play-{task}.safetensors"


def _made(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


if __name__ == "__main__":
    main()
