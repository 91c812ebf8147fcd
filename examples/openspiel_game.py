"""A small torus as a game of OpenSpiel, in which its value iteration finds the values that `esp_trainer.solve` does.

Run: `pip install open_spiel cvxpy ecos`, then `python examples/openspiel_game.py`. It takes 9 CPU-seconds and prints

    4 x 4, 2 predators, 3 steps: prey caught in optimal play
    predators at [[0, 2], [1, 0]]: OpenSpiel 0.6250, esp_trainer 0.6250
    predators at [[1, 0], [2, 3]]: OpenSpiel 0.5000, esp_trainer 0.5000
    predators at [[1, 3], [0, 3]]: OpenSpiel 0.5000, esp_trainer 0.5000
    predators at [[2, 1], [2, 2]]: OpenSpiel 0.5000, esp_trainer 0.5000
    predators at [[3, 0], [0, 2]]: OpenSpiel 0.6250, esp_trainer 0.6250
    predators at [[3, 2], [2, 1]]: OpenSpiel 0.5000, esp_trainer 0.5000
    all 225 starts: 0.5444, 0.5444, at most 2e-08 apart
"""

import argparse
from itertools import product

import numpy as np
import pyspiel
from open_spiel.python.algorithms.value_iteration import value_iteration

from esp_trainer import solve
from predprey_env import parallel_env

parser = argparse.ArgumentParser()
parser.add_argument("--quick", action="store_true", help="a step less")
SIZE, N_PREDATORS, N_STEPS = 4, 2, 2 if parser.parse_args().quick else 3
ENV = parallel_env(size=SIZE, n_predators=N_PREDATORS, n_prey=1)
CELLS = list(product(range(SIZE), repeat=2))  # seen from the prey, which is in the first
STARTS = list(product(CELLS[1:], repeat=N_PREDATORS))
KINDS = pyspiel.GameType
KIND = pyspiel.GameType(
    "predprey",
    "Predators and one prey on a torus",
    KINDS.Dynamics.SIMULTANEOUS,
    KINDS.ChanceMode.EXPLICIT_STOCHASTIC,  # for the start only
    KINDS.Information.PERFECT_INFORMATION,
    KINDS.Utility.ZERO_SUM,
    KINDS.RewardModel.TERMINAL,
    *(2, 2),  # numbers of players
    *[False] * 4,  # no strings or tensors of what a player observes
)


class Game(pyspiel.Game):
    """Player 0 moves all predators and wins 1 if they catch the prey in time; player 1 moves the prey."""

    def __init__(self, params=None):
        super().__init__(KIND, pyspiel.GameInfo(5**N_PREDATORS, len(STARTS), 2, -1, 1, 0, N_STEPS), params or {})

    def new_initial_state(self):
        return State(self)


class State(pyspiel.State):
    """Offsets of the predators from the prey, and the number of steps left. Chance places the predators."""

    def __init__(self, game):
        super().__init__(game)
        self.seen, self.left, self.caught = None, N_STEPS, False

    def current_player(self):
        if self.seen is None:
            return pyspiel.PlayerId.CHANCE
        return pyspiel.PlayerId.TERMINAL if self.is_terminal() else pyspiel.PlayerId.SIMULTANEOUS

    def is_terminal(self):
        return self.caught or self.left == 0

    def chance_outcomes(self):
        return [(start, 1 / len(STARTS)) for start in range(len(STARTS))]

    def _legal_actions(self, player):
        return list(range(5**N_PREDATORS if player == 0 else 4))  # an action for each predator, as one number

    def _apply_action(self, action):
        self.seen = STARTS[action]

    def _apply_actions(self, actions):
        """Play one step of the environment, from where the agents are."""
        ENV.reset(options={"starts": [*self.seen, (0, 0)]})
        chosen = [*np.unravel_index(actions[0], [5] * N_PREDATORS), actions[1]]
        _, _, terminated, _, _ = ENV.step(dict(zip(ENV.possible_agents, map(int, chosen), strict=True)))
        cells = ENV.state()[: 2 * len(chosen)].astype(int).reshape(2, -1).T
        self.seen = ((cells - cells[-1]) % SIZE)[:-1].tolist()
        self.left, self.caught = self.left - 1, terminated["prey_0"]

    def returns(self):
        return [float(self.caught), -float(self.caught)]

    def __str__(self):
        """Return the same text for positions that are turned, mirrored, or differ in the predators' order."""
        if self.seen is None or self.caught:
            return "caught" if self.caught else "start"
        images = [sorted((a * x % SIZE, b * y % SIZE) for x, y in self.seen) for a in (1, -1) for b in (1, -1)]
        images += [sorted((y, x) for x, y in image) for image in images]
        return f"predators at {min(images)}, {self.left} steps left"


pyspiel.register_game(KIND, Game)
start = pyspiel.load_game("predprey").new_initial_state()
# "Cyclic" lets it visit each position once, however many ways lead there.
values = value_iteration(start.get_game(), depth_limit=-1, threshold=1e-6, cyclic_game=True)
theirs = np.array([values[str(start.child(action))] for action, _ in start.chance_outcomes()])
places = np.array([[*seen, (0, 0)] for seen in STARTS])
ours = solve(ENV.config, N_STEPS).value(places @ [SIZE, 1], N_STEPS)

print(f"{SIZE} x {SIZE}, {N_PREDATORS} predators, {N_STEPS} steps: prey caught in optimal play")
for i in range(18, len(STARTS), len(STARTS) // 6):
    print(f"predators at {places[i, :-1].tolist()}: OpenSpiel {theirs[i]:.4f}, esp_trainer {ours[i]:.4f}")
far = abs(theirs - ours).max()
print(f"all {len(STARTS)} starts: {theirs.mean():.4f}, {ours.mean():.4f}, at most {far:.0e} apart")
