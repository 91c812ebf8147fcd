"""An episode of two policies, frame by frame."""

from __future__ import annotations

from collections.abc import Iterator

from predprey_env import PredPreyEnv
from predprey_env.config import EnvConfig
from predprey_env.policies import Policy


def replay(predators: Policy, prey: Policy, env: EnvConfig, seed: int = 0) -> Iterator[str]:
    """The world as text, before the first step and after each."""
    world = PredPreyEnv(env, render_mode="ansi")
    observations, _ = world.reset(seed=seed)
    predators.reset(seed)
    prey.reset(seed)
    yield str(world.render())
    while world.agents:
        hunters = {agent: seen for agent, seen in observations.items() if agent.startswith("predator")}
        hunted = {agent: seen for agent, seen in observations.items() if agent.startswith("prey")}
        observations, *_ = world.step({**predators.act(hunters), **prey.act(hunted)})
        yield str(world.render())
