"""Seeds, copies and whole episodes: equal where they must be, and different where they must be."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest

from predprey_env import EnvConfig, PredPreyEnv

# Eight cells wide: random walkers meet, and no two seeds look alike.
WORLDS = [
    EnvConfig(size=8, captured_prey=captured_prey, reward=reward)
    for captured_prey in ("inert", "removed")
    for reward in ("terminal", "dense")
]
Play = Callable[..., list]


def flat(record: list) -> list[bytes]:
    """Each step of an episode as bytes: agents, observations, rewards, ends and infos."""
    return [
        pickle.dumps(
            [
                [
                    (key, value.tobytes() if isinstance(value, np.ndarray) else repr(value))
                    for key, value in part.items()
                ]
                for part in step
            ]
        )
        for step in record
    ]


@pytest.mark.parametrize("config", WORLDS, ids=repr)
def test_whole_episodes_are_equal_for_equal_seeds(play_randomly: Play, config: EnvConfig) -> None:
    captures = 0
    for seed in range(5):
        first, second = play_randomly(PredPreyEnv(config), seed), play_randomly(PredPreyEnv(config), seed)
        assert flat(first) == flat(second)
        captures += first[-1].infos["predator_0"]["n_captured"]
    assert captures


def test_whole_episodes_differ_for_different_seeds(play_randomly: Play) -> None:
    records = {tuple(flat(play_randomly(PredPreyEnv(WORLDS[0]), seed))) for seed in range(20)}
    assert len(records) == 20


def test_a_used_environment_plays_a_seed_like_a_new_one(play_randomly: Play) -> None:
    used, new = PredPreyEnv(WORLDS[0]), PredPreyEnv(WORLDS[0])
    play_randomly(used, seed=1)
    used.reset(seed=2)
    assert flat(play_randomly(used, seed=3)) == flat(play_randomly(new, seed=3))


def test_a_reset_without_a_seed_goes_on_in_the_stream() -> None:
    first, second = PredPreyEnv(), PredPreyEnv()
    starts = []
    for env in (first, second):
        env.reset(seed=4)
        starts.append([env.state().tolist()])
        for _ in range(3):
            env.reset()
            starts[-1].append(env.state().tolist())
    assert starts[0] == starts[1]
    assert len({tuple(start) for start in starts[0]}) == 4


def test_copies_made_before_the_first_reset_are_seeded_apart() -> None:
    original = PredPreyEnv()
    envs = [original, copy.deepcopy(original), pickle.loads(pickle.dumps(original))]
    for env in envs:
        env.reset()
    assert len({tuple(env.state().tolist()) for env in envs}) == 3


def test_the_generator_is_made_when_first_asked_for_and_then_kept() -> None:
    env = PredPreyEnv()
    assert env._random is None
    assert env.np_random is env.np_random
    env.reset(seed=3)
    kept = env.np_random
    env.reset()
    assert env.np_random is kept


def test_given_starts_take_nothing_from_the_generator() -> None:
    env, other = PredPreyEnv(), PredPreyEnv()
    for each in (env, other):
        each.reset(seed=5)
    env.reset(options={"starts": [(i, 0) for i in range(5)]})
    assert env.state().tolist()[:10] == [0, 1, 2, 3, 4, 0, 0, 0, 0, 0]
    for each in (env, other):
        each.reset()
    assert env.state().tolist() == other.state().tolist()


def test_given_starts_are_copied() -> None:
    starts = np.arange(10, dtype=np.int32).reshape(5, 2)
    env = PredPreyEnv()
    env.reset(options={"starts": starts})
    env.step(dict.fromkeys(env.agents, 0))
    assert starts.tolist() == np.arange(10).reshape(5, 2).tolist()
    starts[:] = 50
    assert env.state().tolist()[:5] == [1, 3, 5, 7, 9]


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("config", WORLDS, ids=repr)
def test_a_copy_in_mid_episode_goes_on_like_the_original(play_randomly: Play, config: EnvConfig, duplicate) -> None:
    env = PredPreyEnv(config.replace(max_cycles=80))
    env.reset(seed=6)
    for action in (0, 2, 1):
        env.step(dict.fromkeys(env.agents, action))
    twin = duplicate(env)
    rest = play_randomly(env, seed=7, reset=False)  # the original goes first: the copy shares nothing with it
    assert len(rest) > 10
    assert flat(play_randomly(twin, seed=7, reset=False)) == flat(rest)
    for each in (env, twin):
        each.reset()
    assert env.state().tolist() == twin.state().tolist()
