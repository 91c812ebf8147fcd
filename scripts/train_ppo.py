"""PPO for one team, or for both against each other, in one file: the learned baseline of ``docs/benchmark.md``.

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
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

try:
    import torch
    from torch import nn
    from torch.utils.tensorboard import SummaryWriter
except ImportError as error:
    raise SystemExit(f"train_ppo.py needs PyTorch and TensorBoard (pip install torch tensorboard): {error}") from None

from esp_trainer import Team, load_team
from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.tasks import TASKS
from esp_trainer.teams.zoo import known_teams
from predprey_env import EnvConfig, vector_env
from predprey_env.agents import other_team

INPUT_SCALE = 0.2
"""Factor on the offsets, in 1/cells: a step beside an opponent must show."""
ALWAYS_ON = 40.0
"""Bias gene of a hidden neuron that is 1 whatever it sees."""


@dataclass
class Settings:
    """What is trained, and how."""

    role: str
    task: str = "3v2"
    size: int = 100
    """Of the torus, in cells; an episode has one and a half times as many steps."""
    opponents: tuple[str, ...] = ()
    reward: str = "dense"
    seed: int = 0
    steps: int = 20_000_000
    """Of agents, in all."""
    n_hidden: int = 64
    n_worlds: int = 8
    """For each opponent."""
    horizon: int = 150
    epochs: int = 4
    minibatches: int = 8
    learning_rate: float = 1e-3
    gamma: float = 0.995
    trace: float = 0.95
    clip: float = 0.2
    entropy: float = 0.005
    n_checkpoints: int = 10

    @property
    def env(self) -> EnvConfig:
        """The world, whatever it rewards."""
        return TASKS[self.task].replace(size=self.size, max_cycles=self.size * 3 // 2)


class Policy(nn.Module):
    """Preferences for each action; agents differ by a bias of their own in every hidden neuron."""

    def __init__(self, n_seen: int, n_agents: int, n_actions: int, n_hidden: int) -> None:
        super().__init__()
        self.see = nn.Linear(n_seen, n_hidden, bias=False)
        self.know = nn.Parameter(torch.zeros(n_agents, n_hidden))
        self.act = nn.Linear(n_hidden, n_actions)
        nn.init.orthogonal_(self.act.weight, 0.01)

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        """From ``(..., n_agents, n_seen)`` to ``(..., n_agents, n_actions)``."""
        return self.act(torch.tanh(self.see(seen * INPUT_SCALE) + self.know))

    def as_team(self, role: str, env: EnvConfig, provenance: dict[str, Any]) -> Team:
        """Return the same as a team of networks with logistic neurons.

        ``tanh(x) = 2 / (1 + exp(-2 x)) - 1``, and what that takes off is given back by one neuron that is always on.
        """
        n_agents, n_opponents, n_actions, _ = env.team(role)
        see, out, offset = (p.detach().numpy() for p in (self.see.weight, self.act.weight, self.act.bias))
        side = SideConfig(
            controller="monolithic",
            n_hidden=len(see) + 1,
            bias=True,
            output="linear",
            choice="drawn",
            input_scale=INPUT_SCALE,
        )
        genomes = np.zeros((n_agents, 1, len(see) + 1, see.shape[1] + 1 + n_actions), np.float32)
        for genome, know in zip(genomes[:, 0], self.know.detach().numpy(), strict=True):
            genome[:-1] = np.concatenate([2 * see, 2 * know[:, None], 2 * out.T], axis=1)
            genome[-1, see.shape[1] :] = np.concatenate([[ALWAYS_ON], offset - out.sum(axis=1)])
        controller = make_controller(side, wiring_for(side, n_opponents), n_actions)
        origin = {"preset": "ppo", "env": env.model_dump(), **provenance}
        return Team(role, side, controller, genomes, origin, controller.n_seen)


class Critic(nn.Module):
    """The return to come, for each agent, from what the whole team sees and the time that is left."""

    def __init__(self, n_seen: int, n_agents: int, n_hidden: int = 64) -> None:
        super().__init__()
        n_in = n_agents * n_seen + 1
        self.net = nn.Sequential(nn.Linear(n_in, n_hidden), nn.Tanh(), nn.Linear(n_hidden, n_hidden), nn.Tanh())
        self.value = nn.Linear(n_hidden, n_agents)

    def forward(self, seen: torch.Tensor, passed: torch.Tensor) -> torch.Tensor:
        """From ``(..., n_agents, n_seen)`` and ``(...)`` to ``(..., n_agents)``."""
        return self.value(self.net(torch.cat([seen.flatten(-2) * INPUT_SCALE, passed[..., None]], -1)))


class Worlds:
    """Vector environments with an opponent each, as one batch: everything is ``(n_worlds, n_agents, ...)``."""

    def __init__(self, settings: Settings, role: str, opponents: list[str | Team]) -> None:
        self.settings, self.role = settings, role
        self.shape = settings.env.team(role)
        self._n_begun = 0
        self.envs = [self._env(opponent) for opponent in opponents]
        self.parts = [self._begin(i) for i in range(len(opponents))]
        self.captures: list[float] = []
        """Share of prey caught in each episode that ended."""

    def _env(self, opponent: str | Team) -> Any:
        env = self.settings.env.replace(reward=self.settings.reward)
        return vector_env(self.settings.n_worlds, self.role, opponent, "SameStep", **env.model_dump())

    def _begin(self, i: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        seed = (1 + self.settings.seed) * 1_000_003 + self._n_begun * self.settings.n_worlds
        self._n_begun += 1
        return self.envs[i].reset(seed=seed)

    def replace(self, i: int, opponent: str | Team) -> None:
        """Let one of the environments start again with another opponent."""
        self.envs[i] = self._env(opponent)
        self.parts[i] = self._begin(i)

    def look(self) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return what agents see, the share of the time that has passed, and who still plays."""
        seen = np.stack([part[0] for part in self.parts]).reshape(-1, self.shape.n_agents, self.shape.n_seen)
        steps, captured = (np.stack([part[1][name] for part in self.parts]) for name in ("steps", "captured"))
        passed = steps.reshape(-1, self.shape.n_agents)[:, 0] / self.settings.env.max_cycles
        playing = captured.reshape(-1, self.shape.n_agents) == 0
        return torch.from_numpy(seen), torch.from_numpy(passed).float(), torch.from_numpy(playing).float()

    def step(self, actions: np.ndarray) -> tuple[torch.Tensor, torch.Tensor]:
        """Return rewards in [0, 1] over an episode, and which worlds ended."""
        rewards, ends = [], []
        for i, (env, chosen) in enumerate(zip(self.envs, np.split(actions, len(self.envs)), strict=True)):
            seen, reward, terminated, truncated, infos = env.step(chosen.ravel())
            self.parts[i] = seen, infos
            rewards.append(reward.reshape(chosen.shape) / 25)
            ends.append((terminated | truncated).reshape(chosen.shape)[:, 0])
            if ends[-1].any():
                caught = infos["final_info"]["n_captured"].reshape(chosen.shape)[ends[-1], 0]
                self.captures += (caught / env.config.n_prey).tolist()
        return torch.from_numpy(np.concatenate(rewards)).float(), torch.from_numpy(np.concatenate(ends)).float()


class Batch(NamedTuple):
    """What was seen and done: the first axes are time and world, or just rows of both."""

    seen: torch.Tensor
    passed: torch.Tensor
    playing: torch.Tensor
    """Whether an agent still is in the game, for each agent."""
    actions: torch.Tensor
    chances: torch.Tensor
    """Logarithms of the chances that the actions had."""
    values: torch.Tensor
    rewards: torch.Tensor
    ends: torch.Tensor
    """Whether the episode ended with the step, for each world."""


LOSSES = ("policy", "value", "entropy")


class Learner:
    """One team's policy and critic, in its worlds."""

    def __init__(self, settings: Settings, role: str, opponents: list[str | Team]) -> None:
        self.settings, self.role = settings, role
        self.worlds = Worlds(settings, role, opponents)
        shape = self.worlds.shape
        self.policy = Policy(shape.n_seen, shape.n_agents, shape.n_actions, settings.n_hidden)
        self.critic = Critic(shape.n_seen, shape.n_agents)
        self.parameters = [*self.policy.parameters(), *self.critic.parameters()]
        self.optimiser = torch.optim.Adam(self.parameters, settings.learning_rate, eps=1e-5)
        self.steps = 0

    def update(self, left: float) -> dict[str, float]:
        """Play, and learn from it; ``left`` of the training, from 1 to 0, scales the learning rate."""
        self.optimiser.param_groups[0]["lr"] = left * self.settings.learning_rate
        batch, last = self._play()
        advantages = self._advantages(batch, last)
        losses = self._learn(batch, advantages)
        captures, self.worlds.captures = self.worlds.captures, []
        return {"caught": float(np.mean(captures)) if captures else float("nan"), **losses}

    def team(self, **provenance: Any) -> Team:
        """Return the policy as it is, as a team."""
        return self.policy.as_team(self.role, self.settings.env, provenance)

    @torch.no_grad()
    def _play(self) -> tuple[Batch, torch.Tensor]:
        """Return what was seen and done, ``(horizon, n_worlds, ...)`` each, and the values of where it led to."""
        moments = []
        for _ in range(self.settings.horizon):
            seen, passed, playing = self.worlds.look()
            preferences = torch.log_softmax(self.policy(seen), -1)
            actions = torch.multinomial(preferences.exp().flatten(0, 1), 1).view(seen.shape[:2])
            chances = preferences.gather(-1, actions[..., None])[..., 0]
            values = self.critic(seen, passed)
            rewards, ends = self.worlds.step(actions.numpy())
            moments.append((seen, passed, playing, actions, chances, values, rewards, ends))
        self.steps += self.settings.horizon * actions.numel()
        seen, passed, _ = self.worlds.look()
        return Batch(*map(torch.stack, zip(*moments, strict=True))), self.critic(seen, passed)

    def _advantages(self, batch: Batch, last: torch.Tensor) -> torch.Tensor:
        """Return generalised advantages; nothing is expected after the end of the time, which ends the game."""
        gamma, trace = self.settings.gamma, self.settings.trace
        advantages, following = torch.empty_like(batch.rewards), last
        running = torch.zeros_like(last)
        for t in reversed(range(len(advantages))):
            goes_on = 1 - batch.ends[t][:, None]
            surprise = batch.rewards[t] + gamma * goes_on * following - batch.values[t]
            advantages[t] = running = surprise + gamma * trace * goes_on * running
            following = batch.values[t]
        return advantages

    def _learn(self, batch: Batch, advantages: torch.Tensor) -> dict[str, float]:
        flat, advantages = Batch(*(each.flatten(0, 1) for each in batch)), advantages.flatten(0, 1)
        returns, found = advantages + flat.values, []
        for _ in range(self.settings.epochs):
            for rows in torch.randperm(len(returns)).chunk(self.settings.minibatches):
                losses = self._losses(Batch(*(each[rows] for each in flat)), advantages[rows], returns[rows])
                self.optimiser.zero_grad()
                losses.sum().backward()
                nn.utils.clip_grad_norm_(self.parameters, 0.5)
                self.optimiser.step()
                found.append(losses.detach())
        return dict(zip(LOSSES, torch.stack(found).mean(dim=0).tolist(), strict=True))

    def _losses(self, batch: Batch, advantages: torch.Tensor, returns: torch.Tensor) -> torch.Tensor:
        """Return each of :data:`LOSSES`."""
        share = batch.playing / batch.playing.sum().clamp(min=1)  # caught prey choose nothing
        mean = (advantages * share).sum()
        advantages = (advantages - mean) / (((advantages - mean) ** 2 * share).sum() + 1e-8).sqrt()
        preferences = torch.log_softmax(self.policy(batch.seen), -1)
        ratio = (preferences.gather(-1, batch.actions[..., None])[..., 0] - batch.chances).exp()
        clipped = ratio.clamp(1 - self.settings.clip, 1 + self.settings.clip)
        gain = torch.minimum(ratio * advantages, clipped * advantages)
        entropy = -(preferences.exp() * preferences).sum(-1)
        error = (self.critic(batch.seen, batch.passed) - returns) ** 2
        each = torch.stack([-gain, 0.5 * error, -self.settings.entropy * entropy])
        return (each * share).sum(dim=(1, 2))


def train(settings: Settings, place: Path) -> None:
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


def make_learners(settings: Settings) -> dict[str, Learner]:
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
    parser.add_argument("--task", choices=TASKS, default="3v2")
    parser.add_argument("--size", type=int, default=Settings.size, help="of the torus; by default the paper's 100")
    parser.add_argument(
        "--opponents", nargs="+", default=[], help="teams of the zoo, files, scripts; by default the zoo"
    )
    parser.add_argument("--reward", choices=["dense", "terminal"], default="dense")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=Settings.steps, help="of agents, in all")
    parser.add_argument("--entropy", type=float, default=Settings.entropy, help="how much drawing is worth")
    parser.add_argument("--n-worlds", type=int, default=Settings.n_worlds, help="for each opponent")
    parser.add_argument("--out", type=Path, help="by default a directory in runs/ named after the settings")
    options = vars(parser.parse_args())
    out = options.pop("out")
    if options["role"] != "both" and not options["opponents"]:
        role, task = other_team(options["role"]), options["task"]
        options["opponents"] = [
            t.name for t in known_teams().values() if (t.role, t.task) == (role, task) and not t.held_out
        ]
    settings = Settings(**{**options, "opponents": tuple(options["opponents"])})
    world = settings.task if settings.size == Settings.size else f"{settings.task}-{settings.size}"
    place = out or Path(f"runs/ppo-{world}-{settings.role}-{settings.reward}-seed{settings.seed}")
    if (place / "curve.csv").exists():
        parser.error(f"{place} already holds a run; choose another --out")
    try:
        train(settings, place)
    except (OSError, ValueError) as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
