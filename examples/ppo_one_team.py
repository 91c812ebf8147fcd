"""PPO for one team in one file, in the manner of CleanRL: one network for all agents of the team, against any opponent.

Run: `pip install torch`, then `python examples/ppo_one_team.py --task pond`, or `--help` for all settings. It takes
17 CPU-seconds and prints

        0 steps,   3 CPU-seconds: 0.00 of the prey caught
  208,896 steps,   9 CPU-seconds: 0.81 of the prey caught
  405,504 steps,  17 CPU-seconds: 0.87 of the prey caught

The best script, intercept, catches 0.41; docs/learning.md has learning curves on all tasks.
"""

import argparse
from dataclasses import dataclass, fields
from time import process_time

import numpy as np
import torch
from torch import nn
from torch.distributions import Categorical

from esp_trainer import Arena, TorchPolicy, load_team, load_zoo
from predprey_env import SCRIPTS, TASKS, vector_env
from predprey_env.tasks import DEFAULT_OPPONENTS


@dataclass
class Args:
    task: str = "pond"
    team: str = "predators"
    opponent: str = ""  # script; "" for the default one, "pool" for all and the zoo's teams that are not held out
    seed: int = 0
    steps: int = 400_000  # of agents, in all
    n_worlds: int = 128
    horizon: int = 32  # steps of each world between updates
    epochs: int = 4
    n_minibatches: int = 6
    learning_rate: float = 5e-3  # at first; it falls linearly to 0
    gamma: float = 0.99
    trace: float = 0.9  # lambda of generalised advantages
    clip: float = 0.2
    entropy: float = 0.0
    n_hidden: int = 64
    see: str = ""  # options of what agents see, such as "scaled,teammates"

    @property
    def sight(self):
        return {f"see_{name}": True for name in self.see.split(",") if name}


def mlp(n_in, n_out, n_hidden, last):
    """Return a network with two hidden layers, whose last layer has weights of a given size."""
    sizes = (n_in, n_hidden), (n_hidden, n_hidden), (n_hidden, n_out)
    layers = [layer for size in sizes for layer in (nn.Linear(*size), nn.Tanh())][:-1]
    for layer, gain in zip(layers[::2], (2**0.5, 2**0.5, last), strict=True):
        nn.init.orthogonal_(layer.weight, gain)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(*layers)


def opponents(args):
    """Return whom the team meets: a script, or a list of which each episode draws one."""
    if args.opponent != "pool":
        return args.opponent or DEFAULT_OPPONENTS[args.team]
    evolved = [team.name for team in load_zoo(args.task).teams if team.role != args.team and not team.held_out]
    return [*SCRIPTS["prey" if args.team == "predators" else "predators"], *map(load_team, evolved)]


def train(args, report=lambda steps, policy: None):
    """Return the trained policy, a network from observations to logits; call `report` before each update."""
    torch.set_num_threads(1)  # more threads only wait for each other: the networks are too small
    torch.manual_seed(args.seed)
    envs = vector_env(args.n_worlds, args.team, opponents(args), "SameStep", task=args.task, **args.sight)
    n_rows, n_seen = envs.observation_space.shape
    policy = mlp(n_seen, int(envs.single_action_space.n), args.n_hidden, 0.01)
    critic = mlp(n_seen + 1, 1, args.n_hidden, 1.0)  # sees the time too, as no reward follows the end of the time
    parameters = [*policy.parameters(), *critic.parameters()]
    optimiser = torch.optim.Adam(parameters, args.learning_rate, eps=1e-5)

    def look(seen, infos):
        time = infos["steps"].astype(np.float32)[:, None] / envs.config.max_cycles
        return torch.from_numpy(np.concatenate([seen, time], axis=1)), torch.from_numpy(infos["captured"] == 0).float()

    (states, playing), done = look(*envs.reset(seed=1_000_003 * (args.seed + 1))), 0
    while done < args.steps:
        report(done, policy)
        optimiser.param_groups[0]["lr"] = args.learning_rate * (1 - done / args.steps)

        # Play.
        rollout = []
        for _ in range(args.horizon):
            with torch.no_grad():
                choice, values = Categorical(logits=policy(states[:, :-1]), validate_args=False), critic(states)[:, 0]
                actions = choice.sample()
                chances = choice.log_prob(actions)
            seen, rewards, terminated, truncated, infos = envs.step(actions.numpy())
            goes_on = torch.from_numpy(~(terminated | truncated)).float()
            rollout.append((states, playing, actions, chances, values, torch.from_numpy(rewards).float() / 25, goes_on))
            states, playing = look(seen, infos)
        done += args.horizon * n_rows

        # Generalised advantages (Schulman et al. 2016).
        batch = [torch.stack(column) for column in zip(*rollout, strict=True)]
        values, rewards, goes_on = batch[4:]
        advantages, advantage = torch.zeros_like(values), torch.zeros(n_rows)
        following = critic(states)[:, 0].detach()
        for t in reversed(range(args.horizon)):
            error = rewards[t] + args.gamma * goes_on[t] * following - values[t]
            advantages[t] = advantage = error + args.gamma * args.trace * goes_on[t] * advantage
            following = values[t]

        # Learn from the agents that are still free; a caught prey's actions do nothing.
        there = batch[1].flatten().nonzero()[:, 0]
        columns = [c.flatten(0, 1)[there] for c in (*batch[:1], *batch[2:4], advantages, advantages + values)]
        for _ in range(args.epochs):
            for rows in torch.randperm(len(there)).chunk(args.n_minibatches):
                states_, actions, old, advantage, returns = (column[rows] for column in columns)
                choice = Categorical(logits=policy(states_[:, :-1]), validate_args=False)
                ratio = (choice.log_prob(actions) - old).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                gain = torch.min(ratio * advantage, ratio.clamp(1 - args.clip, 1 + args.clip) * advantage).mean()
                error = (critic(states_)[:, 0] - returns).square().mean()
                optimiser.zero_grad()
                (error - gain - args.entropy * choice.entropy().mean()).backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimiser.step()
    report(done, policy)
    return policy


if __name__ == "__main__":
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    for field in fields(Args):
        option = f"--{field.name.replace('_', '-')}"
        parser.add_argument(option, type=type(field.default), default=field.default, help=" ")
    args, begun, n_reports = Args(**vars(parser.parse_args())), process_time(), 0
    world = TASKS[args.task].world.replace(**args.sight)
    arena = Arena(world, n_episodes=400, seed=1)  # always the same starts, other than those of the training
    met = DEFAULT_OPPONENTS[args.team] if args.opponent in ("", "pool") else args.opponent

    def report(steps, policy):
        global n_reports
        if steps < args.steps * n_reports / 2:
            return
        n_reports, seconds = n_reports + 1, process_time() - begun
        team = TorchPolicy(policy, world.team(args.team), drawn=True)  # samples, as in training
        caught = arena.meet(team, args.team, met).captured.mean() / world.n_prey
        print(f"{steps:9,} steps, {seconds:3.0f} CPU-seconds: {caught:.2f} of the prey caught")

    train(args, report)
