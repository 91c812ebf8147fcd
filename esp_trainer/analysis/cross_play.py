"""Cross-play between generations: the matrix on which every measure of an arms race is based.

In-loop fitness changes with the opponent, so whether a side became better shows only against the same opponents.
Therefore champions of many generations of one side play those of many generations of the other, from the same held-out
starts in every cell.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import numpy as np

from esp_trainer.analysis.history import History
from esp_trainer.arrays import Counts, EpisodeStarts, Fractions, GenerationIndices, PayoffMatrix, PayoffVariance
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from esp_trainer.seeding import stream
from esp_trainer.types import ROLES, Evaluator, Role, TeamBatch, TrialBatch, TrialResult, n_teams, take
from predprey_env.agents import other_team

CELL_EPISODES = 64
"""Number of episodes per cell. In a multiple of 8, the parities of the starts occur in their true proportions. With 64
episodes the standard error of a cell is at most 0.063, and that of the mean of a row of 46 cells is below 0.01."""

PANEL = 6
"""Number of champions of each other run that a run is measured against."""
_FEW = 128  # trials: enough to keep two cores and all their SIMD lanes busy
_CELLS_AT_ONCE = 4096  # limits memory to about 20 MB of outcomes


@dataclass(frozen=True)
class PayoffPlay:
    """Payoffs of each pairing of a first team (row) with a second team (column) of another game than the predator-prey
    world.
    """

    predators: GenerationIndices
    """Generations of the first team, int ``(G,)``."""
    prey: GenerationIndices
    """Generations of the second team, int ``(H,)``."""
    payoff: PayoffMatrix
    """Mean payoff to the first team, float64 ``(G, H)``: the matrix ``M[g, h]``."""
    variance: PayoffVariance
    """Sampling variance of each mean, float64 ``(G, H)``; nan with one episode per cell."""
    n_episodes: int
    """Number of episodes per cell."""

    total: ClassVar[float] = 0.0
    """Sum of both sides' results: a payoff to the first team is a loss to the second."""

    @property
    def noise(self) -> PayoffVariance:
        """Noise of the payoffs, see :data:`~esp_trainer.analysis.games.Noise`."""
        return self.variance

    def __repr__(self) -> str:
        """Return one line without the arrays."""
        return "<PayoffPlay: {} x {} generations, {} episodes each>".format(*self.payoff.shape, self.n_episodes)


@dataclass(frozen=True)
class CrossPlay:
    """Counts of prey caught in each pairing of a predator team (row) with a prey team (column)."""

    predators: GenerationIndices
    """Generations of the predators, int ``(G,)``."""
    prey: GenerationIndices
    """Generations of the prey, int ``(H,)``."""
    captured: Counts
    """Number of prey caught, int ``(G, H, n_predators + 1)``. The last axis is the number of predators that started at
    an even distance from the prey."""
    met: Counts
    """Number of prey that started with each number of predators at an even distance, int ``(n_predators + 1,)``. It is
    the same in every cell."""
    none_caught: Counts
    """Number of episodes in which no prey was caught, int ``(G, H)``."""
    all_caught: Counts
    """Number of episodes in which all prey were caught, int ``(G, H)``."""
    n_episodes: int
    """Number of episodes per cell."""

    total: ClassVar[float] = 1.0
    """Sum of both sides' results: the fractions of prey caught and not caught."""

    def __repr__(self) -> str:
        """Return one line without the arrays."""
        return "<CrossPlay: {} x {} generations, {} episodes each>".format(*self.caught.shape, self.n_episodes)

    @property
    def caught(self) -> PayoffMatrix:
        """Fraction of prey caught, float64 ``(G, H)``: the matrix ``M[g, h]``."""
        return self.captured.sum(axis=-1) / self.met.sum()

    @property
    def payoff(self) -> PayoffMatrix:
        """Payoff of the predators: the fraction of prey caught, float64 ``(G, H)``."""
        return self.caught

    @property
    def noise(self) -> int:
        """Noise of the payoffs, see :data:`~esp_trainer.analysis.games.Noise`."""
        return self.n_episodes

    @property
    def caught_by_even(self) -> Fractions:
        """Fraction of prey caught by number of predators that started at an even distance, float64
        ``(G, H, n_predators + 1)``; nan where no prey started so.
        """
        with np.errstate(invalid="ignore"):
            return self.captured / self.met


Played: TypeAlias = CrossPlay | PayoffPlay
"""A cross-play in the predator-prey world or in another game: payoffs of all pairings, with their noise."""


def cross_play(
    predators: TeamBatch, prey: TeamBatch, evaluator: Evaluator, *, n_episodes: int = CELL_EPISODES, seed: int = 0
) -> Played:
    """Play every predator team against every prey team.

    Args:
        predators: Predator teams, one for each "trial" of the batch. A script is a single team.
        prey: Prey teams, as for ``predators``.
        evaluator: Evaluator of their world.
        n_episodes: Number of episodes per cell. All cells have the same starts.
        seed: Seed of the starts.
    """
    starts = evaluator.starts.held_out(stream(seed, "cross-play"), n_episodes)[:, 0]
    even = evaluator.starts.even_predators(starts)
    sizes = n_teams(predators), n_teams(prey)
    found: list[tuple[np.ndarray, ...]] = []
    for first in range(0, sizes[0] * sizes[1], _CELLS_AT_ONCE):
        cells = np.arange(first, min(first + _CELLS_AT_ONCE, sizes[0] * sizes[1]))
        rows, columns = np.divmod(cells, sizes[1])
        result = _play(take(predators, rows), take(prey, columns), len(cells), starts, evaluator)
        counts_captures = result.returned is None
        found.append(_captures(result, len(cells), even) if counts_captures else _payoffs(result, len(cells)))
    arrays = [np.concatenate(parts) for parts in zip(*found, strict=True)]
    matrices = [array.reshape(*sizes, *array.shape[1:]) for array in arrays]
    generations = np.arange(sizes[0]), np.arange(sizes[1])
    if not counts_captures:
        payoff, variance = matrices
        return PayoffPlay(*generations, payoff, variance, n_episodes)
    captured, none_caught, all_caught = matrices
    met = np.bincount(even.ravel(), minlength=captured.shape[-1])
    return CrossPlay(*generations, captured, met, none_caught, all_caught, n_episodes)


def _captures(result: TrialResult, n_cells: int, even: Counts) -> tuple[Counts, ...]:
    """Return the number of prey caught by parity, and of episodes in which none and all were caught, of each cell."""
    n_predators = result.fitness.shape[-1] - result.captured.shape[-1]
    caught = result.captured.reshape(n_cells, *even.shape)
    by_even = np.stack([(caught & (even == k)).sum(axis=(1, 2)) for k in range(n_predators + 1)], axis=1)
    return by_even, (~caught.any(axis=2)).sum(axis=1), caught.all(axis=2).sum(axis=1)


def _payoffs(result: TrialResult, n_cells: int) -> tuple[np.ndarray, ...]:
    """Return the mean payoff of each cell, and its sampling variance."""
    payoff = result.payoff.reshape(n_cells, -1)
    n = payoff.shape[1]
    variance = payoff.var(axis=1, ddof=1) / n if n > 1 else np.full(n_cells, np.nan)
    return payoff.mean(axis=1), variance


def _play(
    predators: TeamBatch, prey: TeamBatch, n_cells: int, starts: EpisodeStarts, evaluator: Evaluator
) -> TrialResult:
    """Play the episodes of all cells, cell by cell."""
    n_episodes = len(starts)
    # Only trials run in parallel, so the episodes of few cells are split over several trials each.
    n_parts = max(part for part in range(1, n_episodes + 1) if n_episodes % part == 0 and part <= -(-_FEW // n_cells))
    cut = starts.reshape(n_parts, n_episodes // n_parts, *starts.shape[1:])
    trials = np.repeat(np.arange(n_cells), n_parts)
    all_starts = np.broadcast_to(cut, (n_cells, *cut.shape)).reshape(len(trials), *cut.shape[1:])
    return evaluator.evaluate(TrialBatch(take(predators, trials), take(prey, trials), all_starts))


def kept_in(run: Path) -> Path | None:
    """Return the file that caches the cross-play of a run; None if the run's directory is not writable."""
    return run / "analysis" / "cross-play.safetensors" if os.access(run, os.W_OK) else None


def own_cross_play(
    history: History,
    evaluator: Evaluator,
    *,
    n_generations: int = 46,
    n_episodes: int = CELL_EPISODES,
    seed: int = 0,
    cache: Path | None = None,
) -> Played:
    """Play the champions of a run against each other, for generations evenly spread from the first to the last.

    With ``cache``, the result is saved in that file, and read from it if champions, world, episodes and seed are the
    same.
    """
    generations = history.sample(n_generations)
    predators, prey = (history.entrants(role, generations) for role in ROLES)
    game = history.config.game
    where = {"game": game.model_dump()} if game.environment else {"env": history.config.env.model_dump()}
    about = {"of": _digest(predators, prey), "n_episodes": n_episodes, "seed": seed, **where}
    if cache is not None and cache.exists():
        found = _read(cache, about, PayoffPlay if game.environment else CrossPlay)
        if found is not None:
            return found
    played = cross_play(predators, prey, evaluator, n_episodes=n_episodes, seed=seed)
    rows, columns = (generations if role in history.champions else np.zeros(1, int) for role in ROLES)
    whole = replace(played, predators=rows, prey=columns)
    if cache is not None:
        cache.parent.mkdir(parents=True, exist_ok=True)
        arrays = {name: value for name, value in vars(whole).items() if isinstance(value, np.ndarray)}
        write_arrays(cache, "cross-play", about, arrays)
    return whole


def met_by_others(
    history: History, others: Sequence[History], role: Role, own: Played, evaluator: Evaluator
) -> list[PayoffMatrix]:
    """Play the champions of a run against six champions of each other run.

    Args:
        history: The run.
        others: Other runs of the same world.
        role: Side of the run's champions. Those of the other runs play the other side.
        own: Cross-play of the run, whose generations and number of episodes are used.
        evaluator: Evaluator of their world.

    Returns:
        For each other run, the payoffs (the fraction of prey caught): predators are rows, prey columns.
    """
    mine, matrices = history.entrants(role, own.predators if role == "predators" else own.prey), []
    for other in others:
        theirs = other.entrants(other_team(role), other.sample(PANEL))
        pair = (mine, theirs) if role == "predators" else (theirs, mine)
        matrices.append(cross_play(*pair, evaluator, n_episodes=own.n_episodes).payoff)
    return matrices


def _read(path: Path, about: dict[str, Any], kind: type[CrossPlay] | type[PayoffPlay]) -> Played | None:
    """Read a cached cross-play; None if the file is damaged or its header differs from ``about``."""
    try:
        header, arrays = read_arrays(path, "cross-play")
        if any(header.get(name) != value for name, value in about.items()):
            return None
        return kind(**arrays, n_episodes=about["n_episodes"])
    except (DamagedFileError, TypeError):
        return None


def _digest(*sides: TeamBatch) -> str:
    return hashlib.sha256(b"".join(side.identity for side in sides)).hexdigest()
