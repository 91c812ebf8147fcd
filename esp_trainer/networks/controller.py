"""A controller: the networks of an agent, and how their outputs become an action."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from predprey_env.sight import AnySight


class Controller(NamedTuple):
    """Parameters of the networks that turn an agent's observation into an action, in types that compiled code reads."""

    n_networks: int
    """Number of networks that read the observation."""
    n_inputs: int
    """Number of inputs of each network that reads the observation, without the bias."""
    network: Any
    """Kind of all networks, a :class:`~esp_trainer.networks.protocol.Network`: the rule by which they compute, and
    their size."""
    bias: bool
    logistic_output: bool
    draws: bool
    """True if the action is sampled with probabilities given by the votes; False if the most votes win."""
    skip_silent: bool
    """True if a network whose inputs are all zero (its opponent is caught) has no vote."""
    input_scale: np.float32
    """Factor on the observation, in 1/cells."""
    combines: bool
    """True if a further network, the combiner, reads the outputs of the others and decides; False if outputs are
    summed."""
    n_together: int
    """Number of agents that one set of networks controls: 1, or the whole team for a central controller. A central
    controller reads the concatenated observations of all agents, and its neurons have output weights for each."""
    sight: AnySight
    """Observation of the agents."""
    wiring: np.ndarray
    """int64 ``(n_networks, n_inputs)``: indices of the observation entries that each network reads."""

    @property
    def n_hidden(self) -> int:
        """Number of hidden neurons of each network."""
        return int(self.network.n_hidden)

    @property
    def n_genes(self) -> int:
        """Length of a gene string in the genome; those of networks that need fewer genes are padded with zeros."""
        return int(self.network.n_genes)

    @property
    def n_actions(self) -> int:
        """Number of actions."""
        return len(self.network.blank)

    @property
    def n_memory(self) -> int:
        """Number of rows of memory of an agent: a random state, and what its networks remember."""
        return 1 + len(self.fan_in) * int(self.network.n_memory)

    @property
    def remembers(self) -> bool:
        """True if the action depends on earlier steps."""
        return bool(self.network.n_memory > 0)

    @property
    def fan_in(self) -> tuple[int, ...]:
        """Number of inputs of each network of the genome, without the bias; the combiner comes last."""
        combiner = (self.n_networks * self.n_actions,) if self.combines else ()
        return (self.n_inputs,) * self.n_networks + combiner

    @property
    def used_genes(self) -> tuple[int, ...]:
        """Number of genes of a neuron that each network of the genome reads."""
        n_outputs, n_hidden = self.n_together * self.n_actions, self.n_hidden
        return tuple(int(self.network.genes(n + int(self.bias), n_outputs, n_hidden)) for n in self.fan_in)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of one genome: ``(n_networks, n_hidden, n_genes)``, including the combiner."""
        return len(self.fan_in), self.n_hidden, self.n_genes

    def n_genomes(self, n_agents: int) -> int:
        """Return the number of genomes of a team: one for each agent, or one for all if the controller is central."""
        return n_agents // self.n_together

    @property
    def n_seen(self) -> int:
        """Length of one agent's observation, up to the last entry that a network reads."""
        return (int(self.wiring.max()) + 1) // self.n_together

    @property
    def n_votes(self) -> int:
        """Number of rows that compiled code needs for the outputs of the networks."""
        return self.n_actions * (self.n_networks if self.combines else 1)
