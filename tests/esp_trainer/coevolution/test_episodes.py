"""A fitness that cannot be compared ends a generation before anything is bred from it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer

CONFIG = RunConfig(
    generations=2,
    esp=EspConfig(subpopulation_size=8, n_trials=16, n_episodes=2, hof_mates=2),
    champion=ChampionConfig(n_candidates=2, n_held_out=8),
)
BATCHES = {"trials": (16, 2), "candidates": (4, 1), "held out": (8, 1)}


def spoiled(batch: str, place: tuple[int, int, int], value: float) -> Any:
    """Scores of 1, but for one agent in one episode of batches of that shape."""

    def score(_predators: Any, _prey: Any, starts: np.ndarray) -> np.ndarray:
        fitness = np.ones((*starts.shape, 5))
        if starts.shape == BATCHES[batch]:
            fitness[place] = value
        return fitness

    return score


@pytest.mark.parametrize("batch", BATCHES)
@pytest.mark.parametrize(
    ("place", "value", "whose"),
    [
        ((3, 0, 1), np.nan, "got nan for agent 1 of the predators in trial 3, episode 0"),
        ((0, 0, 4), np.inf, "got inf for agent 1 of the prey in trial 0, episode 0"),
        ((2, 0, 3), -np.inf, "got -inf for agent 0 of the prey in trial 2, episode 0"),
    ],
)
def test_a_fitness_that_is_not_finite_is_refused_with_whose_it_is(
    batch: str, place: tuple[int, int, int], value: float, whose: str, fake_evaluator: Any
):
    run = Coevolution(CONFIG, new_sides(CONFIG), fake_evaluator(spoiled(batch, place, value)))
    before = {role: side.subpopulations.genomes.tobytes() for role, side in run.evolving.items()}
    with pytest.raises(ValueError, match=f"^fitness must be finite, {whose}$"):
        run.step(0)
    assert {role: side.subpopulations.genomes.tobytes() for role, side in run.evolving.items()} == before
    assert run.done == 0


def test_a_fitness_of_another_shape_is_refused(fake_evaluator: Any):
    run = Coevolution(CONFIG, new_sides(CONFIG), fake_evaluator(lambda *_: np.ones((16, 1, 5))))
    with pytest.raises(
        ValueError, match=r"must return the fitness of 16 trials of 2 episodes, got shape \(16, 1, 5\)$"
    ):
        run.step(0)


def test_a_run_whose_fitness_is_nan_leaves_no_generation(tmp_path: Any, fake_evaluator: Any):
    config = preset("smoke").replace(generations=2, esp=CONFIG.esp, champion=CONFIG.champion)
    evaluators = iter([fake_evaluator(spoiled("held out", (0, 0, 0), np.nan), n_prey=config.env.n_prey)])
    trainer = Trainer.start(RunDirectory(tmp_path), config, lambda _: next(evaluators))
    with pytest.raises(ValueError, match="fitness must be finite, got nan for agent 0 of the predators"):
        list(trainer.generations())
    assert (tmp_path / "metrics.jsonl").read_bytes() == b""
    assert list((tmp_path / "champions").iterdir()) == []
