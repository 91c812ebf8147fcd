"""Did both sides get better? The field's ways to see it in who catches whom, across generations and across seeds.

In-loop success can't tell, as it moves with the opponent (the Red Queen). Everything here is against fixed opponents.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import kendalltau, norm

from esp_trainer.analysis.games import Sides, as_shares, as_square


def ciao(caught: np.ndarray) -> Sides[np.ndarray]:
    """Current individual against ancestral opponents (Cliff & Miller, Tracking the Red Queen, ECAL 1995).

    Args:
        caught: ``(G, G)``, see :func:`~esp_trainer.analysis.games.as_square`.

    Returns:
        For each side float64 ``(G, G)``: in row ``g`` its result, higher is better, against the opponents of
        generations 0 to ``g``; nan above the diagonal. Prey's result is the share that was not caught.
    """
    caught = as_square(caught)
    future = np.triu(np.ones_like(caught, bool), k=1)
    return Sides(*(np.where(future, np.nan, results) for results in (caught, 1 - caught.T)))


def master_tournament(caught: np.ndarray) -> Sides[np.ndarray]:
    """Each generation against all opponents of the run (Nolfi & Floreano, Coevolving predator and prey robots: do "arms
    races" arise in artificial evolution?, Artificial Life 4, 1998).

    Args:
        caught: ``(G, H)``, see :func:`~esp_trainer.analysis.games.as_shares`.

    Returns:
        Mean result of each generation, higher is better: share of prey caught for predators ``(G,)``, share not caught
        for prey ``(H,)``.
    """
    caught = as_shares(caught)
    return Sides(caught.mean(axis=1), 1 - caught.mean(axis=0))


def dominant_generations(caught: np.ndarray, episodes: int | None = None, error: float = 0.05) -> list[int]:
    """Dominance tournament (Stanley & Miikkulainen, The dominance tournament method of monitoring progress in
    coevolution, GECCO workshops 2002): the first generation is dominant, and after it each that beats every dominant
    one before it.

    There strategies of one kind play each other. Here the sides differ, so a strategy is a generation in both roles,
    and ``g`` beats ``k`` if ``M[g, k] > M[k, g]``: its predators catch more of the prey of ``k`` than the predators of
    ``k`` catch of its prey. One side's progress alone can make a generation dominant.

    Args:
        caught: ``(G, G)``, see :func:`~esp_trainer.analysis.games.as_square`.
        episodes: Independent episodes behind each share. The difference must then exceed a margin: as many of its
            standard errors (Agresti & Caffo, The American Statistician 54, 2000) that in a run without progress a
            second dominant generation arises with a chance of at most ``error``. None: any difference counts, and 75
            generations of nothing but noise have some six dominant ones.
        error: That chance, shared out over all later generations (Bonferroni).

    Returns:
        Rows of the dominant generations, in order, 0 first.
    """
    caught = as_square(caught)
    lead, margin = caught - caught.T, np.zeros_like(caught)
    if episodes is not None:
        if episodes < 1 or not 0 < error < 1:
            raise ValueError(f"episodes must be at least 1 and error in (0, 1), got {episodes} and {error}")
        shares = (caught * episodes + 1) / (episodes + 2)
        variance = shares * (1 - shares) / (episodes + 2)
        margin = norm.isf(error / max(1, len(caught) - 1)) * np.sqrt(variance + variance.T)
    dominant = [0]
    for g in range(1, len(caught)):
        if (lead[g, dominant] > margin[g, dominant]).all():
            dominant.append(g)
    return dominant


@dataclass(frozen=True)
class Progress:
    """How one side's generations did against the same opponents."""

    curve: np.ndarray
    """float64 ``(G,)``: mean result of each generation, higher is better."""
    strength: float
    """Mean of the last sixth of the curve less that of the first, in [-1, 1]."""
    tau: float
    """Kendall's tau-b of the curve with time, in [-1, 1]; 0 for a constant curve. Without a p-value, since generations
    that follow each other are not independent: test over seeds."""

    @property
    def level(self) -> float:
        """Mean of the last sixth of the curve: how good the side is in the end."""
        return float(self.curve[_ends(len(self.curve))[1]].mean())


def progress(results: np.ndarray) -> Progress:
    """One side's progress against a panel.

    Args:
        results: ``(G, n_opponents)`` in [0, 1], higher is better for the side of the rows; at least two generations,
            oldest first, at even distances.
    """
    curve = as_shares(results, "results").mean(axis=1)
    early, late = _ends(len(curve))
    ranked = curve.round(12)  # the same results in another order have the same mean, but for rounding
    tau = float(kendalltau(np.arange(len(curve)), ranked).statistic) if np.ptp(ranked) > 0 else 0.0
    return Progress(curve, float(curve[late].mean() - curve[early].mean()), tau)


def historical_progress(caught: np.ndarray) -> Sides[Progress]:
    """Progress against the opponents of the own run (Miconi, Why coevolution doesn't "work": superiority and progress
    in coevolution, EuroGP 2009). A side evolved against these, so it may be good at nothing else.

    Miconi's historical progress is against previous opponents; here the panel is all of the run's, so that every
    generation meets the same.

    Args:
        caught: ``(G, H)`` of one run, see :func:`~esp_trainer.analysis.games.as_shares`.
    """
    caught = as_shares(caught)
    return Sides(progress(caught), progress(1 - caught.T))


def global_progress(predators_met: Sequence[np.ndarray], prey_met: Sequence[np.ndarray]) -> Sides[Progress]:
    """Progress against opponents of independent seeds, which stand for all possible opponents (Miconi 2009, as in
    :func:`historical_progress`): a side that only learned its own opponents shows none.

    Args:
        predators_met: Shares caught by the run's predators from the prey of each other seed: ``(G, H_i)`` each.
        prey_met: Shares caught by the predators of each other seed from the run's prey: ``(G_i, H)`` each.
    """
    hunts = [as_shares(panel, "predators_met") for panel in predators_met]
    escapes = [1 - as_shares(panel, "prey_met").T for panel in prey_met]
    for name, results in (("predators_met", hunts), ("prey_met", escapes)):
        if len({len(panel) for panel in results}) != 1:
            generations = [len(panel) for panel in results]
            raise ValueError(f"{name} must hold matrices of the same generations of the run, got {generations} of them")
    return Sides(progress(np.concatenate(hunts, axis=1)), progress(np.concatenate(escapes, axis=1)))


def two_sided(both: Sides[Progress]) -> float:
    """The lesser strength of the two sides' progress: above 0 only if late predators catch more than early ones of the
    same prey, and early prey are caught more than late ones by the same predators. An arms race needs both.
    """
    return min(both.predators.strength, both.prey.strength)


@dataclass(frozen=True)
class EarlyLate:
    """Mean shares of prey caught between the first and the last sixth of the generations."""

    late_hunt_early: float
    """Late predators, early prey."""
    early_hunt_late: float
    """Early predators, late prey."""
    late_hunt_late: float
    early_hunt_early: float


def early_late(caught: np.ndarray) -> EarlyLate:
    """The four corners of the matrix ``(G, H)`` (see :func:`~esp_trainer.analysis.games.as_shares`), each the mean over
    a sixth of the generations of both sides.
    """
    caught = as_shares(caught)
    (early_predators, late_predators), (early_prey, late_prey) = map(_ends, caught.shape)
    return EarlyLate(
        late_hunt_early=float(caught[late_predators, early_prey].mean()),
        early_hunt_late=float(caught[early_predators, late_prey].mean()),
        late_hunt_late=float(caught[late_predators, late_prey].mean()),
        early_hunt_early=float(caught[early_predators, early_prey].mean()),
    )


@dataclass(frozen=True)
class Generalist:
    """How each generation does against a frozen panel, float64 ``(G,)`` each."""

    mean: np.ndarray
    """Over all opponents."""
    worst: np.ndarray
    """Over the tenth of the opponents, at least one, that it does worst against."""


def generalist(results: np.ndarray) -> Generalist:
    """Scores against a panel that no generation evolved against, after the generalisation performance of Chong, Tino &
    Yao (Measuring generalization performance in coevolutionary learning, IEEE TEC 12, 2008).

    Args:
        results: ``(G, n_panel)`` in [0, 1], higher is better for the side of the rows.
    """
    results = as_shares(results, "results")
    n_worst = max(1, results.shape[1] // 10)
    return Generalist(results.mean(axis=1), np.sort(results, axis=1)[:, :n_worst].mean(axis=1))


def _ends(n: int) -> tuple[slice, slice]:
    """The first and the last sixth of ``n`` generations, at least one each."""
    if n < 2:
        raise ValueError(f"early and late need at least two generations, got {n}")
    sixth = max(1, n // 6)
    return slice(sixth), slice(n - sixth, n)
