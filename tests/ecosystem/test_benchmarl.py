"""BenchMARL: MAPPO on TorchRL's PettingZoo wrapper, a group for each team.

Both modes of captured prey work. BenchMARL's losses read no mask: a prey that left stays in the batch as rows that are
done and all zeros.
"""

from __future__ import annotations

from typing import Any

import pytest
import torch
from benchmarl.experiment import Callback, Experiment
from tensordict import TensorDictBase

pytestmark = [pytest.mark.ecosystem, pytest.mark.usefixtures("place")]  # it writes where it is started

TEAMS = {"predator", "prey"}


class Watch(Callback):
    """Keeps what was played."""

    def on_batch_collected(self, batch: TensorDictBase) -> None:
        self.played = batch["next"]


def weights(experiment: Experiment) -> dict[str, torch.Tensor]:
    """A copy of each team's weights, actor's and critic's, in a row."""
    return {
        team: torch.nn.utils.parameters_to_vector(loss.parameters()).detach().clone()
        for team, loss in experiment.losses.items()
    }


def test_the_snippet_trains_one_policy_for_each_team(snippet: dict[str, Any]) -> None:
    experiment = snippet["experiment"]
    assert set(experiment.group_policies) == TEAMS
    assert experiment.n_iters_performed == 1
    assert experiment.total_frames == 1000


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_both_teams_learn_from_episodes_with_captures(snippet: dict[str, Any], captured_prey: str) -> None:
    of_snippet, watch = snippet["experiment"], Watch()
    task = snippet["PredPrey"]("predprey", of_snippet.task.config | {"captured_prey": captured_prey})
    configs = of_snippet.algorithm_config, of_snippet.model_config
    experiment = Experiment(task, *configs, seed=0, config=of_snippet.config, callbacks=[watch])
    before = weights(experiment)
    experiment.run()
    after = weights(experiment)

    played = watch.played
    assert played["done"].any()
    assert (played["predator", "info", "n_captured"] > 0).any()
    left = ~played["prey", "mask"] & ~played["done"]
    assert left.any() == (captured_prey == "removed")
    for team in TEAMS:
        assert (before[team] != after[team]).any()
        assert after[team].isfinite().all()
