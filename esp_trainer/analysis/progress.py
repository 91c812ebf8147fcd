"""Measures of progress from the literature, computed from the fraction of prey caught across generations and seeds.

In-loop success does not show progress, because it changes with the opponent (the Red Queen effect). All measures here
are against fixed opponents.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import kendalltau, norm

from esp_trainer.analysis.games import Noise, Sides, as_results, as_shares, as_square
from esp_trainer.arrays import Curve, PayoffMatrix, PayoffVariance


def ciao(caught: PayoffMatrix, total: float = 1.0) -> Sides[PayoffMatrix]:
    """Return results of current individuals against ancestral opponents (CIAO).

    Source: Cliff & Miller, Tracking the Red Queen, ECAL 1995.

    Args:
        caught: Fraction of prey caught, ``(G, G)``, see :func:`~esp_trainer.analysis.games.as_square`.
        total: Sum of both sides' results, see :func:`~esp_trainer.analysis.games.as_results`.

    Returns:
        Results of each side, float64 ``(G, G)``, higher is better. Row ``g`` holds the results of generation ``g``
        against the opponents of generations 0 to ``g``, and nan above the diagonal. The result of prey is the fraction
        not caught, or minus the payoff of another game.
    """
    caught = as_square(caught, total)
    future = np.triu(np.ones_like(caught, bool), k=1)
    return Sides(*(np.where(future, np.nan, results) for results in (caught, total - caught.T)))


def master_tournament(caught: PayoffMatrix, total: float = 1.0) -> Sides[Curve]:
    """Return the mean result of each generation against all opponents of the run.

    Source: Nolfi & Floreano, Coevolving predator and prey robots: do "arms races" arise in artificial evolution?,
    Artificial Life 4, 1998.

    Args:
        caught: Fraction of prey caught, ``(G, H)``, see :func:`~esp_trainer.analysis.games.as_shares`.
        total: Sum of both sides' results, see :func:`~esp_trainer.analysis.games.as_results`.

    Returns:
        Mean results, higher is better: fraction of prey caught for predators, ``(G,)``, and fraction not caught for
        prey, ``(H,)``.
    """
    caught = as_results(caught, "caught", total)
    return Sides(caught.mean(axis=1), total - caught.mean(axis=0))


def dominant_generations(caught: PayoffMatrix, episodes: Noise = None, error: float = 0.05) -> list[int]:
    """Run a dominance tournament between generations, and return the dominant ones.

    The first generation is dominant. Each later one is dominant if it beats every dominant generation before it
    (Stanley & Miikkulainen, The dominance tournament method of monitoring progress in coevolution, GECCO workshops
    2002).

    In that paper, strategies of one kind play each other. Here the sides differ, so a strategy is a generation in both
    roles. Generation ``g`` beats ``k`` if ``M[g, k] > M[k, g]``: the predators of ``g`` catch more of the prey of ``k``
    than the predators of ``k`` catch of the prey of ``g``. Progress of one side alone can make a generation dominant.

    Args:
        caught: Fraction of prey caught, ``(G, G)``, see :func:`~esp_trainer.analysis.games.as_square`.
        episodes: Number of independent episodes behind each fraction. The difference must then exceed a margin, in
            standard errors of the difference (Agresti & Caffo, The American Statistician 54, 2000). The margin is such
            that a run without progress has a second dominant generation with a probability of at most ``error``.
            Instead of a number: the sampling variance of each entry, ``(G, G)``; entries may then be any payoffs. None:
            any difference counts, and 75 generations of pure noise have about six dominant ones.
        error: Maximum of that probability; it is divided among the later generations (Bonferroni).

    Returns:
        Rows of the dominant generations, in order, 0 first.
    """
    variances = isinstance(episodes, np.ndarray)
    caught = as_square(caught, 0.0 if variances else 1.0)
    lead, margin = caught - caught.T, np.zeros_like(caught)
    if episodes is not None:
        if np.min(episodes) < (0 if variances else 1) or not 0 < error < 1:
            raise ValueError(f"episodes must be at least 1 and error in (0, 1), got {episodes} and {error}")
        variance = episodes if isinstance(episodes, np.ndarray) else _agresti_caffo(caught, episodes)
        margin = norm.isf(error / max(1, len(caught) - 1)) * np.sqrt(variance + variance.T)
    dominant = [0]
    for g in range(1, len(caught)):
        if (lead[g, dominant] > margin[g, dominant]).all():
            dominant.append(g)
    return dominant


def _agresti_caffo(caught: PayoffMatrix, episodes: int) -> PayoffVariance:
    """Return the variance of fractions, each with one success and one failure added."""
    shares = (caught * episodes + 1) / (episodes + 2)
    return shares * (1 - shares) / (episodes + 2)


@dataclass(frozen=True)
class Progress:
    """Results of one side's generations against the same opponents."""

    curve: Curve
    """Mean result of each generation, float64 ``(G,)``, higher is better."""
    strength: float
    """Mean of the last sixth of the curve minus that of the first sixth; in [-1, 1] for fractions of prey."""
    tau: float
    """Kendall's tau-b of the curve with time, in [-1, 1]; 0 for a constant curve. It has no p-value, because successive
    generations are not independent: test over seeds instead."""

    @property
    def level(self) -> float:
        """Mean of the last sixth of the curve: result of the side at the end."""
        return float(self.curve[_ends(len(self.curve))[1]].mean())


def progress(results: PayoffMatrix, total: float = 1.0) -> Progress:
    """Return the progress of one side against a panel.

    Args:
        results: Results of the side's generations, ``(G, n_opponents)`` in [0, 1], higher is better. There must be at
            least two generations, oldest first and evenly spaced.
        total: Sum of both sides' results, see :func:`~esp_trainer.analysis.games.as_results`.
    """
    curve = as_results(results, "results", total).mean(axis=1)
    early, late = _ends(len(curve))
    ranked = curve.round(12)  # so that rounding errors of the mean do not break ties between equal results
    tau = float(kendalltau(np.arange(len(curve)), ranked).statistic) if np.ptp(ranked) > 0 else 0.0
    return Progress(curve, float(curve[late].mean() - curve[early].mean()), tau)


def historical_progress(caught: PayoffMatrix, total: float = 1.0) -> Sides[Progress]:
    """Return the progress of both sides against the opponents of their own run.

    A side evolved against these opponents, so it may be good against no others. Source: Miconi, Why coevolution doesn't
    "work": superiority and progress in coevolution, EuroGP 2009. Miconi's historical progress is against previous
    opponents. Here the panel is all opponents of the run, so that every generation meets the same ones.

    Args:
        caught: Fraction of prey caught in one run, ``(G, H)``, see :func:`~esp_trainer.analysis.games.as_shares`.
        total: Sum of both sides' results, see :func:`~esp_trainer.analysis.games.as_results`.
    """
    caught = as_results(caught, "caught", total)
    return Sides(progress(caught, total), progress(total - caught.T, total))


def global_progress(
    predators_met: Sequence[PayoffMatrix], prey_met: Sequence[PayoffMatrix], total: float = 1.0
) -> Sides[Progress]:
    """Return the progress of both sides against opponents of independent seeds.

    These stand for all possible opponents (Miconi 2009, as in :func:`historical_progress`): a side that has adapted
    only to its own opponents shows no progress.

    Args:
        predators_met: Fraction of each other seed's prey that the run's predators catch, ``(G, H_i)`` each.
        prey_met: Fraction of the run's prey that each other seed's predators catch, ``(G_i, H)`` each.
        total: Sum of both sides' results, see :func:`~esp_trainer.analysis.games.as_results`.

    Raises:
        ValueError: There is no other seed, or the matrices of a side have different numbers of the run's generations.
    """
    hunts = [as_results(panel, "predators_met", total) for panel in predators_met]
    escapes = [total - as_results(panel, "prey_met", total).T for panel in prey_met]
    for name, results in (("predators_met", hunts), ("prey_met", escapes)):
        if len({len(panel) for panel in results}) != 1:
            generations = [len(panel) for panel in results]
            raise ValueError(f"{name} must hold matrices of the same generations of the run, got {generations} of them")
    return Sides(progress(np.concatenate(hunts, axis=1), total), progress(np.concatenate(escapes, axis=1), total))


def two_sided(both: Sides[Progress]) -> float:
    """Return the smaller of the two sides' strengths of progress.

    It is positive only if late predators catch more of the same prey than early ones, and late prey are caught less by
    the same predators than early ones. An arms race needs both.
    """
    return min(both.predators.strength, both.prey.strength)


@dataclass(frozen=True)
class EarlyLate:
    """Mean fractions of prey caught between the first (early) and last (late) sixth of each side's generations."""

    late_hunt_early: float
    """Fraction of early prey that late predators catch."""
    early_hunt_late: float
    """Fraction of late prey that early predators catch."""
    late_hunt_late: float
    """Fraction of late prey that late predators catch."""
    early_hunt_early: float
    """Fraction of early prey that early predators catch."""


def early_late(caught: PayoffMatrix, total: float = 1.0) -> EarlyLate:
    """Return the means of the four corners of the matrix, each over a sixth of the generations of both sides.

    Args:
        caught: Fraction of prey caught, ``(G, H)``, see :func:`~esp_trainer.analysis.games.as_shares`.
        total: Sum of both sides' results, see :func:`~esp_trainer.analysis.games.as_results`.
    """
    caught = as_results(caught, "caught", total)
    (early_predators, late_predators), (early_prey, late_prey) = map(_ends, caught.shape)
    return EarlyLate(
        late_hunt_early=float(caught[late_predators, early_prey].mean()),
        early_hunt_late=float(caught[early_predators, late_prey].mean()),
        late_hunt_late=float(caught[late_predators, late_prey].mean()),
        early_hunt_early=float(caught[early_predators, early_prey].mean()),
    )


@dataclass(frozen=True)
class Generalist:
    """Scores of each generation against a frozen panel, float64 ``(G,)`` each."""

    mean: Curve
    """Mean result over all opponents."""
    worst: Curve
    """Mean result over the tenth of the opponents (at least one) with the worst results."""


def generalist(results: PayoffMatrix) -> Generalist:
    """Return the scores of each generation against a panel that no generation evolved against.

    The scores follow the generalisation performance of Chong, Tino & Yao (Measuring generalization performance in
    coevolutionary learning, IEEE TEC 12, 2008).

    Args:
        results: Results of the side's generations, ``(G, n_panel)`` in [0, 1], higher is better.
    """
    results = as_shares(results, "results")
    n_worst = max(1, results.shape[1] // 10)
    return Generalist(results.mean(axis=1), np.sort(results, axis=1)[:, :n_worst].mean(axis=1))


def _ends(n: int) -> tuple[slice, slice]:
    """Return slices for the first and the last sixth of ``n`` generations, at least one generation each."""
    if n < 2:
        raise ValueError(f"early and late need at least two generations, got {n}")
    sixth = max(1, n // 6)
    return slice(sixth), slice(n - sixth, n)
