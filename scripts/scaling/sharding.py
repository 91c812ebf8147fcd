"""A generation's trials on a Ray cluster of this machine: wall seconds, and what the driver has to do for it."""

from __future__ import annotations

import pickle
import statistics
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from esp_trainer import cluster
from esp_trainer.coevolution.sides import EvolvingSide, new_sides
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.sharded import ShardedEvaluator
from esp_trainer.presets import preset
from esp_trainer.seeding import stream
from esp_trainer.types import ROLES, Role, TeamBatch, TrialBatch

SHARDS = (2, 8, 32)
_TIMES = 7
PAPER = preset("paper-3v2")


class Shared(NamedTuple):
    """A batch in shards."""

    n_trials: int
    shards: int
    here: float
    """Wall seconds in one process with a thread for each core."""
    cpu: float
    """CPU seconds there."""
    wall: float
    """On as many workers as there are cores."""
    driver: float
    """CPU seconds of the driver."""


class Measured(NamedTuple):
    """All batches, and what goes over the wire."""

    batches: list[Shared]
    workers: int
    round_trip: float
    """Wall seconds of an empty task."""
    sent: float
    """Bytes a trial, to a worker."""
    returned: float
    """Bytes a trial, from it."""
    common: int
    """Bytes a batch, to each node: the candidates."""


def measure(scales: Sequence[int]) -> Measured:
    """The trials of a first generation of ``paper-3v2``, times each scale."""
    here = FusedEvaluator(PAPER.env)
    here.compile()
    with cluster.connected("local"):
        found = []
        for scale in scales:
            batch = _batch(1000 * scale)
            expected = here.evaluate(batch)
            alone = _seconds(lambda batch=batch: here.evaluate(batch))  # type: ignore[misc]
            for shards in SHARDS:
                evaluator = ShardedEvaluator(PAPER.env, shards, least_episodes=1)
                if not np.array_equal(evaluator.evaluate(batch).fitness, expected.fitness):
                    raise AssertionError("shards gave other results")
                wall, driver = _seconds(lambda batch=batch, e=evaluator: e.evaluate(batch))  # type: ignore[misc]
                found.append(Shared(len(batch.starts), shards, *alone, wall, driver))
        trip = _seconds(lambda: cluster.gather([cluster.submit(abs, -1)]))[0]
        workers = cluster.cores()
    sent, returned, common = _bytes(1000)
    return Measured(found, workers, trip, sent, returned, common)


def _batch(n_trials: int) -> TrialBatch:
    generator, sides = stream(0, "scaling"), new_sides(PAPER)
    teams: dict[Role, TeamBatch] = {}
    for role in ROLES:
        side = sides[role]
        assert isinstance(side, EvolvingSide)
        teams[role] = side.subpopulations.draw(generator, n_trials)
    starts = FusedEvaluator(PAPER.env).starts.draw(generator, n_trials, PAPER.esp.n_episodes)
    return TrialBatch(teams["predators"], teams["prey"], starts)


def _seconds(work: object) -> tuple[float, float]:
    """Median wall and CPU seconds of this process; the first time, which wakes everybody, does not count."""
    assert callable(work)
    work()
    taken = []
    for _ in range(_TIMES):
        wall, cpu = time.perf_counter(), time.process_time()
        work()
        taken.append((time.perf_counter() - wall, time.process_time() - cpu))
    return statistics.median(wall for wall, _ in taken), statistics.median(cpu for _, cpu in taken)


def _bytes(n_trials: int) -> tuple[float, float, int]:
    batch = _batch(n_trials)
    result = FusedEvaluator(PAPER.env).evaluate(batch)
    indices = [teams.indices for teams in (batch.predators, batch.prey)]  # type: ignore[union-attr]
    sent = len(pickle.dumps((*indices, batch.starts), protocol=5)) / n_trials
    common = len(pickle.dumps((batch.predators.part(slice(0)), batch.prey.part(slice(0))), protocol=5))
    return sent, len(pickle.dumps(result, protocol=5)) / n_trials, common
