"""Measurements for a report: cross-play, progress, phases, behaviours, and the best moments of each behaviour."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis import phases as dating
from esp_trainer.analysis.behaviours.counts import BehaviourRate, count_behaviours
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.cross_play import Played, kept_in, met_by_others, own_cross_play
from esp_trainer.analysis.games import Sides
from esp_trainer.analysis.history import History, payoff_curve
from esp_trainer.analysis.moments import Moment, best_moment
from esp_trainer.analysis.phases import Alternation, Phase
from esp_trainer.analysis.progress import Progress, global_progress, historical_progress
from esp_trainer.analysis.watch import episodes
from esp_trainer.arrays import Curve, GenerationIndices
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.other_game import GameEvaluator
from esp_trainer.evaluation.registry import make_evaluator
from esp_trainer.report.source import RunSource
from esp_trainer.seeding import stream

REPORTED_BEHAVIOURS = tuple(name for name, detector in BEHAVIOURS.items() if detector.of_interaction)
"""Behaviours that a report covers: those between predators and prey."""

SHORTEST = 2 * dating.MIN_LENGTH
"""Minimum length of a run, in generations, at which a report speaks of phases, of progress and of a winner."""

SEEN = 0.01
"""Minimum rate beyond chance, as a fraction of the episodes, at which a behaviour is reported as having appeared."""


@dataclass(frozen=True)
class ReportOptions:
    """Numbers of generations and episodes to play."""

    generations: int = 46
    """Number of generations of each side in the cross-play."""
    episodes: int = 64
    """Number of episodes per pair of the cross-play."""
    watched: int = 24
    """Number of generations in which behaviours are detected; half as many per run if there are several runs."""


@dataclass(frozen=True)
class Watched:
    """Behaviours in episodes between contemporary champions of some generations."""

    generations: GenerationIndices
    """Watched generations, int ``(n,)``."""
    rates: dict[str, list[BehaviourRate]]
    """Rate of each behaviour in each generation."""
    moments: list[dict[str, Moment]]
    """Best moment of each behaviour that was seen, for each generation."""

    def excess(self, name: str) -> Curve:
        """Return the rate of a behaviour beyond chance in each generation, float ``(n,)``; nan where it is unknown."""
        return np.array([rate.excess for rate in self.rates[name]])


def appeared(watched: Sequence[Watched], name: str) -> bool:
    """Return whether a behaviour is seen beyond chance in the mean over all generations and runs."""
    return bool(watched) and float(np.nanmean([each.excess(name) for each in watched])) >= SEEN


@dataclass(frozen=True)
class MeasuredRuns:
    """Measurements of a run.

    Without champions, the measurements that need them are None. With a scripted side, so are the measures of progress.
    """

    source: RunSource
    own: Played | None = None
    """Cross-play between the run's generations."""
    progress: Sides[Progress] | None = None
    """Progress against the opponents of the same run."""
    met_others: Sides[Progress] | None = None
    """Progress against the champions of the other runs in the report; None without other runs."""
    phases: tuple[Phase, ...] = ()
    """Phases of the payoff (the fraction of prey caught), champion against champion; empty if the run is too short."""
    alternation: Alternation | None = None
    """Alternation of success between the sides; None if the run is too short."""
    watched: Watched | None = None
    """Behaviours; None in another game than the predator-prey world, for which none are defined."""

    @property
    def captures(self) -> bool:
        """Return whether payoffs are fractions of prey caught: whether the game is the predator-prey world."""
        return not self.source.config.game.environment


def why_undated(runs: Sequence[MeasuredRuns]) -> str:
    """Return why no run has phases, as a clause; empty if one has."""
    if any(run.phases for run in runs):
        return ""
    if not any(run.source.curves for run in runs):
        return "the log of success is lost"
    return f"that takes at least {SHORTEST} generations"


def never_seen(runs: Sequence[MeasuredRuns]) -> list[str]:
    """Return the behaviours that are defined for the teams but were never seen."""
    watched = [run.watched for run in runs if run.watched]
    asked = [name for name in REPORTED_BEHAVIOURS if watched and not np.isnan(watched[0].excess(name)).all()]
    return [name for name in asked if not any(name in moments for each in watched for moments in each.moments)]


def measure_runs(
    sources: Sequence[RunSource], settings: ReportOptions, say: Callable[[str], None]
) -> list[MeasuredRuns]:
    """Measure every run by itself, and against the others.

    Args:
        sources: Runs of the same world and length.
        settings: Numbers of generations and episodes to play.
        say: Function called with a line about what is being done.
    """
    evaluator = make_evaluator(sources[0].config)
    measured = []
    for source in sources:
        say(f"playing {source.path} ...")
        others = [other.history for other in sources if other is not source and other.history]
        measured.append(_measure(source, others, evaluator, settings))
    return measured


def _measure(
    source: RunSource, others: list[History], evaluator: FusedEvaluator | GameEvaluator, settings: ReportOptions
) -> MeasuredRuns:
    curve = payoff_curve(source.curves) if source.curves else np.empty(0)
    long_enough = len(curve) >= SHORTEST
    found = tuple(dating.phases(curve)) if long_enough else ()
    alternation = dating.alternation(curve, np.random.default_rng(0)) if long_enough else None
    history = source.history
    if history is None:
        return MeasuredRuns(source, phases=found, alternation=alternation)
    sampled, each, cache = settings.generations, settings.episodes, kept_in(source.path)
    own = own_cross_play(history, evaluator, n_generations=sampled, n_episodes=each, cache=cache)
    both = len(history.champions) == 2 and min(own.payoff.shape) > 1
    met = {role: met_by_others(history, others, role, own, evaluator) for role in history.champions} if both else {}
    watched = history.sample(settings.watched // 2 if others else settings.watched)
    return MeasuredRuns(
        source,
        own=own,
        progress=historical_progress(own.payoff, own.total) if both else None,
        met_others=global_progress(met["predators"], met["prey"], own.total) if met and others else None,
        phases=found,
        alternation=alternation,
        watched=_watch(history, evaluator, watched) if isinstance(evaluator, FusedEvaluator) else None,
    )


def _watch(history: History, evaluator: FusedEvaluator, generations: GenerationIndices) -> Watched:
    rates: dict[str, list[BehaviourRate]] = {}
    moments: list[dict[str, Moment]] = []
    for generation in generations.tolist():
        trace, paths = episodes(history, evaluator, generation)
        for name, rate in count_behaviours(paths, stream(0, "null", generation)).items():
            rates.setdefault(name, []).append(rate)
        asked = [name for name in REPORTED_BEHAVIOURS if not np.isnan(rates[name][-1].excess)]
        best = {name: best_moment(name, trace, paths) for name in asked if rates[name][-1].rate > 0}
        moments.append({name: moment for name, moment in best.items() if moment})
    return Watched(generations, rates, moments)
