"""Approximate best responses: freeze one team, and evolve opponents against it from scratch.

The payoff of the evolved opponents is a lower bound on the payoff of the best response, and so bounds the team's
exploitability from below. Sources: Lisy & Bowling 2017 (local best response), Timbers et al. 2022 (approximate
exploitability).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.history import History
from esp_trainer.arrays import Curve
from esp_trainer.types import Evaluator, Role, TeamBatch
from predprey_env.agents import other_team

MEASURED_EPISODES = 1000
"""Number of episodes of each final measurement: the standard error of a fraction of prey is then at most 0.016."""


@dataclass(frozen=True)
class BestResponse:
    """The best response that evolution found to one frozen side of a generation."""

    role: Role
    """Side that evolved the response."""
    generation: int
    """Generation of the frozen side."""
    before: float
    """Payoff to the predators (fraction of prey caught) when the frozen side met its contemporaries."""
    after: float
    """Payoff to the predators when the frozen side met the best response."""
    curve: Curve
    """Payoff to the predators in each generation of the fresh evolution, ``(n_generations,)``, on the held-out starts
    by which the best response was selected."""

    @property
    def gain(self) -> float:
        """Payoff of the best response minus that of the contemporaries: a fraction of prey, or another game's payoff.

        It is about 0 or more if the fresh evolution did at least as well as the contemporaries.
        """
        return (self.after - self.before) * (1 if self.role == "predators" else -1)


def evolve_response(
    history: History,
    role: Role,
    evaluator: Evaluator,
    *,
    generation: int = -1,
    n_generations: int = 100,
    n_episodes: int = MEASURED_EPISODES,
    seed: int = 0,
    watch: Callable[[], object] = lambda: None,
) -> BestResponse:
    """Freeze the opponents of ``role`` as they were in a generation, and evolve that role against them from scratch.

    The best response is the champion that does best on the held-out starts of the fresh evolution. The best response
    and the contemporaries of the frozen side are then measured on other starts.

    Args:
        history: The run.
        role: Side to evolve, with the run's own settings.
        evaluator: Evaluator of the run's world.
        generation: Generation of the frozen opponents; by default the last.
        n_generations: Number of generations of the fresh evolution.
        n_episodes: Number of episodes of each final measurement.
        seed: Seed of the fresh evolution, which should not be that of the run.
        watch: Function called after each generation of the fresh evolution.

    Raises:
        ValueError: The role follows a script in this run, so there are no settings to evolve it with.
    """
    if role not in history.champions:
        raise ValueError(f"{role} must evolve in this run to evolve a response, but follow a script")
    generation = range(len(history))[generation]
    other = other_team(role)
    # Without the league, so that the frozen team is the only opponent.
    config = history.config.replace(seed=seed, generations=n_generations, league="")
    fresh = History.evolve(config, evaluator, watch, {other: history.player(other, generation)})
    curve = fresh.payoff
    best = int(fresh.kept[curve[fresh.kept].argmax() if role == "predators" else curve[fresh.kept].argmin()])
    then = np.array([generation])
    frozen, contemporaries = history.entrants(other, then), history.entrants(role, then)

    # The starts differ from those on which the champion was selected, so that selection does not bias the result.
    def payoff(responder: TeamBatch) -> float:
        predators, prey = (responder, frozen) if role == "predators" else (frozen, responder)
        return float(cross_play(predators, prey, evaluator, n_episodes=n_episodes, seed=seed).payoff[0, 0])

    answer = fresh.entrants(role, np.array([best]))
    return BestResponse(role, generation, payoff(contemporaries), payoff(answer), curve)
