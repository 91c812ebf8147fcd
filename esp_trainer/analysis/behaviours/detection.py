"""The detectors over all episodes and rows, in compiled code."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from esp_trainer.analysis.behaviours.episode import Episodes, episode_of
from esp_trainer.analysis.behaviours.evasion import baiting, circling, reversal, sidestepping
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.roles import attacker, blocker, mark_roles, opposing_attack, role_switch
from esp_trainer.analysis.behaviours.surrounding import encirclement
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.behaviours.two_prey import herding, scattering, simultaneous_capture
from esp_trainer.arrays import BoolMask
from predprey_env.jit import entry_point
from predprey_env.jit.values import Array


class Seen(NamedTuple):
    """The rows at which each behaviour is seen, bool ``(n_episodes, n_rows)``."""

    attacker: Array
    blocker: Array
    role_switch: Array
    opposing_attack: Array
    encirclement: Array
    circling: Array
    baiting: Array
    sidestepping: Array
    reversal: Array
    herding: Array
    simultaneous_capture: Array
    scattering: Array


class Detected(NamedTuple):
    """Roles and behaviours in a set of episodes."""

    episodes: Episodes
    """The episodes, with the roles of predators."""

    seen: Seen


@entry_point
def detect(episodes: Episodes, x: Thresholds, seen: Seen) -> None:
    """Mark roles in episodes, and the rows at which each behaviour is seen.

    Args:
        episodes: Episodes in which no roles are marked yet.
        x: Thresholds of the definitions.
        seen: Array of each behaviour, all false.
    """
    for each in range(len(episodes.cells)):
        episode = episode_of(episodes, each)
        mark_roles(episode, x)
        for row in range(len(episode.cells)):
            seen.attacker[each, row] = attacker(episode, row)
            seen.blocker[each, row] = blocker(episode, row)
            seen.role_switch[each, row] = role_switch(episode, row)
            seen.opposing_attack[each, row] = opposing_attack(episode, row, x)
            seen.encirclement[each, row] = encirclement(episode, row, x)
            seen.circling[each, row] = circling(episode, row, x)
            seen.baiting[each, row] = baiting(episode, row, x)
            seen.sidestepping[each, row] = sidestepping(episode, row, x)
            seen.reversal[each, row] = reversal(episode, row, x)
            seen.herding[each, row] = herding(episode, row, x)
            seen.simultaneous_capture[each, row] = simultaneous_capture(episode, row, x)
            seen.scattering[each, row] = scattering(episode, row, x)


def detected(paths: Paths, thresholds: Thresholds) -> Detected:
    """Return the roles and behaviours in episodes. They are cached in the paths, as callers ask for one at a time."""
    found = paths.detected.get(thresholds)
    if found is None:
        attacks, blocks = np.zeros((2, *paths.distances.shape), bool)
        times, lengths = (np.ascontiguousarray(part, np.int64) for part in (paths.capture_times, paths.lengths))
        sizes = paths.n_predators, paths.n_prey
        episodes = Episodes(paths.cells, paths.all_offsets, times, lengths, *sizes, attacks, blocks)
        seen = Seen(*np.zeros((len(Seen._fields), *paths.valid.shape), bool))
        detect(episodes, thresholds, seen)
        for rows in seen:
            rows.setflags(write=False)  # all callers get the same arrays
        found = paths.detected[thresholds] = Detected(episodes, seen)
    return found


def rows_of(detector: Callable[..., bool]) -> Callable[[Paths, Thresholds], BoolMask]:
    """Return the function that gives the rows at which a detector sees its behaviour, bool ``(n_episodes, n_rows)``."""
    name = detector.__name__
    return lambda paths, thresholds: np.asarray(getattr(detected(paths, thresholds).seen, name))
