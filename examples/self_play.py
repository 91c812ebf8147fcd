"""Self-play in one file: PPO for predators and prey in turn, each against the other side as it is and as it was.

Run: `pip install torch`, then `python examples/self_play.py`. Neither side ever meets a script in training. It takes
33 CPU-seconds and prints

        0 steps,   3 CPU-seconds: 0.00 of flee_nearest caught, 1.00 lost to surround
  327,680 steps,  17 CPU-seconds: 0.36 of flee_nearest caught, 0.62 lost to surround
  655,360 steps,  33 CPU-seconds: 0.17 of flee_nearest caught, 0.35 lost to surround

Once the prey of the training flee better, its predators forget how to catch a simple script.
"""

import argparse
import copy
from time import process_time

import numpy as np
import torch
from torch import nn
from torch.distributions import Categorical

from esp_trainer import Arena, TorchPolicy
from predprey_env import TASKS, OpponentPool, vector_env

parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
parser.add_argument("--task", default="pond", help="world")
parser.add_argument("--steps", type=int, default=650_000, help="steps of agents, of both sides in all")
parser.add_argument("--seed", type=int, default=0, help="seed")
parser.add_argument("--updates", type=int, default=4, help="updates of a side until the other side learns")
parser.add_argument("--n-past", type=int, default=3, help="past selves in the pool beside the present one")
parser.add_argument("--reports", type=int, default=2, help="number of printed lines after the first")
args = parser.parse_args()
N_WORLDS, HORIZON, EPOCHS, N_MINIBATCHES = 128, 32, 4, 6
LEARNING_RATE, GAMMA, TRACE, CLIP, ENTROPY = 3e-3, 0.99, 0.9, 0.2, 0.005
WORLD = TASKS[args.task].world


def mlp(n_in, n_out):
    return nn.Sequential(nn.Linear(n_in, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, n_out))


class Side:
    """A team that learns: one policy for all its agents, a critic, and its worlds with the other side inside."""

    def __init__(self, team, opponent):
        self.team, self.shape = team, WORLD.team(team)
        self.policy, self.critic = mlp(self.shape.n_seen, self.shape.n_actions), mlp(self.shape.n_seen + 1, 1)
        nn.init.orthogonal_(self.policy[-1].weight, 0.01)  # nearly equal probabilities at first
        self.parameters = [*self.policy.parameters(), *self.critic.parameters()]
        self.optimiser = torch.optim.Adam(self.parameters, LEARNING_RATE, eps=1e-5)
        self.worlds = vector_env(N_WORLDS, team, opponent, "SameStep", task=args.task)
        self.now = self.look(*self.worlds.reset(seed=1_000_003 * (args.seed + 1)))
        self.past, self.steps = [self.frozen()], 0

    def frozen(self):
        """Return the policy as it is now, as an opponent that samples its actions."""
        return TorchPolicy(copy.deepcopy(self.policy), self.shape, drawn=True)

    def look(self, seen, infos):
        """Return observations with the time that has passed, and which agents still play."""
        time = infos["steps"].astype(np.float32)[:, None] / WORLD.max_cycles
        return torch.from_numpy(np.concatenate([seen, time], axis=1)), torch.from_numpy(infos["captured"] == 0)

    @torch.no_grad()
    def play(self):
        """Return observations, which agents play, actions, their log-probabilities, advantages and returns."""
        rollout = []
        for _ in range(HORIZON):
            states, playing = self.now
            choice = Categorical(logits=self.policy(states[:, :-1]), validate_args=False)
            actions = choice.sample()
            seen, rewards, terminated, truncated, infos = self.worlds.step(actions.numpy())
            goes_on, rewards = torch.from_numpy(~(terminated | truncated)).float(), torch.from_numpy(rewards).float()
            values = self.critic(states)[:, 0]
            rollout.append((states, playing, actions, choice.log_prob(actions), values, rewards / 25, goes_on))
            self.now = self.look(seen, infos)
        *played, values, rewards, goes_on = (torch.stack(column) for column in zip(*rollout, strict=True))
        advantages, advantage, following = torch.zeros_like(values), 0, self.critic(self.now[0])[:, 0]
        for t in reversed(range(HORIZON)):
            error = rewards[t] + GAMMA * goes_on[t] * following - values[t]
            advantages[t] = advantage = error + GAMMA * TRACE * goes_on[t] * advantage
            following = values[t]
        self.steps += values.numel()
        return *played, advantages, advantages + values

    def update(self):
        states, playing, *others = (column.flatten(0, 1) for column in self.play())
        columns = [column[playing] for column in (states, *others)]  # what caught prey choose has no effect
        for _ in range(EPOCHS):
            for rows in torch.randperm(len(columns[0])).chunk(N_MINIBATCHES):
                states, actions, old, advantage, returns = (column[rows] for column in columns)
                choice = Categorical(logits=self.policy(states[:, :-1]), validate_args=False)
                ratio = (choice.log_prob(actions) - old).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage).mean()
                error = (self.critic(states)[:, 0] - returns).square().mean()
                self.optimiser.zero_grad()
                (error - gain - ENTROPY * choice.entropy().mean()).backward()
                nn.utils.clip_grad_norm_(self.parameters, 0.5)
                self.optimiser.step()


torch.set_num_threads(1)  # more threads only wait for each other: the networks are too small
torch.manual_seed(args.seed)
rng, begun = np.random.default_rng(args.seed), process_time()
predators = Side("predators", "random")
prey = Side("prey", predators.past[0])
predators.worlds.set_opponent(prey.past[0])
arena = Arena(WORLD, n_episodes=400, seed=1)  # always the same starts, other than those of the training


def report():
    """Print the fraction of prey caught by and from scripts, which no side meets in training."""
    hunters, hunted = predators.frozen(), prey.frozen()
    caught = arena.meet(hunters, "predators", "flee_nearest").captured.mean() / WORLD.n_prey
    lost = arena.meet(hunted, "prey", "surround").captured.mean() / WORLD.n_prey
    at = f"{predators.steps + prey.steps:9,} steps, {process_time() - begun:3.0f} CPU-seconds"
    print(f"{at}: {caught:.2f} of flee_nearest caught, {lost:.2f} lost to surround")


n_reports = 0
while True:
    done = predators.steps + prey.steps
    if done >= args.steps * n_reports / args.reports:
        report()
        n_reports += 1
    if done >= args.steps:
        break
    for side, other in ((predators, prey), (prey, predators)):
        for _ in range(args.updates):
            side.update()
        side.past.append(side.frozen())
        # Half of the episodes are against the present side: a pool of the past alone is an easier opponent.
        older = [side.past[i] for i in rng.permutation(len(side.past) - 1)[: args.n_past]]
        other.worlds.set_opponent(OpponentPool([side.past[-1], *older], [len(older), *[1] * len(older)]))
