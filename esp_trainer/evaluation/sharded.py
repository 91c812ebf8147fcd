"""Evaluator for several machines: workers of a Ray cluster play a batch in shards."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from esp_trainer import cluster
from esp_trainer.arrays import EpisodeStarts, Indices
from esp_trainer.evaluation.fused import FusedEvaluator, blocks
from esp_trainer.networks.controller import Controller
from esp_trainer.types import TeamBatch, TrialBatch, TrialResult
from predprey_env.config import EnvConfig

LEAST_EPISODES = 500
"""Smallest number of episodes in a shard: playing them takes about as long as sending them (docs/scaling.md)."""


class ShardedEvaluator:
    """Plays batches on the Ray cluster that the process is connected to (:func:`esp_trainer.cluster.connected`).

    The results are those of :class:`~esp_trainer.evaluation.fused.FusedEvaluator`, byte for byte, for any number of
    shards and workers, even if workers die. A batch that would not fill two shards is played on this machine.

    Args:
        env: The world.
        shards: Number of shards in a batch; by default one for each core of the cluster, counted again for each batch.
        least_episodes: Smallest number of episodes in a shard.
        threads: Number of threads for batches that are played on this machine.
    """

    def __init__(
        self,
        env: EnvConfig,
        shards: int | None = None,
        least_episodes: int = LEAST_EPISODES,
        threads: int | None = None,
    ) -> None:
        self.env = env
        self.shards = shards
        self.least_episodes = least_episodes
        self._here = FusedEvaluator(env, threads)
        self.starts = self._here.starts

    def compile(self, predators: Controller | None = None, prey: Controller | None = None) -> None:
        """Load or compile the kernel on this machine. Any other node does so with its first shard."""
        self._here.compile(predators, prey)

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        """Play every episode of every trial."""
        n_trials, n_episodes = batch.starts.shape[:2]
        shards = min(n_trials * n_episodes // self.least_episodes, self.shards or cluster.cluster_cores())
        if shards < 2:
            return self._here.evaluate(batch)
        common = cluster.share_value((self.env, *_without_trials(batch)))
        parts = [batch.part(trials) for trials in blocks(n_trials, shards)]
        shares = [(part.predators.indices, part.prey.indices, part.starts) for part in parts]
        results = cluster.gather([cluster.submit(_play, common, *share) for share in shares])
        return TrialResult(
            np.concatenate([result.fitness for result in results]),
            np.concatenate([result.captured for result in results]),
            np.concatenate([result.steps for result in results]),
        )


def _play(
    common: tuple[EnvConfig, TeamBatch, TeamBatch],
    predators: Indices | None,
    prey: Indices | None,
    starts: EpisodeStarts,
) -> TrialResult:
    """Play a shard, on a worker."""
    env, hunters, hunted = common
    batch = TrialBatch(hunters.with_indices(predators), hunted.with_indices(prey), starts)
    return _evaluator(env).evaluate(batch)


@lru_cache(maxsize=4)
def _evaluator(env: EnvConfig) -> FusedEvaluator:
    return FusedEvaluator(env, threads=1)


def _without_trials(batch: TrialBatch) -> tuple[TeamBatch, TeamBatch]:
    """Return the part of both sides' teams that all shards share: the candidates."""
    return batch.predators.part(slice(0)), batch.prey.part(slice(0))
