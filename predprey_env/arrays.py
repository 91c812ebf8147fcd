"""Names for arrays, so that a signature says what a function takes and returns."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

Observation: TypeAlias = np.ndarray
"""An agent's observation: float32 ``(n_seen,)``; in many worlds ``(rows, n_seen)``, a row for each agent or world."""
Observations: TypeAlias = dict[str, Observation]
"""The observation of each agent, by name."""
State: TypeAlias = np.ndarray
"""Global state for a centralised critic: float32 ``(n_state,)``; in many worlds ``(n_worlds, n_state)``."""
Actions: TypeAlias = np.ndarray
"""Action indices, integers: ``(rows,)``, a row for each agent or world, or ``(n_worlds, n_agents)``."""
Rewards: TypeAlias = np.ndarray
"""float64 ``(rows,)``, a row for each agent."""
RowMask: TypeAlias = np.ndarray
"""A flag for each agent: bool ``(rows,)``."""
WorldIndices: TypeAlias = np.ndarray
"""Indices of worlds: int64 ``(n,)``."""
WorldMask: TypeAlias = np.ndarray
"""A flag for each world: bool ``(n_worlds,)``."""
Starts: TypeAlias = np.ndarray
"""Cells where agents start, predators first: int32 ``(..., n_agents, 2)``, x and y."""
Seeds: TypeAlias = np.ndarray
"""A seed for each of ``n`` worlds: int64 ``(n,)``."""
Members: TypeAlias = np.ndarray
"""Index in the opponent pool of the opponent in each of ``n`` worlds: integers ``(n,)``."""
ActionMask: TypeAlias = np.ndarray
"""1 for each valid action: int8 or bool ``(..., n_actions)``."""
Picture: TypeAlias = np.ndarray
"""Red, green and blue: uint8 ``(height, width, 3)``."""
Places: TypeAlias = np.ndarray
"""Points of a picture or of the torus, x and y: ``(n, 2)``, or one ``(2,)``."""
