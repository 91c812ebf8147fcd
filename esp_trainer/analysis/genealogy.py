"""The origin of every gene: the founder it descends from, and the past champions it came through.

Founders are the neurons of the first generation. A child has genes of two parents, cut at a known place, and a mutated
gene keeps its origin. So the origins follow exactly from the parents of every neuron, which a run keeps with
``genealogy``. A past champion that mates (``esp.hof_mates``) brings back genes as they were in its generation: the
generations since then are skipped.

``S`` subpopulations have ``P`` neurons of ``G`` genes each; ``T`` is the number of generations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from esp_trainer.arrays import BoolMask, Counts, Curve, Fractions, GenerationIndices, NeuronIndices
from esp_trainer.esp.operators import join_at_cuts
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.genealogy import Layout, evolving, read_genealogy
from esp_trainer.types import Role

NEVER = -1
"""Generation that stands for no past champion."""


class Origins(NamedTuple):
    """Origins of genes, three arrays of the same shape."""

    founder: NeuronIndices
    """Slot of the gene's ancestor in generation 0, int."""
    past: GenerationIndices
    """Generation of the past champion that the gene came through last; :data:`NEVER` if it came through none."""
    skipped: Counts
    """Number of generations that the gene's line skipped in the hall of fame, int. In all others it was bred."""

    def each(self, change: Callable[[np.ndarray], np.ndarray]) -> Origins:
        """Apply a function to each array."""
        return Origins(*map(change, self))


class Ancestry(NamedTuple):
    """The ancestry of one champion."""

    founders: Fractions
    """Fraction of the genes of each neuron by founder, float64 ``(S, P)``; a row sums to 1."""
    past: dict[int, float]
    """Fraction of all genes by the generation of the past champion they came through last, or :data:`NEVER`."""


class Leading(NamedTuple):
    """The founder from which most genes of each of a champion's neurons descend, three arrays ``(T, S)``."""

    founder: NeuronIndices
    """Slot of the founder in generation 0, int; the lowest of several that gave the same number of genes."""
    share: Fractions
    """Fraction of the neuron's genes that descend from it, float64."""
    from_past: Fractions
    """Fraction of the neuron's genes, of any founder, that came through a past champion, float64."""

    def takeovers(self) -> BoolMask:
        """Return where the founder differs from that of the generation before, bool ``(T - 1, S)``."""
        return np.asarray(self.founder[1:] != self.founder[:-1])


@dataclass(frozen=True)
class Genealogy:
    """Origins of the genes of one side, by generation."""

    layout: Layout
    founders: Curve
    """Effective number of founders at a place of the gene string: one over the sum of squares of their fractions among
    the neurons; mean over places and subpopulations, float64 ``(T,)``."""
    from_past: Curve
    """Fraction of all genes that came through a past champion, float64 ``(T,)``."""
    skipped: Curve
    """Number of generations that the line of a gene skipped, mean over all genes, float64 ``(T,)``."""
    champions: Origins
    """Origins of the genes of each generation's champion, ``(T, S, G)``."""

    def __len__(self) -> int:
        return len(self.founders)

    def ancestry(self, generation: int) -> Ancestry:
        """Return the ancestry of a generation's champion."""
        is_read, size = _read(self.layout), self.layout.size
        which = np.repeat(np.arange(len(is_read)), self.layout.used)
        counts = np.bincount(which * size + self.champions.founder[generation][is_read], minlength=len(is_read) * size)
        through, times = np.unique(self.champions.past[generation][is_read], return_counts=True)
        return Ancestry(
            counts.reshape(-1, size) / np.array(self.layout.used)[:, None],
            dict(zip(through.tolist(), (times / times.sum()).tolist(), strict=True)),
        )

    def leading(self) -> Leading:
        """Return the founder with the most genes in each neuron of each champion."""
        is_read = _read(self.layout)
        shares = np.stack([self.ancestry(generation).founders for generation in range(len(self))])
        through = ((self.champions.past != NEVER) & is_read).sum(axis=2) / is_read.sum(axis=1)
        return Leading(shares.argmax(axis=2), shares.max(axis=2), through)

    def first(self, n: int) -> Genealogy:
        """Return the first ``n`` generations."""
        curves = (self.founders[:n], self.from_past[:n], self.skipped[:n])
        return Genealogy(self.layout, *curves, self.champions.each(lambda values: values[:n]))


def of_run(run: Path) -> dict[Role, Genealogy]:
    """Return the genealogy of each evolving side of a run; empty if the run keeps no parents.

    Raises:
        FileNotFoundError: There is no run, or a file is not there.
        DamagedFileError: A file is damaged.
    """
    directory = RunDirectory(run)
    return {role: trace(*read_genealogy(directory.genealogy_file(role))) for role in evolving(directory.read_config())}


def trace(layout: Layout, records: np.ndarray) -> Genealogy:
    """Return the genealogy of one side from the records of its generations."""
    n, is_read = len(records), _read(layout)
    founders, from_past, skipped = np.zeros((3, n))
    champions = Origins(*np.zeros((3, n, *is_read.shape), np.int32))
    for number, (genes, champion) in enumerate(replay_origins(layout, records)):
        genes = genes.each(lambda values: values.swapaxes(1, 2)[is_read])  # of each place that is read, (n_places, P)
        founders[number] = _effective(genes.founder)
        from_past[number], skipped[number] = (genes.past != NEVER).mean(), genes.skipped.mean()
        for kept, values in zip(champions, champion, strict=True):
            kept[number] = values
    return Genealogy(layout, founders, from_past, skipped, champions)


def replay_origins(layout: Layout, records: np.ndarray) -> Iterator[tuple[Origins, Origins]]:
    """Yield, for each generation, the origins of all genes ``(S, P, G)`` and of its champion's genes ``(S, G)``.

    The next generation overwrites the arrays.
    """
    n_subpopulations, n_genes = _read(layout).shape
    shape, each = (n_subpopulations, layout.size, n_genes), np.arange(n_subpopulations)
    founder = np.broadcast_to(np.arange(layout.size, dtype=np.int32)[:, None], shape).copy()
    genes = Origins(founder, np.full(shape, NEVER, np.int32), np.zeros(shape, np.int32))
    champions = Origins(*np.zeros((3, len(records), n_subpopulations, n_genes), np.int32))
    for number, record in enumerate(records):
        for kept, values in zip(champions, genes, strict=True):
            kept[number] = values[each, record["champion"]]
        champion = champions.each(lambda kept: kept[number])  # noqa: B023  # called at once
        yield genes, champion
        _breed(genes, record, champions)
        if record["burst"]:
            for values, of_champion in zip(genes, champion, strict=True):
                values[:] = of_champion[:, None]


def _breed(genes: Origins, record: np.void, champions: Origins) -> None:
    """Update the origins of the neurons that a generation's children replaced, in place."""
    each, generation, past = np.arange(len(record["elite"]))[:, None], int(record["generation"]), record["past"]
    pairs = np.nonzero(past != NEVER)  # subpopulation, and place among the last pairs
    met = past[pairs]
    from_past = champions.each(lambda kept: kept[met, pairs[0]])
    from_past = from_past._replace(
        past=np.broadcast_to(met[:, None], from_past.past.shape),
        skipped=from_past.skipped + (generation - met)[:, None],
    )
    last = record["mates"].shape[1] - past.shape[1]
    for values, brought in zip(genes, from_past, strict=True):
        mates = values[each, record["mates"]]
        mates[pairs[0], last + pairs[1]] = brought
        values[each, record["children"]] = join_at_cuts(values[each, record["elite"]], mates, record["cuts"])


def _read(layout: Layout) -> BoolMask:
    """Return which genes a network reads, bool ``(S, G)``."""
    return np.arange(max(layout.used)) < np.array(layout.used)[:, None]


def _effective(founder: NeuronIndices) -> float:
    """Return the effective number of founders at a place, mean over the places of ``founder``, int ``(n, P)``."""
    n, size = founder.shape
    counts = np.bincount((founder + size * np.arange(n)[:, None]).ravel(), minlength=n * size).reshape(n, size)
    return float((size**2 / (counts**2).sum(axis=1)).mean())
