"""The subpopulations of one team: neurons that evolve apart and are scored together.

Multi-Agent ESP (Yong & Miikkulainen) gives each agent of a team its own network; Multi-Component ESP (section VI.A)
gives each agent several. Every hidden neuron of every network has a subpopulation of its own. All neurons that took
part in a trial share the team's fitness.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Self

import numpy as np

from esp_trainer.algorithm import Spread, restored
from esp_trainer.arrays import Counts, Fitness, Genomes, Indices, MemberIndices, NeuronIndices, StoredArray, TeamGenomes
from esp_trainer.config import EspConfig
from esp_trainer.esp import operators
from esp_trainer.esp.estimates import Estimates
from esp_trainer.esp.signal import Variance
from esp_trainer.networks.controller import Controller
from esp_trainer.types import EvolvedTeams


class Parents(NamedTuple):
    """Parents of the neurons that one generation bred, in ``S`` subpopulations. Slots are indices of neurons."""

    elite: NeuronIndices
    """Slot of each breeding neuron, the first parent of its pair, int ``(S, n_elite)``."""
    mates: NeuronIndices
    """Slot of the mate of each breeding neuron, int ``(S, n_elite)``."""
    past: MemberIndices
    """Place in the hall of fame of the past champion that is the mate instead, for the last ``hof_mates`` pairs: int
    ``(S, hof_mates)``; -1 where there is none."""
    cuts: Counts
    """Number of genes before the cut of each pair, int ``(S, n_elite)``."""
    children: NeuronIndices
    """Slots that the children took, with the children of a pair side by side, int ``(S, 2 * n_elite)``."""


class Subpopulations:
    """The evolving subpopulations of one side: the :class:`~esp_trainer.algorithms.Algorithm` ``esp``.

    Args:
        config: Parameters of ESP.
        controller: The networks of each agent.
        genomes: float32 ``(n_agents, n_networks, n_hidden, subpopulation_size, n_genes)``; see :meth:`start`.
        estimates: Estimates of the neurons from earlier generations; by default empty.
    """

    def __init__(
        self, config: EspConfig, controller: Controller, genomes: Genomes, estimates: Estimates | None = None
    ) -> None:
        n_networks, n_hidden, n_genes = controller.shape
        expected = (n_networks, n_hidden, config.subpopulation_size, n_genes)
        if genomes.shape[1:] != expected:
            raise ValueError(f"genomes must have shape (agents, {', '.join(map(str, expected))}), got {genomes.shape}")
        self.config = config
        self.controller = controller
        self.genomes = np.ascontiguousarray(genomes)  # contiguous: bred in place through reshaped views
        self._used = np.tile(np.repeat(controller.used_genes, n_hidden), len(genomes))  # genes in use
        self.estimates = estimates or Estimates.none(len(self._used), config.subpopulation_size)
        self._asked: Indices | None = None
        self.keeps_parents = False
        """True if :attr:`parents` is filled by :meth:`tell`."""
        self.parents: Parents | None = None
        """Parents of the neurons that were bred last, if they are kept."""

    @classmethod
    def start(cls, config: EspConfig, controller: Controller, n_genomes: int, generator: np.random.Generator) -> Self:
        """Return subpopulations with uniform random genes."""
        n_networks, n_hidden, n_genes = controller.shape
        shape = (n_genomes, n_networks, n_hidden, config.subpopulation_size, n_genes)
        genes = np.empty(shape, np.float32)
        for genome in genes:  # one at a time: sampling takes float64, twice the memory
            genome[:] = generator.uniform(-config.init_range, config.init_range, genome.shape)
        return cls(config, controller, _only_used(genes, controller))

    def ask(self, generator: np.random.Generator) -> EvolvedTeams:
        """Return the teams of a generation's trials: random neurons of each subpopulation, sampled with replacement."""
        if self._asked is not None:
            raise RuntimeError("ask() was called twice; tell() the fitness of the teams first")
        teams = self.draw(generator, self.config.n_trials)
        self._asked = teams.indices
        return teams

    def draw(self, generator: np.random.Generator, n_trials: int) -> EvolvedTeams:
        """Return random teams that will not breed, such as opponents."""
        size, shape = self.config.subpopulation_size, (n_trials, *self.genomes.shape[:3])
        indices = generator.integers(0, size, shape).astype(np.min_scalar_type(size - 1))
        return EvolvedTeams(self.controller, self.genomes, indices)

    def tell(self, fitness: Fitness, champions: TeamGenomes, generator: np.random.Generator) -> float:
        """Breed the next generation. Return the signal of selection, :attr:`~.signal.Signal.share`.

        Args:
            fitness: Fitness of each agent of each asked team, ``(n_trials, n_agents)``; agents that are controlled
                together count with their mean.
            champions: The hall of fame, float32 ``(n_champions, n_agents, n_networks, n_hidden, n_genes)``.
            generator: Random generator for this generation's breeding alone.
        """
        if self._asked is None:
            raise RuntimeError("tell() needs the teams of ask() first")
        n_trials, n_genomes = self._asked.shape[:2]
        expected = (n_trials, n_genomes * self.controller.n_together)
        if fitness.shape != expected:
            raise ValueError(f"fitness must have shape {expected}, got {fitness.shape}")
        if not np.isfinite(fitness).all():
            trial, agent = np.argwhere(~np.isfinite(fitness))[0]
            raise ValueError(f"fitness must be finite, got {fitness[trial, agent]} for agent {agent} in trial {trial}")
        earned = fitness.reshape(n_trials, n_genomes, -1).mean(axis=2)
        chosen = self._asked.reshape(n_trials, n_genomes, -1)
        self._asked = None
        scores, share = self._score(chosen, earned)
        self._breed(operators.ranking(scores), champions, generator)
        return share

    def _score(self, chosen: NeuronIndices, earned: Fitness) -> tuple[Fitness, float]:
        """Return the score of each neuron, ``(S, size)``, and the signal of the generation's trials.

        Args:
            chosen: Index of the neuron that each trial used, int ``(n_trials, n_genomes, S / n_genomes)``.
            earned: Fitness of each genome, ``(n_trials, n_genomes)``.
        """
        config, variance = self.config, Variance()
        remembers = config.memory > 0 or config.prior_trials > 0
        totals, trials = [], []
        for genome in range(earned.shape[1]):
            own = earned[:, genome]
            variance.add(chosen[:, genome], own, config.subpopulation_size)
            # Generations have different opponents: only fitness minus a generation's mean can be added up.
            counted = own - own.mean() if remembers else own
            total, times = operators.sums_by_neuron(chosen[:, genome], counted, config.subpopulation_size)
            totals.append(total)
            trials.append(times)
        now = Estimates(np.concatenate(totals), np.concatenate(trials))
        if not remembers:
            return now.scores(0.0), variance.share()
        self.estimates = self.estimates.after(now.totals, now.trials, config.memory)
        return self.estimates.scores(config.prior_trials), variance.share()

    def _breed(self, ranks: NeuronIndices, champions: TeamGenomes, generator: np.random.Generator) -> None:
        """Pair each elite neuron with a mate, in rank order. The children replace the worst neurons, the last first."""
        config, genes = self.config, self.genomes.reshape(len(ranks), self.config.subpopulation_size, -1)
        each = np.arange(len(ranks))[:, None]
        elite = genes[each, ranks[:, : config.n_elite]]
        mated = operators.draw_mates(generator, len(ranks), config.n_elite, config.mate)
        mates, drawn = elite[each, mated], np.full((len(ranks), config.hof_mates), -1)
        if len(champions) and config.hof_mates:  # the lowest-ranked pairs mate with a past champion's neuron
            drawn = generator.integers(0, len(champions), (len(ranks), config.hof_mates))
            mates[:, -config.hof_mates :] = champions.reshape(len(champions), len(ranks), -1)[drawn, each]
        cuts = operators.draw_cuts(generator, config.n_elite, self._used)
        children = operators.join_at_cuts(elite, mates, cuts)
        mutation = config.mutation_rate, config.mutation_scale, config.mutation_limit
        operators.mutate(generator, children, self._used, *mutation)
        places = ranks[:, : -2 * config.n_elite - 1 : -1]  # the worst neurons, from the bottom up
        genes[each, places] = children
        if config.memory:
            self.estimates = self.estimates.without(places)
        if self.keeps_parents:
            self.parents = Parents(ranks[:, : config.n_elite], ranks[each, mated], drawn, cuts, places)

    def state(self) -> dict[str, StoredArray]:
        """Return the genes, and with ``memory`` the estimates."""
        remembered = {"totals": self.estimates.totals, "trials": self.estimates.trials} if self.config.memory else {}
        return {"genomes": self.genomes, **remembered}

    def restore(self, state: Mapping[str, StoredArray]) -> None:
        """Restore the genes, and with ``memory`` the estimates."""
        self.genomes = restored(state, "genomes", self.genomes)
        if self.config.memory:
            like = self.estimates
            self.estimates = Estimates(restored(state, "totals", like.totals), restored(state, "trials", like.trials))

    def spread(self) -> Spread:
        """Return the diversity, mean over subpopulations, and the scale of the genes that networks read."""
        n_neurons = self.config.subpopulation_size
        weights = np.full(n_neurons, 1 / n_neurons)  # dot products with these are means, and much faster than mean()
        deviations, sizes = [], []
        for genome in self.genomes:
            genes = genome.reshape(-1, n_neurons, genome.shape[-1]).astype(np.float64)
            apart = genes - genes[:, :1]  # relative to one of them, so that the variance loses no digits
            variance = weights @ apart**2 - (weights @ apart) ** 2
            deviations.append(np.sqrt(variance))
            sizes.append(weights @ np.abs(genes))
        read = np.arange(self.genomes.shape[-1]) < self._used[:, None]
        return Spread(*(float(np.concatenate(values)[read].mean()) for values in (deviations, sizes)))

    def burst(self, champion: TeamGenomes, generator: np.random.Generator) -> None:
        """Start all subpopulations again around a champion ``(n_agents, n_networks, n_hidden, n_genes)``.

        The champion's neuron is the first of each subpopulation (burst mutation, Gomez & Miikkulainen 1999).
        """
        spread = operators.truncated_cauchy(
            generator, self.genomes.size, self.config.burst_scale, self.config.mutation_limit
        )
        spread = spread.reshape(self.genomes.shape)
        spread[:, :, :, 0] = 0.0
        self.genomes[:] = champion[:, :, :, None] + _only_used(spread, self.controller)
        self.estimates = Estimates.none(*self.estimates.totals.shape)


def _only_used(genes: Genomes, controller: Controller) -> Genomes:
    """Return genes ``(n_genomes, n_networks, n_hidden, size, n_genes)`` with those that no network reads set to 0."""
    used = np.arange(controller.n_genes) < np.array(controller.used_genes)[:, None]
    return np.where(used[:, None, None], genes, genes.dtype.type(0))
