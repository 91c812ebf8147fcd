"""RLlib: PPO on the new API stack, a module for each team, with RLlib's own wrapper and nothing else.

Both modes of captured prey work: an agent that has left is no longer asked for actions, and its episode has ended.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ray
import torch

from esp_trainer.benchmark.batched import BatchedPolicy
from esp_trainer.benchmark.match import Arena
from esp_trainer.benchmark.specs import load_candidate
from esp_trainer.tasks import WORLDS
from esp_trainer.types import ScriptedTeams

pytestmark = pytest.mark.ecosystem

TEAMS = ("predator", "prey")


@pytest.fixture(scope="module", autouse=True)
def local_ray(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Ray with one CPU, which leaves nothing at home, reports to nobody, and goes with its processes."""
    home = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(home))
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setattr("ray.tune.trainable.trainable.DEFAULT_STORAGE_PATH", str(home))
        ray.init(num_cpus=1, include_dashboard=False)
        yield
        ray.shutdown()


def weights(algorithm: Any) -> dict[str, list[np.ndarray]]:
    """A copy of each team's weights, from the learner."""
    modules = algorithm.learner_group.get_weights()
    return {team: [np.array(array) for array in modules[team].values()] for team in TEAMS}


def test_the_snippet_trains_one_module_for_each_team(snippet: dict[str, Any]) -> None:
    result = snippet["result"]
    assert set(result["learners"]) == {"__all_modules__", *TEAMS}
    assert result["env_runners"]["num_episodes"] > 0
    assert result["env_runners"]["num_module_steps_sampled"] == {"predator": 3000, "prey": 2000}


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_both_teams_learn_from_episodes_with_captures(snippet: dict[str, Any], captured_prey: str) -> None:
    config = snippet["config"].copy(copy_frozen=False)
    config.environment(env_config=config.env_config | {"captured_prey": captured_prey})
    config.callbacks(
        on_episode_end=lambda episode, metrics_logger, **_: metrics_logger.log_value(
            "captures", episode.get_infos(-1)["predator_0"]["n_captured"], reduce="sum"
        )
    )
    algorithm = config.build_algo()
    before = weights(algorithm)
    played = algorithm.train()["env_runners"]
    after = weights(algorithm)
    algorithm.stop()

    assert played["captures"] > 0
    steps = played["num_agent_steps_sampled"]
    assert (steps["prey_0"] < steps["predator_0"]) == (captured_prey == "removed")
    for team in TEAMS:
        assert any((old != new).any() for old, new in zip(before[team], after[team], strict=True))
        assert all(np.isfinite(new).all() for new in after[team])


def test_a_trained_module_is_a_candidate_of_the_benchmark(
    snippet: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As docs/tutorial.md shows it: a checkpoint of the snippet's algorithm, and its class."""
    algorithm = snippet["algorithm"]
    algorithm.save_to_path(str(tmp_path / "checkpoint"))
    text = (Path(__file__).parents[2] / "docs" / "tutorial.md").read_text()
    program = re.search(r"<!-- tutorial: my_rllib\.py -->\n```python\n(.*?)```", text, re.DOTALL)
    assert program is not None
    (tmp_path / "my_rllib.py").write_text(program[1])
    monkeypatch.chdir(tmp_path)
    policy = load_candidate("my_rllib:Predators", "predators", WORLDS["3v2"]).player
    assert isinstance(policy, BatchedPolicy)
    seen = np.random.default_rng(0).integers(-50, 50, (30, 3, 4)).astype(np.float32)
    module = algorithm.get_module("predator")
    with torch.no_grad():
        told = module.forward_inference({"obs": torch.from_numpy(seen.reshape(-1, 4))})
    assert policy.act_batch(seen).ravel().tolist() == told["action_dist_inputs"].argmax(-1).tolist()
    met = Arena(WORLDS["3v2"], 8, 0).meet(policy, "predators", ScriptedTeams("random"))
    assert (met.steps > 0).all()
