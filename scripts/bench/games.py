"""MPE's simple_tag by every evaluator."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bench.page import Row
from bench.timing import side_by_side
from esp_trainer.coevolution.sides import EvolvingSide, new_sides
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.other_game import GameEvaluator
from esp_trainer.evaluation.reference import ReferenceEvaluator
from esp_trainer.evaluation.starts import SeedStarts
from esp_trainer.game import make_environment
from esp_trainer.presets import preset
from esp_trainer.types import Evaluator, EvolvedTeams, TrialBatch

IN_ARRAYS = preset("game")
CONFIG = IN_ARRAYS.with_fields({"game.environment": "mpe2.simple_tag_v3"})


class GameScale(NamedTuple):
    """Numbers of episodes to play."""

    trials: int
    """Trials, of one episode each, that are played a step at a time."""
    many: int
    """Trials that are played side by side."""
    repetitions: int


FULL, QUICK = GameScale(24, 960, 3), GameScale(2, 4, 1)


def rows(scale: GameScale) -> list[Row]:
    """Return the time of an episode by every evaluator."""
    few, many = _batch(CONFIG, scale.trials), _batch(IN_ARRAYS, scale.many)
    reference = ReferenceEvaluator(
        lambda: make_environment(CONFIG.game), SeedStarts(1), (CONFIG.game.predators, CONFIG.game.prey)
    )
    one, two, fast = (GameEvaluator(game, n) for game, n in ((CONFIG.game, 1), (CONFIG.game, 2), (IN_ARRAYS.game, 1)))
    expected = reference.evaluate(few).fitness
    for evaluator in (one, two, fast):
        np.testing.assert_array_equal(evaluator.evaluate(few).fitness, expected)
    contenders: dict[str, Callable[[], object]] = {
        "`ReferenceEvaluator`": _playing(reference, few),
        "the environment alone, random actions": lambda: _alone(few.starts),
        "`GameEvaluator`, one process": _playing(one, few),
        "`GameEvaluator`, two processes": _playing(two, few),
        "`GameEvaluator`, `many()` in one process": _playing(fast, many),
    }
    taken = side_by_side(contenders, scale.repetitions)
    base, found = taken["`ReferenceEvaluator`"], []
    for name, seconds in taken.items():
        several = name == "`GameEvaluator`, two processes"
        played = scale.many if "many()" in name else scale.trials
        each, of_base = (seconds.wall, base.wall) if several else (seconds.cpu, base.cpu)
        times = of_base / scale.trials / (each / played)
        figure = f"{1000 * each / played:.3g} {'wall' if several else 'CPU'}-ms"
        found.append(Row(name, figure, f"{times:.3g} times as fast" if seconds is not base else ""))
    return found


def _batch(config: RunConfig, n_trials: int) -> TrialBatch:
    generator = np.random.default_rng(0)
    sides = new_sides(config.replace(esp=config.esp.replace(n_trials=n_trials, block_size=1)))
    asked = [side.algorithm.ask(generator) for side in sides.values() if isinstance(side, EvolvingSide)]
    predators, prey = asked
    assert isinstance(predators, EvolvedTeams)
    return TrialBatch(predators, prey, SeedStarts(1).draw(generator, n_trials, 1))


def _playing(evaluator: Evaluator, batch: TrialBatch) -> Callable[[], object]:
    return lambda: evaluator.evaluate(batch)


def _alone(starts: np.ndarray) -> None:
    env, generator = make_environment(CONFIG.game), np.random.default_rng(0)
    for seed in starts.ravel().tolist():
        env.reset(seed=seed)
        while env.agents:
            env.step(dict(zip(env.agents, generator.integers(0, 5, len(env.agents)).tolist(), strict=True)))
