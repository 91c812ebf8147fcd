"""The null model of behaviours: episodes of the same paths in which agents do not react to each other."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths


def repaired(paths: Paths, generator: np.random.Generator) -> Paths:
    """Re-pair episodes: combine the predators of each episode with prey that each come from a different episode.

    Every agent keeps its path, and meets agents that did not react to it. Prey see only predators, so whatever prey do
    together is caused by predators. Therefore the prey of an episode are separated from each other as well.

    Paths are not shifted. Starts are uniform, so the distances at the start have the same distribution as in true
    episodes. If each prey were shifted to the start of the prey that it replaces, some interaction would remain,
    because predators first go to where their own prey started. Up to twice as many re-paired episodes then held a
    chase.

    * Episodes are paired at random among those in which the same prey were caught. The length of an episode depends on
      this, so re-paired episodes are hardly shorter than true ones: not at all if no prey is caught, and by about 5 to
      10% if half the prey are.
    * A prey is free for as long as in its own episode, even if it crosses predators, and then stays in its cell. So a
      detector that compares capture times sees how often they coincide by chance.
    * An episode ends when that of its predators did, or when all its prey are caught.
    * Episodes are left out if too few have the same prey caught to take each prey from a different one.
    """
    n_prey, order = paths.n_prey, generator.permutation(paths.n_episodes)
    outcome = paths.captured[order] @ (1 << np.arange(n_prey))
    partners = np.full((paths.n_episodes, n_prey), -1)
    for kind in np.unique(outcome):
        alike = order[outcome == kind]
        if len(alike) > n_prey:
            partners[alike] = np.stack([np.roll(alike, shift + 1) for shift in range(n_prey)], axis=1)
    kept = np.flatnonzero((partners >= 0).all(axis=1))
    partners, own = partners[kept], np.arange(n_prey)
    prey = paths.prey[partners, :, own].swapaxes(1, 2)
    times = paths.capture_times[partners, own]
    lengths = np.minimum(paths.lengths[kept], times.max(axis=1, initial=0))
    return Paths(paths.predators[kept], prey, lengths, times, paths.size)
