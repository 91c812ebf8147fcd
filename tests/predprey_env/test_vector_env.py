"""Many worlds at once: their rows, their spaces, their seeds, their starts. What ends and starts again when is in
test_vector_env_autoreset.py, whole episodes against single environments in test_vector_env_parity.py.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete, MultiDiscrete
from gymnasium.vector import AutoresetMode, VectorEnv

from predprey_env import EnvConfig, PredPreyEnv, PredPreyVectorEnv, vector_env
from predprey_env.config import TEAMS, TeamName

SMALL = {"n_predators": 2, "n_prey": 2, "size": 6, "max_cycles": 10}
TEAM = pytest.mark.parametrize("team", TEAMS)
ORDER = pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
MODES = pytest.mark.parametrize("mode", list(AutoresetMode))
Singles = Callable[..., Any]


def walk(env: PredPreyVectorEnv, n_steps: int, seed: int = 0) -> list[Any]:
    """What an environment returns to random actions."""
    actions = np.random.default_rng(seed)
    return [env.step(actions.integers(0, env.single_action_space.n, env.num_envs)) for _ in range(n_steps)]


def counts(infos: dict[str, Any]) -> dict[str, list[int]]:
    return {key: infos[key].tolist() for key in ("captured", "n_captured", "steps")}


def plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: plain(part) for key, part in value.items()}
    return value.tolist() if isinstance(value, np.ndarray) else [plain(part) for part in value]


# -- rows and spaces ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("team", "seen", "done"), [("predators", Box(-5, 4, (4,)), Discrete(5)), ("prey", Box(-5, 4, (6,)), Discrete(4))]
)
def test_rows_are_agents_with_plain_spaces(team: TeamName, seen: Box, done: Discrete) -> None:
    env = vector_env(7, team, "random", n_predators=3, n_prey=2, size=10)
    rows = 21 if team == "predators" else 14
    assert isinstance(env, VectorEnv)
    assert (env.num_envs, env.n_worlds) == (rows, 7)
    assert (env.single_observation_space, env.single_action_space) == (seen, done)
    assert env.observation_space == Box(-5, 4, (rows, *seen.shape))
    assert env.action_space == MultiDiscrete([done.n] * rows)
    assert env.metadata == {
        "name": "predprey_vector_v0",
        "render_modes": ["rgb_array"],
        "render_fps": 15,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }


@MODES
@TEAM
def test_what_is_returned_lies_in_the_spaces(team: TeamName, mode: AutoresetMode) -> None:
    env = vector_env(5, team, "random", mode, **SMALL | {"max_cycles": 40})
    views, infos = env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(30):
        assert views in env.observation_space
        assert all(infos[key].shape == (10,) for key in ("captured", "n_captured", "steps"))
        assert all(infos[key].dtype == np.int64 for key in ("captured", "n_captured", "steps"))
        views, rewards, terminated, truncated, infos = env.step(env.action_space.sample())
        kinds = [(part.dtype, part.shape) for part in (rewards, terminated, truncated)]
        assert kinds == [(np.float64, (10,)), (np.bool_, (10,)), (np.bool_, (10,))]
        if mode is AutoresetMode.DISABLED and (terminated | truncated).any():
            env.reset(options={"reset_mask": terminated | truncated})


@TEAM
@pytest.mark.parametrize("n_worlds", [1, 15, 16, 17, 33])
def test_any_number_of_worlds_is_played(singles: Singles, team: TeamName, n_worlds: int) -> None:
    """Blocks hold sixteen: one not full, just full, and more of them."""
    config = EnvConfig(**SMALL, reward="dense")
    env = PredPreyVectorEnv(config, n_worlds, team, "random", AutoresetMode.SAME_STEP)
    alone, actions = singles(config, team, lambda: "random", n_worlds, AutoresetMode.SAME_STEP), env.action_space
    first, expected = env.reset(seed=5), alone.reset([5 + world for world in range(n_worlds)])
    assert first[0].tolist() == expected.observations.tolist()
    actions.seed(0)
    for _ in range(25):
        chosen = actions.sample()
        assert alone.agrees(env.step(chosen), alone.step(chosen))
    assert alone.n_ended >= 2 * n_worlds


def test_infos_of_predators_by_hand() -> None:
    """In the second world the first predator goes to (1, 0), where the first prey comes too."""
    env = vector_env(2, "predators", lambda views: dict.fromkeys(views, 1), **SMALL | {"size": 8})
    apart, near = [[0, 0], [0, 4], [4, 1], [4, 6]], [[0, 0], [0, 4], [2, 0], [4, 4]]
    _, infos = env.reset(seed=0, options={"starts": [apart, near]})
    assert counts(infos) == {"captured": [0] * 4, "n_captured": [0] * 4, "steps": [0] * 4}
    for step in (1, 2):
        *_, infos = env.step(np.array([0, 4, 0, 4]))
        assert counts(infos) == {"captured": [0] * 4, "n_captured": [0, 0, 1, 1], "steps": [step] * 4}


def test_infos_of_prey_by_hand() -> None:
    env = vector_env(2, "prey", "greedy_chase", n_predators=1, n_prey=2, size=8, max_cycles=9)
    near = [[0, 0], [2, 0], [4, 4]]
    env.reset(seed=0, options={"starts": [[[0, 0], [4, 4], [4, 0]], near]})
    *_, infos = env.step(np.array([0, 0, 1, 0]))  # the third goes to (1, 0), where the chaser comes too
    assert counts(infos) == {"captured": [0, 0, 1, 0], "n_captured": [0, 0, 1, 1], "steps": [1] * 4}


def test_what_was_returned_never_changes() -> None:
    env = vector_env(5, "prey", "intercept", AutoresetMode.SAME_STEP, **SMALL)
    record = [env.reset(seed=0)]
    kept = [plain(record[0])]
    for step in walk(env, 30):
        record.append(step)
        kept.append(plain(step))
    assert [plain(step) for step in record] == kept


def test_what_a_caller_does_to_what_was_returned_does_no_harm() -> None:
    env, twin = (vector_env(5, "prey", "intercept", AutoresetMode.SAME_STEP, **SMALL) for _ in range(2))
    twin.reset(seed=0)
    for step in [env.reset(seed=0), *walk(env, 30)]:
        for array in [*step[:-1], *step[-1].values()]:
            if isinstance(array, np.ndarray) and array.flags.writeable:
                array[:] = 0 if array.dtype == np.bool_ else 77
    walk(twin, 30)
    assert plain(walk(env, 20, seed=1)) == plain(walk(twin, 20, seed=1))


# -- seeds --------------------------------------------------------------------------------------------------------


def cells_seen(config: EnvConfig, team: TeamName, seed: int) -> list[list[float]]:
    """The first views of a team in the environment that has both."""
    views, _ = PredPreyEnv(config).reset(seed=seed)
    return [view.tolist() for agent, view in views.items() if agent.startswith(team[:4])]


@TEAM
@pytest.mark.parametrize(
    ("seed", "by_world"),
    [
        (7, [7, 8, 9]),
        (np.int64(7), [7, 8, 9]),
        (np.array(7), [7, 8, 9]),
        (np.uint8(250), [250, 251, 252]),
        ([3, 1, 2], [3, 1, 2]),
        ((3, 3, 3), [3, 3, 3]),
        (range(4, 7), [4, 5, 6]),
    ],
)
def test_each_world_is_seeded_as_a_single_environment_is(team: TeamName, seed: Any, by_world: list[int]) -> None:
    config = EnvConfig(size=30)
    env = PredPreyVectorEnv(config, 3, team, "random")
    views, _ = env.reset(seed=seed)
    assert views.tolist() == [view for each in by_world for view in cells_seen(config, team, each)]


@pytest.mark.parametrize("seed", [[np.int64(3), np.int64(4)], np.array([3, 4])], ids=["list", "array"])
def test_seeds_of_numpy_are_seeds(seed: Any) -> None:
    env, plain_env = (vector_env(2, "prey", "random", size=30) for _ in range(2))
    assert env.reset(seed=seed)[0].tolist() == plain_env.reset(seed=[3, 4])[0].tolist()


@ORDER
def test_whole_episodes_follow_from_the_seed(move_order: str) -> None:
    used, new = (vector_env(3, "predators", "random", "SameStep", **SMALL, move_order=move_order) for _ in range(2))
    used.reset(seed=1)
    walk(used, 15)
    assert plain(used.reset(seed=2)) == plain(new.reset(seed=2))
    assert plain(walk(used, 25)) == plain(walk(new, 25))


def test_without_a_seed_each_world_goes_on_in_its_stream() -> None:
    env, other = (vector_env(3, "prey", "random", size=50) for _ in range(2))
    env.reset(seed=1)
    other.reset(seed=[None, 2, None])
    views, others = env.reset()[0], other.reset(seed=(None, None, None))[0]
    assert views[2:4].tolist() == others[2:4].tolist()
    assert views[:2].tolist() != others[:2].tolist()
    assert views.tolist() != env.reset()[0].tolist()


def test_worlds_that_were_never_seeded_differ() -> None:
    env, other = (vector_env(20, "prey", "random", size=100) for _ in range(2))
    views = env.reset()[0].reshape(20, -1)
    assert len({tuple(view) for view in views.tolist()}) == 20
    assert views.tolist() != other.reset()[0].reshape(20, -1).tolist()


# -- starts and masks ---------------------------------------------------------------------------------------------


STARTS = [[[0, 0], [4, 3], [2, 1]], [[0, 0], [1, 1], [5, 5]]]


def test_given_starts_are_where_the_worlds_start() -> None:
    env = vector_env(2, "prey", "greedy_chase", n_predators=2, n_prey=1, size=20)
    for starts in (STARTS, np.array(STARTS, np.uint8)):
        views, _ = env.reset(options={"starts": starts})
        assert views.tolist() == [[-2, -1, 2, 2], [-5, -5, -4, -4]]


def test_a_mask_starts_the_worlds_whose_rows_it_marks() -> None:
    env = vector_env(3, "predators", "random", AutoresetMode.DISABLED, **SMALL | {"size": 30})
    env.reset(seed=0)
    walk(env, 4)
    before = env._look()
    options = {"reset_mask": np.array([False, False, True, True, False, False])}
    views, infos = env.reset(seed=5, options=options)
    assert options.keys() == {"reset_mask"}  # a wrapper may need it yet
    assert views[[0, 1, 4, 5]].tolist() == before[[0, 1, 4, 5]].tolist()
    assert views[2:4].tolist() == cells_seen(env.config, "predators", 6)
    assert infos["steps"].tolist() == [4, 4, 0, 0, 4, 4]
    *_, infos = walk(env, 1)[0]
    assert infos["steps"].tolist() == [5, 5, 1, 1, 5, 5]


def test_a_mask_goes_with_starts_and_seeds() -> None:
    env = vector_env(2, "prey", "random", AutoresetMode.DISABLED, n_predators=2, n_prey=1, size=20)
    views, _ = env.reset(seed=0)
    masked, _ = env.reset(seed=[4, None], options={"reset_mask": np.array([True, False]), "starts": STARTS})
    assert masked.tolist() == [[-2, -1, 2, 2], views[1].tolist()]


def test_a_mask_that_marks_nobody_changes_nothing() -> None:
    env, twin = (vector_env(2, "prey", "random", AutoresetMode.DISABLED, **SMALL) for _ in range(2))
    for each in (env, twin):
        each.reset(seed=0)
        walk(each, 3)
    env.reset(seed=9, options={"reset_mask": np.zeros(4, bool)})
    assert plain(walk(env, 5)) == plain(walk(twin, 5))


# -- copies -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("script", ["random", "intercept"])
def test_a_copy_in_mid_episode_goes_on_like_the_original(script: str, duplicate: Callable[[Any], Any]) -> None:
    env = vector_env(18, "prey", script, AutoresetMode.SAME_STEP, **SMALL)
    env.reset(seed=0)
    walk(env, 7)
    twin = duplicate(env)
    assert plain(walk(env, 30)) == plain(walk(twin, 30))


def test_it_can_be_closed_twice() -> None:
    env = vector_env(2, "prey", "random", **SMALL)
    env.reset(seed=0)
    env.close()
    env.close()
