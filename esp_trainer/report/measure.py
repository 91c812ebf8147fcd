"""What a page says, measured: who catches whom, progress, phases, behaviours, and the moments worth seeing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis import phases as dating
from esp_trainer.analysis.behaviours.counts import BehaviourRate, count_behaviours
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.cross_play import CrossPlay, kept_in, met_by_others, own_cross_play
from esp_trainer.analysis.games import Sides
from esp_trainer.analysis.history import History
from esp_trainer.analysis.moments import Moment, best_moment
from esp_trainer.analysis.phases import Alternation, Phase
from esp_trainer.analysis.progress import Progress, global_progress, historical_progress
from esp_trainer.analysis.watch import episodes
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.report.source import Source
from esp_trainer.seeding import stream

SHOWN = tuple(name for name, detector in BEHAVIOURS.items() if detector.of_interaction)
"""The behaviours that a page is about: those between predators and prey."""

SEEN = 0.01
"""Share of the episodes beyond chance from which on a behaviour is said to have appeared."""


@dataclass(frozen=True)
class Settings:
    """How much is played."""

    generations: int = 46
    """Of each side, that meet each other."""
    episodes: int = 64
    """Of each such meeting."""
    watched: int = 24
    """Generations whose contemporaries are watched for behaviours; of each of several runs half as many."""


@dataclass(frozen=True)
class Watched:
    """What the champions of some generations did to each other."""

    generations: np.ndarray
    """int ``(n,)``."""
    rates: dict[str, list[BehaviourRate]]
    """Of each behaviour in each generation."""
    moments: list[dict[str, Moment]]
    """In each generation the best of each behaviour that was seen."""

    def excess(self, name: str) -> np.ndarray:
        """How often a behaviour was seen beyond chance, float ``(n,)``; nan where it cannot be asked for."""
        return np.array([rate.excess for rate in self.rates[name]])


def appeared(watched: Sequence[Watched], name: str) -> bool:
    """Whether a behaviour is seen beyond chance on the whole, not just in a lucky generation."""
    return bool(watched) and float(np.nanmean([each.excess(name) for each in watched])) >= SEEN


@dataclass(frozen=True)
class Measured:
    """A run, measured. What needs champions is None without them, what needs two evolving sides with a script."""

    source: Source
    own: CrossPlay | None = None
    progress: Sides[Progress] | None = None
    met_others: Sides[Progress] | None = None
    """Against the champions of the other runs of the page."""
    phases: tuple[Phase, ...] = ()
    """Of the success of champions against contemporaries; none where the run is too short to tell."""
    alternation: Alternation | None = None
    watched: Watched | None = None


def measure(sources: Sequence[Source], settings: Settings, say: Callable[[str], None]) -> list[Measured]:
    """Measure every run by itself, and against the others.

    Args:
        sources: Runs of one world and one length.
        settings: How much is played.
        say: Told what is being done.
    """
    evaluator = FusedEvaluator(sources[0].config.env)
    measured = []
    for source in sources:
        say(f"playing {source.path} ...")
        others = [other.history for other in sources if other is not source and other.history]
        measured.append(_measure(source, others, evaluator, settings))
    return measured


def _measure(source: Source, others: list[History], evaluator: FusedEvaluator, settings: Settings) -> Measured:
    curve = source.curves.get("caught", np.empty(0))
    long_enough = len(curve) >= 2 * dating.MIN_LENGTH
    found = tuple(dating.phases(curve)) if long_enough else ()
    alternation = dating.alternation(curve, np.random.default_rng(0)) if long_enough else None
    history = source.history
    if history is None:
        return Measured(source, phases=found, alternation=alternation)
    sampled, each, cache = settings.generations, settings.episodes, kept_in(source.path)
    own = own_cross_play(history, evaluator, n_generations=sampled, n_episodes=each, cache=cache)
    both = len(history.champions) == 2 and min(own.caught.shape) > 1
    met = {role: met_by_others(history, others, role, own, evaluator) for role in history.champions} if both else {}
    return Measured(
        source,
        own=own,
        progress=historical_progress(own.caught) if both else None,
        met_others=global_progress(met["predators"], met["prey"]) if met and others else None,
        phases=found,
        alternation=alternation,
        watched=_watch(history, evaluator, history.sample(settings.watched // 2 if others else settings.watched)),
    )


def _watch(history: History, evaluator: FusedEvaluator, generations: np.ndarray) -> Watched:
    rates: dict[str, list[BehaviourRate]] = {}
    moments: list[dict[str, Moment]] = []
    for generation in generations.tolist():
        trace, paths = episodes(history, evaluator, generation)
        for name, rate in count_behaviours(paths, stream(0, "null", generation)).items():
            rates.setdefault(name, []).append(rate)
        asked = [name for name in SHOWN if not np.isnan(rates[name][-1].excess)]
        best = {name: best_moment(name, trace, paths) for name in asked if rates[name][-1].rate > 0}
        moments.append({name: moment for name, moment in best.items() if moment})
    return Watched(generations, rates, moments)
