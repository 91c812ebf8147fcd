"""Evolve both teams of a game of your own: two chasers and a runner on a ring of cells.

Run: `python examples/own_game.py`. It takes 24 CPU-seconds. The last chasers are paid 6.19 by the first runner, the
first ones 3.62. From the command line, where this file is: `esp-trainer train game --game.environment own_game
--game.predators chaser_ --game.prey runner_`, then `esp-trainer report runs/game-seed0`.
"""

import sys

import numpy as np
from gymnasium.spaces import Box, Discrete
from pettingzoo import ParallelEnv

from esp_trainer import History, make_evaluator, own_cross_play, preset

SIZE, N_STEPS = 24, 20
FIELDS = {"game.environment": f"{__name__}:parallel_env", "game.predators": "chaser_", "game.prey": "runner_"}
FIELDS |= {"generations": 4 if "--quick" in sys.argv else 61, "esp.n_trials": 60}


class Ring(ParallelEnv):
    """All step left, right or not at all. Each step in which a chaser is on the runner's cell costs the runner 1."""

    possible_agents = ("chaser_0", "chaser_1", "runner_0")

    def observation_space(self, agent):
        return Box(-1, 1, (2,), np.float32)

    def action_space(self, agent):
        return Discrete(3)

    def reset(self, seed=None, options=None):
        self.agents, self.steps = [*self.possible_agents], 0
        self.cells = dict(zip(self.agents, np.random.default_rng(seed).integers(0, SIZE, 3).tolist(), strict=True))
        return self.seen(), {agent: {} for agent in self.agents}

    def step(self, actions):
        acting, self.steps = self.agents, self.steps + 1
        self.cells = {agent: (self.cells[agent] + actions[agent] - 1) % SIZE for agent in acting}
        caught = float(self.cells["runner_0"] in (self.cells["chaser_0"], self.cells["chaser_1"]))
        rewards, over = dict(zip(acting, (caught, caught, -caught), strict=True)), self.steps == N_STEPS
        self.agents = [] if over else acting
        return self.seen(), rewards, dict.fromkeys(acting, False), dict.fromkeys(acting, over), {a: {} for a in acting}

    def seen(self):  # how far the two others are, the shorter way round
        half, at = SIZE // 2, self.cells
        return {a: np.array([((at[b] - at[a] + half) % SIZE - half) / half for b in at if b != a], "f4") for a in at}


parallel_env = Ring

if __name__ == "__main__":  # several processes play the game, and each imports this file
    config = preset("game").with_fields(FIELDS)
    evaluator = make_evaluator(config)
    history = History.evolve(config, evaluator)
    met = own_cross_play(history, evaluator, n_generations=4)
    print("payoff to the chasers of generation (rows) against the runner of generation", *met.prey)
    for generation, row in zip(met.predators, met.payoff, strict=True):
        print(f"{generation:4} |", *(f"{payoff:6.2f}" for payoff in row))
