"""A fitness that cannot be compared ends a generation before anything is bred from it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.trainer import Trainer
from esp_trainer.types import TrialResult

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
    before = {role: side.algorithm.genomes.tobytes() for role, side in run.evolving.items()}
    with pytest.raises(ValueError, match=f"^fitness must be finite, {whose}$"):
        run.step(0)
    assert {role: side.algorithm.genomes.tobytes() for role, side in run.evolving.items()} == before
    assert run.done == 0


FITNESS, CAPTURED = "fitness, float of shape (16, 2, n_agents)", "captured, bool of shape (16, 2, n_prey)"


class Wrong:
    """An evaluator whose results are changed."""

    def __init__(self, evaluator: Any, **changes: Any) -> None:
        self.starts, self._evaluator, self._changes = evaluator.starts, evaluator, changes

    def evaluate(self, batch: Any) -> TrialResult:
        result = self._evaluator.evaluate(batch)
        return replace(result, **{name: change(getattr(result, name)) for name, change in self._changes.items()})


@pytest.mark.parametrize(
    ("changes", "got"),
    [
        ({"fitness": lambda a: a[:, :1]}, FITNESS + ", got float64 of shape (16, 1, 5)"),
        (
            {"fitness": lambda a: a[..., :2]},
            FITNESS + ", got float64 of shape (16, 2, 2)",
        ),
        (
            {"fitness": lambda a: a.astype("O")},
            FITNESS + ", got object of shape (16, 2, 5)",
        ),
        (
            {"fitness": lambda a: a.astype("?")},
            FITNESS + ", got bool of shape (16, 2, 5)",
        ),
        ({"fitness": lambda a: 3.0}, FITNESS + ", got float64 of shape ()"),
        (
            {"captured": lambda a: a + np.nan},
            CAPTURED + ", got float64 of shape (16, 2, 2)",
        ),
        ({"captured": lambda a: a[:1]}, CAPTURED + ", got bool of shape (1, 2, 2)"),
    ],
)
def test_results_of_another_shape_or_kind_are_refused(changes: dict[str, Any], got: str, fake_evaluator: Any):
    evaluator = Wrong(fake_evaluator(lambda _, __, starts: np.ones((*starts.shape, 5))), **changes)
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        Coevolution(CONFIG, new_sides(CONFIG), evaluator).step(0)
    assert str(refused.value) == f"the evaluator must return {got}"


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_fitness_whose_sum_overflows_is_refused_with_whose_it_is(kind: type, fake_evaluator: Any):
    largest = np.finfo(np.float64).max if kind is np.float64 else 1e38
    evaluator = Wrong(
        fake_evaluator(lambda _, __, starts: np.ones((*starts.shape, 5))), fitness=lambda a: (largest * a).astype(kind)
    )
    run = Coevolution(CONFIG, new_sides(CONFIG), evaluator)
    if kind is np.float32:  # added up with more digits
        assert run.step(0).trials["prey"].fitness.max() == pytest.approx(1e38)
        return
    with pytest.raises(ValueError, match=r"for agent 0 of the predators in trial 0, episode 0$"):
        run.step(0)


def test_a_run_whose_fitness_is_nan_leaves_no_generation(tmp_path: Any, fake_evaluator: Any):
    config = preset("smoke").replace(generations=2, esp=CONFIG.esp, champion=CONFIG.champion)
    evaluators = iter([fake_evaluator(spoiled("held out", (0, 0, 0), np.nan), n_prey=config.env.n_prey)])
    trainer = Trainer.start(RunDirectory(tmp_path), config, lambda _: next(evaluators))
    with pytest.raises(ValueError, match="fitness must be finite, got nan for agent 0 of the predators"):
        list(trainer.generations())
    assert (tmp_path / "metrics.jsonl").read_bytes() == b""
    assert list((tmp_path / "champions").iterdir()) == []
