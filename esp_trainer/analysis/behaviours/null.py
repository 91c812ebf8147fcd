"""What the same motions look like where nobody reacts to anybody."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.paths import Paths


def repaired(paths: Paths, generator: np.random.Generator) -> Paths:
    """Episodes made up of the motions of several: the predators of one, and each prey from another.

    Every agent keeps its own motion where it was, and meets agents that did not know of it. The prey are parted too,
    each from another episode: as they see predators alone, whatever they do together they do because of them.

    Nobody is shifted. Starts are uniform, so the distances at the start are distributed as in true episodes anyway;
    to put each prey where that of the predators' own episode began would leave a piece of interaction in place, as
    predators first go to where their prey started (up to twice as many made-up episodes then held a chase).

    * Episodes are paired at random among those in which the same prey were caught. As the length of an episode
      hangs on it, the made-up ones are hardly shorter than true ones: not at all where nobody is caught, by some 5 to
      10% where half the prey are.
    * A prey lives as long as it did in its own episode, through predators if need be, and then stays where it was: what
      asks when prey were caught asks whether these times coincide by chance.
    * An episode ends when its predators' did, or when all its prey are caught.
    * Where too few have the same prey caught to give each another partner, they are left out.
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
