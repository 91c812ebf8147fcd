"""Stable-Baselines3: PPO trains, saves and plays, with prey caught on the way."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import supersuit as ss
import torch
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from predprey_env import predprey_v0, team_view, vector_env
from predprey_env.sb3 import SB3VecEnv

pytestmark = pytest.mark.ecosystem

SMALL = {"size": 6, "max_cycles": 30, "reward": "dense"}  # random predators catch prey within an episode


def through_supersuit(mode: str, seed: int) -> VecEnv:
    """Two copies for one policy that plays all agents."""
    env = ss.pad_action_space_v0(ss.pad_observations_v0(predprey_v0.parallel_env(**SMALL, captured_prey=mode)))
    env = ss.agent_indicator_v0(env, type_only=True)
    env = ss.black_death_v3(env) if mode == "removed" else env
    env = ss.concat_vec_envs_v1(ss.pettingzoo_env_to_vec_env_v1(env), 2, base_class="stable_baselines3")
    env.venv.reset(seed=seed)  # SuperSuit's wrapper for SB3 cannot seed, so PPO's own argument fails
    return env


def through_the_vector_env(seed: int) -> VecEnv:
    """Two worlds for one policy that plays the predators, against random prey."""
    env = SB3VecEnv(vector_env(2, "predators", "random", "SameStep", **SMALL))
    env.seed(seed)
    return env


# From a seed to two copies of the world.
WAYS: dict[str, Callable[[int], VecEnv]] = {
    "supersuit": partial(through_supersuit, "inert"),
    "supersuit, removed": partial(through_supersuit, "removed"),
    "vector_env": through_the_vector_env,
}

ways = pytest.mark.parametrize("way", WAYS)


class Count(BaseCallback):
    """Counts over a training: the rows whose infos tell of caught prey, and the ends of episodes."""

    captured = ended = 0

    def _on_step(self) -> bool:
        self.captured += sum(info.get("n_captured", 0) > 0 for info in self.locals["infos"])
        self.ended += self.locals["dones"].sum()
        return True


def trained(env: VecEnv) -> tuple[PPO, Count, dict[str, torch.Tensor]]:
    """A model after one iteration, what happened in it, and the parameters before."""
    set_random_seed(0)
    model, count = PPO("MlpPolicy", env, n_steps=64, batch_size=64, n_epochs=2), Count()
    before = {name: values.clone() for name, values in model.policy.state_dict().items()}
    model.learn(64 * env.num_envs, callback=count)
    return model, count, before


@ways
def test_ppo_trains_one_iteration(way: str) -> None:
    env = WAYS[way](0)
    model, count, before = trained(env)
    assert model.num_timesteps == 64 * env.num_envs
    assert count.captured > 0
    assert count.ended >= 2 * env.num_envs
    after = model.policy.state_dict()
    assert all(torch.isfinite(values).all() for values in after.values())
    assert not any(torch.equal(values, before[name]) for name, values in after.items() if name.endswith("weight"))


@pytest.mark.parametrize("mode", ["inert", "removed"])
def test_supersuit_passes_on_what_the_world_pays(mode: str) -> None:
    """The reward of a step is the change in fitness between its infos; those of an end give way to the next start's."""
    env = through_supersuit(mode, 0)
    env.action_space.seed(0)
    env.reset()
    fitness = np.array([info["fitness"] for info in env.reset_infos])
    paid = 0
    for _ in range(200):
        _, rewards, dones, infos = env.step(np.array([env.action_space.sample() for _ in range(env.num_envs)]))
        for i, info in enumerate(infos):
            if "fitness" in info and not dones[i]:
                assert rewards[i] == pytest.approx(info["fitness"] - fitness[i], abs=1e-5)
                paid += rewards[i] != 0
        fitness = np.array([info.get("fitness", 0) for info in infos])
    assert paid > 200


@ways
def test_the_same_seed_trains_the_same_policy(way: str) -> None:
    one, again, other = (trained(WAYS[way](seed))[0].policy.state_dict() for seed in (3, 3, 4))
    assert all(torch.equal(values, again[name]) for name, values in one.items())
    assert not all(torch.equal(values, other[name]) for name, values in one.items())


@ways
def test_a_saved_policy_plays_on(way: str, tmp_path: Path) -> None:
    env = WAYS[way](0)
    model, *_ = trained(env)
    model.save(tmp_path / "model")
    loaded = PPO.load(tmp_path / "model")
    captured, observations = 0, env.reset()
    for _ in range(100):
        actions, _ = loaded.predict(observations, deterministic=True)
        np.testing.assert_array_equal(actions, model.predict(observations, deterministic=True)[0])
        observations, _, _, infos = env.step(loaded.predict(observations)[0])
        captured += sum(info.get("n_captured", 0) > 0 for info in infos)
    assert captured > 0


def test_the_adapter_tells_where_an_episode_was_cut_off() -> None:
    """PPO takes the value of the terminal observation for what was cut off, and nothing for what ended."""
    config = {**SMALL, "size": 4, "max_cycles": 5}
    adapter, plain = (vector_env(4, "prey", "surround", "SameStep", **config) for _ in range(2))
    env, ends, drawn = SB3VecEnv(adapter), {"terminated": 0, "truncated": 0}, np.random.default_rng(0)
    env.seed(3)
    assert env.reset().tolist() == plain.reset(seed=3)[0].tolist()
    for _ in range(100):
        actions = drawn.integers(0, 4, env.num_envs)
        views, rewards, dones, infos = env.step(actions)
        seen, paid, terminated, truncated, told = plain.step(actions)
        assert views.tolist() == seen.tolist()
        assert rewards == pytest.approx(paid)
        assert dones.tolist() == (terminated | truncated).tolist()
        for row in np.flatnonzero(dones):
            assert infos[row]["terminal_observation"].tolist() == told["final_obs"][row].tolist()
            assert infos[row]["TimeLimit.truncated"] == truncated[row]
        assert not any(infos[row] for row in np.flatnonzero(~dones))
        ends["terminated"] += int(terminated.sum())
        ends["truncated"] += int(truncated.sum())
    assert min(ends.values()) > 10


def test_the_adapter_asks_for_worlds_that_start_again_at_once() -> None:
    worlds = vector_env(8, "predators", "random", **SMALL)
    env = SB3VecEnv(worlds)
    assert worlds.autoreset_mode is AutoresetMode.SAME_STEP
    env.seed(1)
    env.reset()
    ended = np.zeros(env.num_envs, bool)
    for _ in range(30):
        _, _, dones, infos = env.step(np.zeros(env.num_envs, int))
        ended |= dones
        assert all(("terminal_observation" in info) == done for info, done in zip(infos, dones, strict=True))
    assert ended.all()


def test_the_adapter_refuses_worlds_that_have_started_in_another_mode() -> None:
    worlds = vector_env(2, "prey", "surround")
    worlds.reset(seed=1)
    line = r"^autoreset_mode cannot change after the first reset\(\): make the environment with 'SameStep'$"
    with pytest.raises(ValueError, match=line):
        SB3VecEnv(worlds)
    SB3VecEnv(vector_env(2, "prey", "surround", "SAME_STEP"))


@pytest.mark.parametrize(
    "make",
    [
        lambda: team_view("prey", "surround"),
        predprey_v0.parallel_env,
        lambda: SB3VecEnv(vector_env(1, "prey", "surround")),
    ],
)
def test_the_adapter_takes_no_other_environment(make: Any) -> None:
    env = make()
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        SB3VecEnv(env)
    assert str(refused.value) == (f"env must be a vector environment: call vector_env(...), got {type(env).__name__}")


OTHER_MODE = r"^make the environment with 'SameStep', as Stable-Baselines3 expects it, got 'NextStep'$"


def test_worlds_in_a_wrapper_are_made_with_the_mode_that_it_reads() -> None:
    with pytest.raises(ValueError, match=OTHER_MODE):
        SB3VecEnv(RecordEpisodeStatistics(vector_env(2, "predators", "random", **SMALL)))
    env = SB3VecEnv(RecordEpisodeStatistics(vector_env(2, "predators", "random", "SameStep", **SMALL)))
    env.reset()
    dones = [env.step(np.zeros(6, int))[2].any() for _ in range(40)]
    assert any(dones)
    assert len(env.env.return_queue) > 0
    with pytest.raises(AttributeError, match=r"^opponent is read-only"):
        env.set_attr("opponent", "flee_nearest")
    env.set_opponent("flee_nearest")
    assert env.opponent.script == env.get_attr("opponent")[0].script == "flee_nearest"


@pytest.mark.parametrize("way", ["set_attr", "attribute"])
def test_a_mode_that_is_set_after_wrapping_is_refused_at_the_reset(way: str) -> None:
    worlds = vector_env(2, "predators", "random", **SMALL)
    env = SB3VecEnv(worlds)
    if way == "set_attr":
        env.set_attr("autoreset_mode", "NextStep")
    else:
        worlds.autoreset_mode = AutoresetMode.NEXT_STEP
    with pytest.raises(ValueError, match=OTHER_MODE):
        env.reset()


def adapter() -> SB3VecEnv:
    """Two worlds of five agents, and random prey."""
    return SB3VecEnv(vector_env(2, "predators", "random", **SMALL))


# Where each agent of each world starts; the first predator then sees the prey at (2, 1) and (-1, 2).
STARTS = np.array([[[0, 0], [0, 0], [0, 0], [2, 1], [5, 2]]] * 2)
SEEN = [2, 1, -1, 2]


@pytest.mark.parametrize("given", ["dict", "list", "lists"])
def test_options_are_used_once(given: str) -> None:
    env, twin = adapter(), adapter()
    starts = STARTS.copy()
    options: Any = {"starts": starts}
    if given != "dict":
        options = [{"starts": STARTS.tolist() if given == "lists" else starts} for _ in range(env.num_envs)]
    env.seed(1)
    env.set_options(options)
    starts[:] = 0  # what was given is kept
    assert env.reset()[[0, 3]].tolist() == [SEEN, SEEN]
    twin.seed(1)
    twin.set_options({"starts": STARTS})
    twin.reset()
    observations = env.reset()
    assert observations.tolist() == twin.reset().tolist()
    assert observations[0].tolist() != SEEN
    env.set_options({"starts": STARTS})
    env.set_options()
    assert env.reset()[0].tolist() != SEEN


def test_options_go_through_wrappers() -> None:
    env = VecMonitor(adapter())
    env.set_options({"starts": STARTS})
    assert env.reset()[0].tolist() == SEEN


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"start": STARTS}, r"^unknown reset option start; did you mean starts\?$"),
        ({"wind": 3}, r"^unknown reset option wind; there are starts and reset_mask$"),
        ([{"wind": 3}] * 6, r"^unknown reset option wind; there are starts and reset_mask$"),
        ([{"starts": STARTS}] * 5, r"^options must be a dict or one for each of 6 rows, got 5$"),
        ([], r"^options must be a dict or one for each of 6 rows, got 0$"),
        (
            [{"starts": STARTS}] * 5 + [{"starts": STARTS + 1}],
            r"^options must be equal for all 6 rows, which share one environment$",
        ),
        ([{"starts": STARTS}] * 5 + [{}], r"^options must be equal for all 6 rows, which share one environment$"),
        ([[1], [2]] * 3, r"^options must be a mapping from names to values, got \[1\]$"),
        (3, r"^options must be a mapping from names to values, got 3$"),
        ({"starts": STARTS + 9}, r"^starts must lie in \[0, 6\), got 9 to 14$"),
        ({"starts": 3}, r"^starts must be integers of shape \(2, 5, 2\), got int64 of shape \(\)$"),
        ({"reset_mask": [1] * 6}, r"^reset_mask must be bool of shape \(6,\), got int64 of shape \(6,\)$"),
    ],
)
def test_unequal_and_unknown_options_are_refused(options: Any, line: str) -> None:
    env, twin = adapter(), adapter()
    env.set_options({"starts": STARTS})
    with pytest.raises(ValueError, match=line):
        env.set_options(options)
    twin.set_options({"starts": STARTS})
    assert env.reset()[0].tolist() == twin.reset()[0].tolist() == SEEN


def test_the_opponent_is_changed_by_its_method_alone() -> None:
    env = VecMonitor(adapter())
    env.set_options({"starts": STARTS})
    env.reset()
    (before, *_) = env.get_attr("opponent")
    with pytest.raises(AttributeError, match=r"^opponent is read-only; call set_opponent\(opponent\)$"):
        env.set_attr("opponent", "flee_nearest")
    with pytest.raises(AttributeError, match=r"^opponent is read-only; call set_opponent\(opponent\)$"):
        env.venv.opponent = "flee_nearest"
    assert env.get_attr("opponent") == [before] * 6
    env.env_method("set_opponent", lambda views: dict.fromkeys(views, 2))
    seen = [env.step(np.full(6, 4))[0][0].tolist() for _ in range(2)]
    assert seen == [[2, 2, -1, -3], [2, -3, -1, -2]]  # both go north
    with pytest.raises(ValueError, match=r"^script must be one of "):
        env.env_method("set_opponent", "surround")


@pytest.mark.parametrize("name", ["team", "config", "n_worlds", "num_envs", "size", "metadata", "observation_space"])
def test_what_the_worlds_were_made_with_is_read_only(name: str) -> None:
    env = adapter()
    before = env.get_attr(name)
    with pytest.raises(AttributeError, match=f"^{name} is read-only; make another environment"):
        env.set_attr(name, 3)
    assert env.get_attr(name) == before


def test_the_rows_of_the_adapter_share_one_environment() -> None:
    env = SB3VecEnv(vector_env(2, "predators", "random", autoreset_mode="SameStep", **SMALL))
    assert env.get_attr("n_worlds", indices=[0, 4]) == [2, 2]
    assert env.has_attr("n_worlds")
    assert not env.has_attr("wolves")
    env.set_attr("note", "kept")
    assert env.env.note == "kept"
    assert env.env_method("close") == [None] * env.num_envs
    for call in (lambda: env.set_attr("note", "lost", indices=[0]), lambda: env.env_method("close", indices=[0])):
        with pytest.raises(ValueError, match=r"^indices must be all 6 rows, which share one environment, got \[0\]$"):
            call()
    assert env.env.note == "kept"


def test_the_readmes_snippet_trains(snippet: dict[str, Any]) -> None:
    env, model = snippet["env"], snippet["model"]
    assert env.num_envs == 64 * 3  # predators
    assert env.observation_space.shape == (4,)
    assert model.num_timesteps >= 20_000
    captured, observations = 0, env.reset()
    for _ in range(300):
        observations, _, _, infos = env.step(model.predict(observations)[0])
        captured += sum(info.get("n_captured", 0) > 0 for info in infos)
    assert captured > 0


def test_images_are_those_of_the_first_worlds_and_infos_name_the_opponent() -> None:
    worlds = vector_env(
        3, "predators", ["flee_nearest", "random"], n_prey=1, size=9, max_cycles=4, render_mode="rgb_array"
    )
    env = SB3VecEnv(worlds, pictured_worlds=2)
    env.reset()
    first, second = env.get_images()
    assert (second == worlds.render()[3]).all()
    assert (first != second).any()
    assert env.render("rgb_array").shape[2] == 3
    met = set()
    for _ in range(60):
        _, _, done, infos = env.step(np.full(env.num_envs, 4))
        met |= {infos[row]["opponent"] for row in np.flatnonzero(done)}
    assert met == {0, 1}
    with pytest.raises(ValueError, match=r"^pictured_worlds must be an integer of at least 1, got 0$"):
        SB3VecEnv(worlds, pictured_worlds=0)
