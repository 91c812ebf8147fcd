"""A team that plays an equilibrium of a solved game."""

from __future__ import annotations

from typing import Any

import numpy as np

from esp_trainer.exact.matrix_game import Workspace, equilibrium, make_workspace
from esp_trainer.exact.solution import Solution, fill_payoffs
from esp_trainer.exact.states import Moves, States
from esp_trainer.types import ROLES, Role
from predprey_env.compilation import entry_point
from predprey_env.policies.names import PREFIXES, agent_number, other_team


class OptimalTeam:
    """Plays one side of a solved game of simultaneous moves, optimally.

    Meets the policy protocol: ``reset(seed)``, ``act(observations) -> actions``. Predators draw their joint action, so
    they must be asked together, as :func:`predprey_env.parallel_env` and :func:`predprey_env.team_view` do. What is
    drawn follows from the seed. The equilibrium is worked out anew for each position, from the values of the next.

    Args:
        role: Whom it plays.
        solution: For as many steps at least as an episode can have left.
        n_steps: Steps of an episode; by default the time limit of the solved world.
    """

    def __init__(self, role: Role, solution: Solution, n_steps: int | None = None) -> None:
        config = solution.config
        self.n_steps = config.max_cycles if n_steps is None else n_steps
        if config.move_order != "simultaneous":
            raise ValueError(f"optimal teams play games of simultaneous moves, got {config.move_order}")
        if solution.horizon < self.n_steps:
            raise ValueError(f"the game must be solved for {self.n_steps} steps, got {solution.horizon}")
        self.role = role
        self.solution = solution
        self._work = make_workspace(config.n_predator_actions**config.n_predators, config.n_prey_actions)
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Start an episode. Both sides may be given the same seed, and draw apart nevertheless."""
        self._generator = np.random.default_rng(None if seed is None else (seed, ROLES.index(self.role)))
        self._steps_left = self.n_steps

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        """An action for each agent of the team, from the offsets that they see."""
        seen = {agent: view for agent, view in observations.items() if not agent.startswith(self._others)}
        if not seen:
            return {}
        rows, columns = self.strategies(self.cells(seen), self._steps_left)
        self._steps_left = max(1, self._steps_left - 1)
        if self.role == "prey":
            return dict.fromkeys(seen, self._draw(columns))
        n_predators, n_actions = self.solution.config.n_predators, self.solution.config.n_predator_actions
        joint = np.unravel_index(self._draw(rows), (n_actions,) * n_predators)
        return {agent: int(joint[agent_number(agent)]) for agent in seen}

    def strategies(self, cells: np.ndarray, steps_left: int) -> tuple[np.ndarray, np.ndarray]:
        """Chances of the predators' joint actions and of the prey's actions in a state, by the predators' cells."""
        solution = self.solution
        _strategies(cells, solution.states, solution.moves, solution.values[steps_left - 1], self._work)
        return self._work.rows, self._work.columns

    @property
    def _others(self) -> str:
        return PREFIXES[other_team(self.role)]

    def cells(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Where the predators are, seen from the prey."""
        config = self.solution.config
        if self.role == "prey":
            (view,) = seen.values()
            offsets = np.asarray(view).reshape(-1, 2)
        else:
            if len(seen) != config.n_predators:
                raise ValueError(f"optimal predators must be asked all {config.n_predators} at once, got {len(seen)}")
            offsets = -np.stack([seen[agent] for agent in sorted(seen, key=agent_number)])
        x, y = offsets.astype(np.int64).T % config.size
        return np.asarray(x * config.size + y, np.int32)

    def _draw(self, chances: np.ndarray) -> int:
        """An index, with those chances."""
        bounds = np.cumsum(chances)
        return int(np.searchsorted(bounds, self._generator.random() * bounds[-1], side="right"))


@entry_point
def _strategies(cells: Any, states: States, moves: Moves, later: Any, work: Workspace) -> None:
    fill_payoffs(cells, states, moves, later, work)
    equilibrium(work)
