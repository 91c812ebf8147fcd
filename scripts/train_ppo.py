"""PPO for one team, or for both against each other: the learned baseline of ``docs/benchmark.md``.

    python scripts/train_ppo.py predators --task 3v2 --seed 1
    python scripts/train_ppo.py prey --opponents paper-3v2/predators/seed-500-late flee_nearest
    python scripts/train_ppo.py both            # self-play: each against the other's present and past
    python scripts/train_ppo.py both --task 3v1 --size 6    # on a torus on which optimal play is known

Proximal policy optimisation (Schulman et al. 2017) with generalised advantages (Schulman et al. 2016), one policy for
all agents of a team and a critic that sees what the whole team sees (Yu et al. 2022). The policy is an evolved team's
kind of network, one hidden layer on the offsets, so that what is learned is saved as a team: it plays wherever evolved
teams do, in ``esp-trainer benchmark`` too. Needs PyTorch, and TensorBoard for its logs.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import numpy as np

try:
    import torch
    from torch.utils.tensorboard import SummaryWriter
except ImportError as error:
    raise SystemExit(f"train_ppo.py needs PyTorch and TensorBoard (pip install torch tensorboard): {error}") from None

from ppo.learner import LOSSES, Learner
from ppo.worlds import PPOSettings

from esp_trainer import Team, load_team
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import known_teams
from predprey_env.agents import other_team


def train(settings: PPOSettings, place: Path) -> None:
    """Train, with a checkpoint and a line of ``curve.csv`` for each of so many parts of it."""
    torch.set_num_threads(1)  # for networks this small, threads only wait for each other
    torch.manual_seed(settings.seed)
    learners = make_learners(settings)
    rng = np.random.default_rng(settings.seed)
    past = {role: [learner.team()] for role, learner in learners.items()}
    place.mkdir(parents=True, exist_ok=True)
    saved = 0
    with SummaryWriter(str(place)) as log, (place / "curve.csv").open("w", newline="") as file:
        curve = csv.writer(file)
        curve.writerow(["role", "steps", "cpu_seconds", "caught", *LOSSES])
        while (done := sum(learner.steps for learner in learners.values())) < settings.steps:
            for role, learner in learners.items():
                told = learner.update(1 - done / settings.steps)
                curve.writerow(
                    [role, learner.steps, f"{time.process_time():.2f}", *(f"{v:.5g}" for v in told.values())]
                )
                for name, value in told.items():
                    log.add_scalar(f"{role}/{name}", value, learner.steps)
            if len(learners) > 1:
                meet_anew(learners, past, rng)
            now = min(settings.steps, sum(learner.steps for learner in learners.values()))
            if now * settings.n_checkpoints // settings.steps > saved:
                saved = now * settings.n_checkpoints // settings.steps
                for role, learner in learners.items():
                    origin = {"seed": settings.seed, "steps": learner.steps, "reward": settings.reward}
                    team = learner.team(**origin, opponents=list(settings.opponents) or ["self-play"])
                    team.save(place / f"{role}-{saved:02d}.safetensors")
                    past[role].append(team)
                print(
                    f"{now / settings.steps:4.0%} {time.process_time():6.0f} CPU-s, caught {told['caught']:.3f}",
                    flush=True,
                )


def make_learners(settings: PPOSettings) -> dict[str, Learner]:
    """Make one learner against its opponents, or two, each in worlds against the other."""
    if settings.role != "both":
        known = known_teams()
        opponents = [load_team(n) if n in known else n for n in settings.opponents]
        loaded = [Team.load(o) if isinstance(o, str) and o.endswith(".safetensors") else o for o in opponents]
        return {settings.role: Learner(settings, settings.role, loaded)}
    learners = {role: Learner(settings, role, ["random"] * 4) for role in ("predators", "prey")}
    for role, learner in learners.items():
        for i in range(4):
            learner.worlds.replace(i, learners[other_team(role)].team())
    return learners


def meet_anew(learners: dict[str, Learner], past: dict[str, list[Team]], rng: np.random.Generator) -> None:
    """Give one of the four environments of each learner another opponent: half the time the other side as it is now,
    else a checkpoint of it.
    """
    for role, learner in learners.items():
        other = other_team(role)
        old = past[other][rng.integers(len(past[other]))]
        learner.worlds.replace(int(rng.integers(4)), old if rng.random() < 0.5 else learners[other].team())


def main() -> None:
    """Read the settings, and train."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("role", choices=["predators", "prey", "both"], help="who learns")
    parser.add_argument("--task", choices=WORLDS, default="3v2")
    parser.add_argument("--size", type=int, default=PPOSettings.size, help="of the torus; by default the paper's 100")
    parser.add_argument(
        "--opponents", nargs="+", default=[], help="teams of the zoo, files, scripts; by default the zoo"
    )
    parser.add_argument("--reward", choices=["dense", "terminal"], default="dense")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=PPOSettings.steps, help="of agents, in all")
    parser.add_argument("--entropy", type=float, default=PPOSettings.entropy, help="how much drawing is worth")
    parser.add_argument("--n-worlds", type=int, default=PPOSettings.n_worlds, help="for each opponent")
    parser.add_argument("--out", type=Path, help="by default a directory in runs/ named after the settings")
    options = vars(parser.parse_args())
    out = options.pop("out")
    if options["role"] != "both" and not options["opponents"]:
        role, task = other_team(options["role"]), options["task"]
        options["opponents"] = [
            t.name for t in known_teams().values() if (t.role, t.task) == (role, task) and not t.held_out
        ]
    settings = PPOSettings(**{**options, "opponents": tuple(options["opponents"])})
    world = settings.task if settings.size == PPOSettings.size else f"{settings.task}-{settings.size}"
    place = out or Path(f"runs/ppo-{world}-{settings.role}-{settings.reward}-seed{settings.seed}")
    if (place / "curve.csv").exists():
        parser.error(f"{place} already holds a run; choose another --out")
    try:
        train(settings, place)
    except (OSError, ValueError) as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
