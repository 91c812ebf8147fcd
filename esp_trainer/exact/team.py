"""A team that plays an equilibrium of a solved game."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from esp_trainer.arrays import MixedStrategy
from esp_trainer.exact.matrix_game import equilibrium
from esp_trainer.exact.solution import Solution, SolutionWork, fill_payoffs, make_solution_work
from esp_trainer.exact.states import Moves, States
from esp_trainer.types import ROLES, Role
from predprey_env.agents import PREFIXES, agent_number, other_team
from predprey_env.arrays import Observation, Observations
from predprey_env.config import EnvConfig
from predprey_env.jit.compilation import entry_point
from predprey_env.sight import PLAIN_SIGHT


class OptimalTeam:
    """A team that plays one side of a solved game optimally.

    It follows the policy protocol: ``reset(seed)``, ``act(observations) -> actions``. A team samples a joint action, so
    all its agents must be asked together, once a step; :func:`predprey_env.team_view`, :func:`predprey_env.vector_env`
    and most loops over :func:`predprey_env.parallel_env` do this. If teams move in turns, the team must be asked only
    in its own. Its samples follow from the seed. The equilibrium of each position is computed when it is met, from the
    values of the next positions.

    Args:
        role: Team that it plays.
        solution: Solution for at least as many steps as an episode can have left.
        n_steps: Number of steps of an episode; by default the time limit of the solved world.
    """

    sight = PLAIN_SIGHT

    def __init__(self, role: Role, solution: Solution, n_steps: int | None = None) -> None:
        config = solution.config
        self.n_steps = config.max_cycles if n_steps is None else n_steps
        if solution.horizon < self.n_steps:
            raise ValueError(f"the game must be solved for {self.n_steps} steps, got {solution.horizon}")
        self.role = role
        self.solution = solution
        self.turn = 0 if role == "prey" else len(solution.turns) - 1
        """Index of the turn of a step in which the team moves."""
        self._rooms = [
            make_solution_work(config.n_predators, n, solution.turns[self.turn]) for n in range(1, config.n_prey + 1)
        ]
        self.reset()

    def __deepcopy__(self, memo: dict[int, Any]) -> OptimalTeam:
        """Return a new player of the same side: the copies in many worlds share the solution."""
        return OptimalTeam(self.role, self.solution, self.n_steps)

    def reset(self, seed: int | None = None) -> None:
        """Start an episode. Both sides may be given the same seed; their samples are independent all the same."""
        self._generator = np.random.default_rng(None if seed is None else (seed, ROLES.index(self.role)))
        self._steps_left = self.n_steps

    def act(self, observations: Observations) -> dict[str, int]:
        """Return an action for each agent of the team, from the offsets that they see.

        The action of a caught prey has no effect.
        """
        others = PREFIXES[other_team(self.role)]
        names = {agent_number(agent): agent for agent in observations if not agent.startswith(others)}
        if not names:
            return {}
        steps_left, self._steps_left = self._steps_left, max(1, self._steps_left - 1)
        cells, prey = self.position({number: observations[agent] for number, agent in names.items()})
        actions = dict.fromkeys(names, 0)
        if prey:
            room, (rows, columns) = self._rooms[len(prey) - 1], self.strategies(cells, steps_left)
            hunting = self.role == "predators"
            joint = room.joints[self._sample(rows)] if hunting else room.flights[self._sample(columns)]
            actions |= dict(zip(range(len(joint)) if hunting else prey, joint.tolist(), strict=True))
        return {names[number]: action for number, action in actions.items()}

    def strategies(self, cells: np.ndarray, steps_left: int) -> tuple[MixedStrategy, MixedStrategy]:
        """Return the probabilities of the predators' joint actions and of the prey's, in the turn of this team.

        ``cells`` are the cells ``size * x + y`` of the predators and of the free prey.
        """
        solution = self.solution
        room = self._rooms[len(cells) - solution.config.n_predators - 1]
        later = solution.values[steps_left * len(solution.turns) - self.turn - 1]
        if np.isnan(_solve(np.asarray(cells, np.int64), solution.states, solution.turns[self.turn], later, room)):
            raise ArithmeticError(f"no equilibrium was found where predators and prey are in cells {cells}")
        return room.work.rows, room.work.columns

    def position(self, seen: dict[int, Observation]) -> tuple[np.ndarray, list[int]]:
        """Return the cells of the predators and the free prey, relative to one agent, and the indices of the free prey.

        ``seen`` maps the index of each agent of the team to its observation.
        """
        config = self.solution.config
        views = {number: np.asarray(view).reshape(-1, 2).astype(np.int64) for number, view in seen.items()}
        if self.role == "prey":
            free = [number for number in sorted(views) if views[number].any()]
            # Offsets of the prey seen from the first predator, as predators observe them.
            prey = [-views[number][0] for number in free]
            predators = [offset + prey[0] for offset in views[free[0]]] if free else []
        else:
            if len(views) != config.n_predators:
                raise ValueError(f"optimal predators must be asked all {config.n_predators} at once, got {len(views)}")
            free = [number for number in range(config.n_prey) if views[0][number].any()]
            prey = [views[0][number] for number in free]
            predators = [prey[0] - views[i][free[0]] for i in range(config.n_predators)] if free else []
        x, y = np.array([*predators, *prey], np.int64).reshape(-1, 2).T % config.size
        return x * config.size + y, free

    def _sample(self, probabilities: MixedStrategy) -> int:
        """Sample an index with the given probabilities."""
        bounds = np.cumsum(probabilities)
        return int(np.searchsorted(bounds, self._generator.random() * bounds[-1], side="right"))


@entry_point
def _solve(cells: Any, states: States, moves: Moves, later: Any, room: SolutionWork) -> float:
    fill_payoffs(cells, states, moves, later, room)
    return equilibrium(room.work)


@dataclass(frozen=True)
class OptimalPlay:
    """Optimal play of either side of a solved game; a :class:`~esp_trainer.types.Contestant`."""

    solution: Solution

    @classmethod
    def load(cls, path: Path | str) -> OptimalPlay:
        """Read the file of a solved game, as :meth:`Solution.load`."""
        return cls(Solution.load(path))

    @property
    def roles(self) -> tuple[Role, ...]:
        """Both roles."""
        return ROLES

    def world(self) -> EnvConfig:
        """Return the solved world."""
        return self.solution.config

    def check_fits(self, role: Role, env: EnvConfig) -> None:  # noqa: ARG002 - both roles fit
        """Raise :class:`ValueError` unless a world has the moves of the solved one."""
        if not self.solution.plays(env):
            raise ValueError(f"optimal play is known for {self.world().changes}, got a match in {env.changes}")

    def policy(self, role: Role, env: EnvConfig) -> OptimalTeam:
        """Return the policy that plays a role optimally in episodes of the world's length."""
        return OptimalTeam(role, self.solution, env.max_cycles)

    def as_teams(self, n_trials: int) -> NoReturn:  # noqa: ARG002
        """Raise :class:`ValueError`: no evaluator plays optimal play in compiled code."""
        raise ValueError("optimal play is not evaluated but solved: esp-trainer solve says its value")
