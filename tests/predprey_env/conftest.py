"""What several test files of the environment share: worlds and episodes written by hand, random configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.dynamics import World

if TYPE_CHECKING:
    from collections.abc import Callable

settings.register_profile("predprey", deadline=None, derandomize=True, max_examples=40)
settings.load_profile("predprey")

# Tiny worlds, in which random walkers meet: `st.from_type(EnvConfig)` draws them.
st.register_type_strategy(
    EnvConfig,
    st.fixed_dictionaries(
        {
            "n_predators": st.integers(1, 4),
            "n_prey": st.integers(1, 3),
            "size": st.integers(3, 9),
            "max_cycles": st.integers(1, 20),
            "move_order": st.sampled_from(["simultaneous", "prey_first"]),
            "swap_captures": st.booleans(),
            "captured_prey": st.sampled_from(["inert", "removed"]),
            "start_collisions": st.sampled_from(["redraw", "allow"]),
            "predator_idle": st.booleans(),
            "closeness": st.sampled_from(["uncaught", "all", "nearest"]),
            "credit": st.sampled_from(["team", "individual"]),
            "prey_fitness": st.sampled_from(["lifespan", "complementary"]),
            "reward": st.sampled_from(["terminal", "dense"]),
        }
    ).map(lambda fields: EnvConfig(**fields)),
)

Cells = list[tuple[int, int]]


class Step(NamedTuple):
    """What `ParallelEnv.step` returns, by name."""

    observations: dict[str, np.ndarray]
    rewards: dict[str, float]
    terminations: dict[str, bool]
    truncations: dict[str, bool]
    infos: dict[str, dict[str, float]]


@pytest.fixture(scope="session")
def make_world() -> Callable[..., World]:
    """``make_world(predators, prey, caught=())``: a world from lists of cells and the indices of caught prey."""

    def make(predators: Cells, prey: Cells, caught: tuple[int, ...] = ()) -> World:
        cells = np.array([*predators, *prey], np.int32)
        alive = np.array([i not in caught for i in range(len(prey))], np.int32)
        return World(cells[:, 0].copy(), cells[:, 1].copy(), alive)

    return make


@pytest.fixture(scope="session")
def play() -> Callable[..., list[Step]]:
    """``play(env, starts, "IE", "WN")``: an episode by hand, one word a step, one letter of EWNSI an agent."""

    def play_words(env: PredPreyEnv, starts: Cells, *words: str) -> list[Step]:
        env.reset(options={"starts": starts})
        letters = [dict(zip(env.possible_agents, word, strict=True)) for word in words]
        return [Step(*env.step({agent: "EWNSI".index(letter[agent]) for agent in env.agents})) for letter in letters]

    return play_words


@pytest.fixture(scope="session")
def play_randomly() -> Callable[..., list[Step]]:
    """``play_randomly(env, seed)``: a whole episode of random actions, all that it returned, the reset first."""

    def episode(env: PredPreyEnv, seed: int, *, reset: bool = True) -> list[Any]:
        actions = np.random.default_rng(seed)
        record: list[Any] = [env.reset(seed=seed)] if reset else []
        while env.agents:
            chosen = {agent: int(actions.integers(env.action_space(agent).n)) for agent in env.agents}
            record.append(Step(*env.step(chosen)))
        return record

    return episode
