"""Write a player in compiled code, play it in 1,024 worlds, and compare its speed with the same rule in Python.

Run: `python examples/compiled_player.py`. It takes 11 CPU-seconds, most of them to compile, and prints

    compiled: 6,236,541 steps of the prey a second
    in Python: 60,953 steps of the prey a second
"""

import sys
from time import perf_counter
from typing import NamedTuple

import numpy as np

from predprey_env import choose, vector_env
from predprey_env.jit import load, rule
from predprey_env.policies import towards

N_WORLDS = 32 if "--quick" in sys.argv else 1024
ZERO, ONE = np.float32(0), np.float32(1)  # a plain 1 would make one world compute in float64, and sixteen not


class Repelled(NamedTuple):
    n_predators: int  # a player holds what its rule must know; `choose` finds the rule by the player's class


@choose.register(Repelled)
@rule
def run_from_all(player, agent, seen, memory, at):
    """Run from the predators' combined push: each pushes the harder the nearer it is."""
    # One source for one world and for sixteen side by side: read with `load`, choose with `where`, not with `if`.
    push_x, push_y = ZERO * load(seen, 0), ZERO * load(seen, 1)
    for predator in range(player.n_predators):
        dx, dy = load(seen, 2 * predator), load(seen, 2 * predator + 1)
        square = dx * dx + dy * dy + ONE
        push_x, push_y = push_x - dx / square, push_y - dy / square
    return towards(push_x, push_y)


class RepelledPrey:
    """The policy. The vector environment asks for the player, `compiled`; everything else calls `act`."""

    def reset(self, seed=None):
        pass  # an episode starts: there is nothing to forget

    def act(self, observations):
        return {agent: int(choose(Repelled(len(seen) // 2), 0, seen, None, 0)) for agent, seen in observations.items()}

    def compiled(self, team, env, lanes):
        return Repelled(env.team(team).n_opponents)


for name, prey in {"compiled": RepelledPrey(), "in Python": RepelledPrey().act}.items():
    envs = vector_env(N_WORLDS, "predators", opponent=prey, n_prey=1)
    envs.reset(seed=0)
    envs.step(idle := np.full(envs.num_envs, 4))  # compiles
    begun = perf_counter()
    for _ in range(100):
        envs.step(idle)
    print(f"{name}: {100 * N_WORLDS / (perf_counter() - begun):,.0f} steps of the prey a second")
