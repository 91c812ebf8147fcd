"""Both teams in many worlds: the same episodes as in single worlds, to the bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from hypothesis import given
from hypothesis import strategies as st

from predprey_env import EnvConfig, ParallelVectorEnv, PredPreyEnv, parallel_vector_env

CONFIGS = st.from_type(EnvConfig).map(lambda config: config.replace(captured_prey="inert", move_order="simultaneous"))
SMALL = EnvConfig(n_predators=2, n_prey=2, size=5, max_cycles=7, reward="dense")


def draw(env: ParallelVectorEnv, random: np.random.Generator) -> dict[str, np.ndarray]:
    return {agent: random.integers(env.single_action_space(agent).n, size=env.n_worlds) for agent in env.agents}


def assert_equal(many: dict[str, Any], ones: list[dict[str, Any]]) -> None:
    for agent, values in many.items():
        expected = np.array([one[agent] for one in ones], values.dtype)
        assert values.tobytes() == expected.tobytes(), agent


def in_world(actions: dict[str, np.ndarray], world: int) -> dict[str, int]:
    return {agent: int(chosen[world]) for agent, chosen in actions.items()}


def column(infos: dict[str, dict[str, np.ndarray]], name: str) -> dict[str, np.ndarray]:
    return {agent: info[name] for agent, info in infos.items()}


@given(CONFIGS, st.integers(1, 20), st.integers(0, 1000))
def test_worlds_are_single_worlds(config: EnvConfig, n_worlds: int, seed: int) -> None:
    """With worlds that start again in the step in which they end, from the same generator."""
    many = ParallelVectorEnv(config, n_worlds)
    singles = [PredPreyEnv(config) for _ in range(n_worlds)]
    seen, _ = many.reset(seed=seed)
    assert_equal(seen, [single.reset(seed=seed + world)[0] for world, single in enumerate(singles)])
    random = np.random.default_rng(seed)
    for _ in range(12):
        actions = draw(many, random)
        seen, rewards, terminated, truncated, infos = many.step(actions)
        steps = [single.step(in_world(actions, world)) for world, single in enumerate(singles)]
        assert_equal(rewards, [step[1] for step in steps])
        assert_equal(terminated, [step[2] for step in steps])
        assert_equal(truncated, [step[3] for step in steps])
        assert many.final_state.tobytes() == np.stack([single.state() for single in singles]).tobytes()
        over = np.array([not single.agents for single in singles])
        if over.any():
            assert_equal(column(infos, "final_obs"), [step[0] for step in steps])
            assert all((info["_final_obs"] == over).all() for info in infos.values())
        else:
            told = [step[4] for step in steps]
            for name in ("captured", "n_captured", "steps"):
                assert_equal(column(infos, name), [{a: info[name] for a, info in one.items()} for one in told])
        now = [s.reset()[0] if not s.agents else step[0] for s, step in zip(singles, steps, strict=True)]
        assert_equal(seen, now)
        assert many.state().tobytes() == np.stack([single.state() for single in singles]).tobytes()


def test_in_the_next_step_a_world_starts_again_whatever_the_actions() -> None:
    env = parallel_vector_env(3, AutoresetMode.NEXT_STEP, n_predators=1, n_prey=1, size=9, max_cycles=2)
    starts = np.array([[[0, 0], [4, 4]], [[0, 0], [2, 0]], [[0, 0], [4, 4]]])
    env.reset(seed=1, options={"starts": starts})
    east_west = {"predator_0": np.zeros(3, int), "prey_0": np.ones(3, int)}
    _, rewards, terminated, truncated, _ = env.step(east_west)  # the predator and the prey of world 1 meet at (1, 0)
    assert terminated["prey_0"].tolist() == [False, True, False]
    assert rewards["predator_0"].tolist() == [0, 25, 0]
    _, _, terminated, truncated, infos = env.step(east_west)
    assert truncated["prey_0"].tolist() == [True, False, True]
    assert infos["prey_0"]["steps"].tolist() == [2, 0, 2]
    assert not terminated["predator_0"].any()


def test_without_autoreset_the_worlds_that_are_over_must_be_started() -> None:
    env = parallel_vector_env(2, "Disabled", n_predators=1, n_prey=1, size=9, max_cycles=1)
    env.reset(seed=1)
    actions = draw(env, np.random.default_rng(0))
    env.step(actions)
    with pytest.raises(RuntimeError, match=r"reset_mask for the worlds that are over, got \[0, 1\]"):
        env.step(actions)
    env.reset(options={"reset_mask": np.array([True, True])})
    env.step(actions)


def test_a_mask_starts_only_the_worlds_that_it_marks() -> None:
    env = ParallelVectorEnv(SMALL, 4)
    env.reset(seed=3)
    before = env.state()
    env.reset(seed=9, options={"reset_mask": np.array([False, True, False, False])})
    assert (env.state() == before).all(axis=1).tolist() == [True, False, True, True]


def test_spaces_hold_what_is_returned() -> None:
    env = ParallelVectorEnv(SMALL, 5)
    seen, _ = env.reset(seed=0)
    assert env.possible_agents == ["predator_0", "predator_1", "prey_0", "prey_1"] == list(seen)
    assert env.num_envs == 5
    for agent in env.agents:
        assert env.observation_space(agent).contains(seen[agent])
        assert env.single_observation_space(agent).contains(seen[agent][0])
        assert env.action_space(agent).nvec.tolist() == [5 if agent.startswith("predator") else 4] * 5
    assert all(env.state_space.contains(row) for row in env.state())


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        ({"prey_0": np.full(2, 4)}, r"^actions for prey_0 must be in 0..3, got 4 to 4$"),
        (
            {"predator_1": np.zeros(3, int)},
            r"^actions for predator_1 must be integers of shape \(2,\), got int64 of shape \(3,\)$",
        ),
        ({"ghost": np.zeros(2, int)}, r"^actions must be for predator_0, .*, got one for 'ghost'$"),
    ],
)
def test_what_is_no_action_is_refused_and_nothing_moves(spoil: dict[str, np.ndarray], message: str) -> None:
    env = ParallelVectorEnv(SMALL, 2)
    env.reset(seed=0)
    before = env.state()
    with pytest.raises(ValueError, match=message):
        env.step(draw(env, np.random.default_rng(0)) | spoil)
    assert env.state().tobytes() == before.tobytes()


def test_an_action_that_is_missing_is_named() -> None:
    env = ParallelVectorEnv(SMALL, 2)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"^actions for predator_1 are missing$"):
        env.step({"predator_0": np.zeros(2, int)})


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"move_order": "prey_first"}, "move_order must be 'simultaneous', got 'prey_first'"),
        (
            {"captured_prey": "removed"},
            "captured_prey must be 'inert', as no row may leave, got 'removed'",
        ),
    ],
)
def test_worlds_that_it_cannot_play_are_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        parallel_vector_env(2, **fields)


def test_nothing_happens_before_the_first_reset() -> None:
    env = ParallelVectorEnv(SMALL, 2)
    for call in (env.state, lambda: env.step({})):
        with pytest.raises(RuntimeError, match=r"^reset\(\) must be called before (state|step)\(\)$"):
            call()
