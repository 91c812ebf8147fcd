"""Minari: episodes of the zoo, kept as a data set of a team as one agent; they load again and can be played again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import minari
import numpy as np
import pytest

pytestmark = pytest.mark.ecosystem


@pytest.fixture(scope="module", autouse=True)
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A directory for data sets, in place of the user's own."""
    place = tmp_path_factory.mktemp("minari")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MINARI_DATASETS_PATH", str(place))
        yield place


def test_the_snippet_makes_a_data_set_that_loads_again(snippet: dict[str, Any], place: Path) -> None:
    assert (place / "predprey/pond-v0").is_dir()
    dataset = snippet["dataset"]
    assert dataset.total_episodes == 20
    episodes = list(dataset)
    assert sum(len(episode.actions) for episode in episodes) == dataset.total_steps
    for episode in episodes:
        n_steps = len(episode.actions)
        assert episode.observations.shape == (n_steps + 1, 6)
        assert episode.actions.shape == (n_steps, 3)
        assert bool(episode.terminations[-1]) != bool(episode.truncations[-1])
    assert 0 < sum(bool(episode.terminations[-1]) for episode in episodes) < 20, "some of the prey are caught"


def test_the_episodes_can_be_played_again_from_their_seeds(snippet: dict[str, Any]) -> None:
    dataset, env = snippet["dataset"], gymnasium.make("predprey/Pond-Predators-v0", opponent=snippet["prey"])
    told = dataset.storage.get_episode_metadata(range(3))
    for episode, facts in zip(dataset.iterate_episodes(range(3)), told, strict=True):
        observations, rewards = [env.reset(seed=int(facts["seed"]))[0]], []
        for action in episode.actions:
            observation, reward, *_ = env.step(action)
            observations.append(observation)
            rewards.append(reward)
        np.testing.assert_array_equal(observations, episode.observations)
        np.testing.assert_array_equal(rewards, episode.rewards)


def test_the_world_for_evaluation_is_recovered_without_the_zoo(snippet: dict[str, Any]) -> None:
    env = snippet["dataset"].recover_environment(eval_env=True)
    assert env.unwrapped.view.team == "predators"
    assert env.unwrapped.view.env.config.size == 20
    assert env.observation_space == snippet["dataset"].observation_space
    assert env.action_space == snippet["dataset"].action_space


def test_episodes_against_a_script_bring_their_own_world() -> None:
    made = minari.DataCollector(gymnasium.make("predprey_env:predprey/Predators-v0", size=8, n_prey=1))
    made.reset(seed=0)
    over = False
    while not over:
        _, _, terminated, truncated, _ = made.step(made.action_space.sample())
        over = terminated or truncated
    made.create_dataset("predprey/script-v0")
    recovered = minari.load_dataset("predprey/script-v0").recover_environment()
    assert recovered.unwrapped.view.env.config == made.unwrapped.view.env.config
