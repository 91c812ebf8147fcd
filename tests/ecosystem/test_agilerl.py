"""AgileRL: IPPO, which shares networks among agents of a name and thus has an actor and a critic for each team.

The default, inert prey, works as it is. Prey that leave need SuperSuit's `black_death_v3`, which keeps their places:
AgileRL takes the reward of an agent that left as NaN, and IPPO learns from it. Its own `AsyncAgentsWrapper` does not
help, as it is for agents that take turns.
"""

from __future__ import annotations

from typing import Any

import pytest
import supersuit
import torch
from agilerl.algorithms import IPPO
from agilerl.training.train_multi_agent_on_policy import train_multi_agent_on_policy
from gymnasium.spaces import Dict
from watched import Watched

from predprey_env import predprey_v0

pytestmark = pytest.mark.ecosystem

TEAMS = {"predator", "prey"}


def weights(agent: IPPO) -> dict[str, torch.Tensor]:
    """A copy of each team's weights, actor's and critic's, in a row."""
    networks = {team: [*agent.actors[team].parameters(), *agent.critics[team].parameters()] for team in agent.actors}
    return {team: torch.nn.utils.parameters_to_vector(these).detach().clone() for team, these in networks.items()}


def test_the_snippet_trains_one_network_for_each_team(snippet: dict[str, Any]) -> None:
    (agent,) = snippet["population"]
    assert set(agent.actors) == set(agent.critics) == TEAMS
    assert agent.steps >= 1000
    (returns,) = snippet["returns"]
    assert set(returns) == TEAMS


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_both_teams_learn_from_episodes_with_captures(captured_prey: str) -> None:
    raw = predprey_v0.parallel_env(size=7, reward="dense", captured_prey=captured_prey)
    watched = Watched(raw)
    env = supersuit.black_death_v3(watched) if captured_prey == "removed" else watched
    agent = IPPO(Dict(raw.observation_spaces), Dict(raw.action_spaces), learn_step=1000)
    before = weights(agent)
    train_multi_agent_on_policy(env, "predprey", "IPPO", [agent], sum_scores=False, max_steps=1000, evo_steps=1000)
    after = weights(agent)

    assert watched.episodes > 0
    assert watched.captures > 0
    for team in TEAMS:
        assert (before[team] != after[team]).any()
        assert after[team].isfinite().all()
