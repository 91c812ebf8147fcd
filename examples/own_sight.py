"""Evolve predators that see in their own way: a prey that is farther than some cells is out of sight.

Run: `python examples/own_sight.py`. It takes 3 CPU-seconds, and 20 more to compile. It prints

    predator_0 observes [-1.  9.  1.]
    near: the champions catch 0.44 of the prey at first, 0.77 in the end
    everywhere: the champions catch 0.24 of the prey at first, 0.92 in the end

From the command line, with the class in `my_module.py`: `esp-trainer train pond --env.observation my_module:Near`. Such
runs resume, and replays, the page, `analyse` and `compare` know them as any other.
"""

import sys
from typing import NamedTuple

from esp_trainer import Coevolution, FusedEvaluator, new_sides, preset
from predprey_env import manhattan, observe, offset_to, parallel_env
from predprey_env.jit import as_float, rule, store, where

N_GENERATIONS = 3 if "--quick" in sys.argv else 40
FIELDS = {"prey.policy": "flee_nearest", "esp.past_share": 0, "esp.exploiters_every": 0, "champion.n_past": 0}


class Near(NamedTuple):
    reach: int = 10  # cells, counted along both axes
    moves = False  # the rule does not read the last moves

    def n_seen(self, n_agents, n_opponents):
        return 3 * n_opponents

    def groups(self, n_agents, n_opponents):
        return [[3 * i, 3 * i + 1, 3 * i + 2] for i in range(n_opponents)]  # each for a network of its own

    def bounds(self, n_agents, n_opponents, size):
        return -self.reach, self.reach


@observe.register(Near)
@rule  # compiled, for one world or for sixteen side by side
def near(sight, world, moved, agent, rules, out, row):
    hunts = agent < rules.n_predators
    first, n_opponents = (rules.n_predators, rules.n_prey) if hunts else (0, rules.n_predators)
    for other in range(first, first + n_opponents):
        dx, dy = offset_to(world, agent, other, rules)
        seen = manhattan(dx, dy) <= sight.reach
        store(out, row, as_float(where(seen, dx, 0)))
        store(out, row + 1, as_float(where(seen, dy, 0)))
        store(out, row + 2, as_float(where(seen, 1, 0)))
        row += 3
    return row


observations, _ = parallel_env(task="pond", observation=f"{__name__}:Near").reset(seed=5)
print("predator_0 observes", observations["predator_0"])
for name, observation in (("near", f"{__name__}:Near"), ("everywhere", "offsets")):
    config = preset("pond").with_fields(FIELDS | {"env.observation": observation})
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env))
    caught = [run.step(number).held_out.caught.rate for number in range(N_GENERATIONS)]
    print(f"{name}: the champions catch {caught[0]:.2f} of the prey at first, {caught[-1]:.2f} in the end")
