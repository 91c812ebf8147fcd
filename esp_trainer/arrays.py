"""Names for arrays, so that a signature says what it takes and returns.

The docstring of each alias gives dtype and shape. ``...`` stands for any axes; where they matter, the docstring of the
function or the field names them. Arrays that the environment uses too are named in :mod:`predprey_env.arrays`.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

# Genes

Genomes: TypeAlias = np.ndarray
"""float32 ``(n_agents, n_networks, n_hidden, n_candidates, n_genes)``: for each hidden neuron of each network of each
agent, a subpopulation of candidate neurons. A gene string is the neuron's input weights, its bias if there is one, and
its output weights (section V). A central controller counts as one agent."""

TeamGenomes: TypeAlias = np.ndarray
"""Genomes of the agents of one team, float32 ``(n_agents, n_networks, n_hidden, n_genes)``, or of several teams, with
an axis for the teams before these. A central controller counts as one agent."""

TeamVector: TypeAlias = np.ndarray
"""The genes of a whole team that its networks read, in one row: float32 or float64 ``(n_parameters,)``."""

TeamVectors: TypeAlias = np.ndarray
"""A :data:`TeamVector` for each team of a population: float32 or float64 ``(n_teams, n_parameters)``."""

# Indices

Indices: TypeAlias = np.ndarray
"""int ``(n_trials, n_agents, n_networks, n_hidden)``: index of the candidate that each hidden neuron of each trial's
team is. Indices take most of the memory of a trial, so those of a generation have the smallest type that holds them."""

NeuronIndices: TypeAlias = np.ndarray
"""Indices of neurons within their subpopulations: integers ``(...)``."""

MemberIndices: TypeAlias = np.ndarray
"""Indices of members of a hall of fame, guests first: integers ``(...)``."""

GenerationIndices: TypeAlias = np.ndarray
"""Indices of generations, integers: ``(n,)`` unless the docstring says otherwise."""

# Trials and episodes

Fitness: TypeAlias = np.ndarray
"""Fitness, or a sum or mean of it: float64 ``(...)``; higher is better."""

EpisodeStarts: TypeAlias = np.ndarray
"""Start of each episode. In the predator-prey world the cells of all agents, int32 ``(n_trials, n_episodes, n_agents,
2)``; in another game a seed, int64 ``(n_trials, n_episodes)``. The starts of one trial lack the first axis, a single
start lacks both."""

EpisodePayoffs: TypeAlias = np.ndarray
"""Payoff of each episode to the predators, or to the first team of another game: float64 ``(n_trials, n_episodes)``."""

Steps: TypeAlias = np.ndarray
"""Time steps, integers: the length of each episode, ``(..., n_episodes)``, or the step in which each prey is caught,
``(..., n_prey)``."""

Cells: TypeAlias = np.ndarray
"""Cells of agents, x and y, int32 ``(..., n_rows, n_agents, 2)``: row 0 is the start, row ``t`` is after step ``t``.
Unwrapped cells are int64."""

# Measurements

PayoffMatrix: TypeAlias = np.ndarray
"""Mean payoff of each pairing of a team with an opponent, float64 ``(G, H)``. Unless the docstring says otherwise, rows
are predators, columns are prey, and it is the payoff to the predators: the fraction of prey caught, or that of another
game."""

PayoffVariance: TypeAlias = np.ndarray
"""Sampling variance of each entry of a :data:`PayoffMatrix`, float64 ``(G, H)``; nan where it is unknown."""

MixedStrategy: TypeAlias = np.ndarray
"""Probability of each strategy of a matrix game, float64 ``(..., n_strategies)``; the last axis sums to 1."""

Curve: TypeAlias = np.ndarray
"""Values by generation, oldest first: float64 ``(n_generations,)``, or ``(n_generations, ...)`` for several values."""

CurvesOfRuns: TypeAlias = np.ndarray
"""A :data:`Curve` for each run, float64 ``(n_runs, n_generations)``."""

SeedValues: TypeAlias = np.ndarray
"""A value for each of several runs that differ only in their seeds: float64 ``(n_runs,)``."""

# Exact solution

StateValues: TypeAlias = np.ndarray
"""Expected number of prey caught from each state of the game, or from each key: float64 ``(..., n_states)``."""

ActionProbabilities: TypeAlias = np.ndarray
"""Probability of each action, float32 or float64 ``(..., n_actions)``; the last axis sums to 1."""

# Of any shape

StoredArray: TypeAlias = np.ndarray
"""An array of a file or of an algorithm's state: numbers of any dtype and shape."""

BoolMask: TypeAlias = np.ndarray
"""True where a condition holds: bool ``(...)``."""

Counts: TypeAlias = np.ndarray
"""Counts of prey, episodes, genes and so on: integers ``(...)``."""

Fractions: TypeAlias = np.ndarray
"""Numbers from 0 to 1, or nan where unknown: float64 ``(...)``."""
