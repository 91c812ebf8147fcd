"""skrl: IPPO, with a policy and a value network for each agent.

The default, inert prey, works as it is. Prey that leave need SuperSuit's `black_death_v3`, which keeps their places:
skrl reads a reward for every agent that there ever was.
"""

from __future__ import annotations

from typing import Any

import pytest
import supersuit
import torch
from skrl.envs.wrappers.torch import wrap_env
from skrl.utils.runner.torch import Runner
from watched import Watched

from predprey_env import predprey_v0

pytestmark = [pytest.mark.ecosystem, pytest.mark.usefixtures("place")]  # it writes where it is started

AGENTS = ["predator_0", "predator_1", "predator_2", "prey_0", "prey_1"]


def weights(runner: Runner) -> dict[str, torch.Tensor]:
    """A copy of each agent's weights, policy's and value's, in a row."""
    networks = {
        agent: [*models["policy"].parameters(), *models["value"].parameters()]
        for agent, models in runner.agent.models.items()
    }
    return {agent: torch.nn.utils.parameters_to_vector(these).detach().clone() for agent, these in networks.items()}


def test_the_snippet_trains_networks_for_each_agent(snippet: dict[str, Any]) -> None:
    assert list(weights(snippet["runner"])) == AGENTS


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_every_agent_learns_from_episodes_with_captures(snippet: dict[str, Any], captured_prey: str) -> None:
    watched = Watched(predprey_v0.parallel_env(size=7, reward="dense", captured_prey=captured_prey))
    env = supersuit.black_death_v3(watched) if captured_prey == "removed" else watched
    runner = Runner(wrap_env(env, wrapper="pettingzoo"), snippet["settings"])
    before = weights(runner)
    runner.run()
    after = weights(runner)

    assert watched.episodes > 0
    assert watched.captures > 0
    for agent in AGENTS:
        assert (before[agent] != after[agent]).any()
        assert after[agent].isfinite().all()
