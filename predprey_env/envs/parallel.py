"""The world in PettingZoo's parallel API. The environment only translates dictionaries; the rules are elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from predprey_env.agents import PREFIXES, check_agents, read_action
from predprey_env.arrays import Observation, Observations, Picture, State
from predprey_env.config import IDLE, TEAMS, EnvConfig
from predprey_env.envs.fixed import Timed
from predprey_env.envs.inputs import read_seed
from predprey_env.envs.masks import action_mask
from predprey_env.envs.options import Options, read_reset_options
from predprey_env.envs.spaces import SpacesByAgent, action_space, observation_slices, observation_space, state_space
from predprey_env.envs.turn import observe_with, play_turn
from predprey_env.extras import require_pygame
from predprey_env.rendering import text
from predprey_env.rules.dynamics import EVERYBODY, NOBODY, PREDATORS, PREY, World
from predprey_env.rules.starts import draw_starts, given_starts
from predprey_env.sight import AnySight

if TYPE_CHECKING:
    from predprey_env.rendering.viewer import Viewer  # at run time imported when needed, because it imports pygame

RENDER_MODES = ("human", "ansi", "rgb_array")

Info = dict[str, Any]
Step = tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], dict[str, Info]]
"""Observations, rewards, terminations, truncations and infos, by agent."""


class PredPreyEnv(Timed, SpacesByAgent, ParallelEnv[str, Observation, int]):
    """Predators and prey on a torus; :mod:`predprey_env.predprey_v0` is the specification."""

    metadata: ClassVar[dict[str, Any]] = {
        "name": "predprey_v0",
        "render_modes": list(RENDER_MODES),
        "render_fps": 15,
        "is_parallelizable": True,
    }

    def __init__(self, config: EnvConfig | None = None, render_mode: str | None = None) -> None:
        self.render_mode = render_mode
        self._config = config = config or EnvConfig()
        self.possible_agents = [f"predator_{i}" for i in range(config.n_predators)]
        self.possible_agents += [f"prey_{i}" for i in range(config.n_prey)]
        self.agents: list[str] = []

        teams = {agent: team for team in TEAMS for agent in self.possible_agents if agent.startswith(PREFIXES[team])}
        self.observation_spaces = {agent: observation_space(config, team) for agent, team in teams.items()}
        self.action_spaces = {agent: action_space(config, team) for agent, team in teams.items()}
        self.state_space = state_space(config)

        self._index = {agent: i for i, agent in enumerate(self.possible_agents)}
        self._slices = observation_slices(config, config.sight)
        self._n_actions = [int(space.n) for space in self.action_spaces.values()]
        n_predators, n_prey = config.n_predators, config.n_prey
        self._in_turn = {
            EVERYBODY: [1] * config.n_agents,
            PREY: [0] * n_predators + [1] * n_prey,
            PREDATORS: [1] * n_predators + [0] * n_prey,
        }
        self._rules = config.rules
        self._random: tuple[np.random.Generator, int] | None = None
        self._world: World | None = None
        self._actions = np.zeros(config.n_agents, np.int32)
        self._moved = np.full(config.n_agents, IDLE, np.int32)
        self._scores = np.zeros(config.n_agents)
        self._steps = 0
        self._viewer: Viewer | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for a copy or a pickle: everything except the viewer, which holds the window."""
        return self.__dict__ | {"_viewer": None}

    @property
    def render_mode(self) -> str | None:
        """Mode of :meth:`render`: None, or one of ``metadata["render_modes"]``."""
        return self._render_mode

    @render_mode.setter
    def render_mode(self, mode: str | None) -> None:
        if mode is not None and mode not in RENDER_MODES:
            raise ValueError(f"render_mode must be None or one of {', '.join(RENDER_MODES)}, got {mode!r}")
        if mode in ("human", "rgb_array"):
            require_pygame(f'render_mode "{mode}"')
        self._render_mode = mode

    @property
    def np_random(self) -> np.random.Generator:
        """The environment's generator. It is made when first used; copies made before are seeded independently."""
        return self._seeded()[0]

    @property
    def np_random_seed(self) -> int:
        """Seed from which the generator was made."""
        return self._seeded()[1]

    def reset(self, seed: int | None = None, options: Options | None = None) -> tuple[Observations, dict[str, Info]]:
        """Start an episode at random positions, or at ``options={"starts": (n_agents, 2) cells}``."""
        starts = read_reset_options(options, ("starts",)).get("starts")
        given = None if starts is None else given_starts(starts, self.config)
        if (number := read_seed(seed)) is not None:
            self._random = seeding.np_random(number)
        places = draw_starts(self.np_random, 1, self.config)[0] if given is None else given
        self._world = World(places[:, 0].copy(), places[:, 1].copy(), np.ones(self.config.n_prey, np.int32))
        self._moved[:] = IDLE
        self._steps = 0
        self._turn = PREY if self._rules.prey_first else EVERYBODY
        self.agents = self.possible_agents[:]
        observations = self._look(self._world, NOBODY)
        if self._viewer is not None:
            self._viewer.begin(self.config)
        if self.render_mode == "human":
            self.render()
        return observations, self._infos(self.agents)

    def step(self, actions: dict[str, int]) -> Step:
        """Play one step, or half of one if teams move in turns.

        Actions of agents that are caught, absent or not in turn are ignored. After the end, return five empty
        dictionaries.
        """
        if self._world is None:
            raise RuntimeError("reset() must be called before step()")
        if not self.agents:
            return {}, {}, {}, {}, {}
        acting, free, before = self.agents, self._alive, self._fitness
        turn = self._turn
        self._read(actions, free)
        self._steps += turn != PREDATORS
        observations = self._look(self._world, turn)
        if turn != EVERYBODY:
            self._turn = PREDATORS if turn == PREY else PREY

        caught_all = self._over and not any(self._alive)
        at_limit = self._over and not caught_all
        terminations = dict.fromkeys(acting, caught_all)
        if self._config.captured_prey == "removed" and self._alive != free:
            terminations.update({agent: True for agent in acting if self._captured(agent)})
        if self._config.reward == "dense":
            rewards = {agent: self._fitness[i] - before[i] for agent, i in self._rows(acting)}
        elif caught_all or at_limit or True in terminations.values():
            ended = {agent: at_limit or terminations[agent] for agent in acting}
            rewards = {agent: self._fitness[i] if ended[agent] else 0.0 for agent, i in self._rows(acting)}
        else:
            rewards = dict.fromkeys(acting, 0.0)
        infos = self._infos(acting)
        self.agents = [] if at_limit else [agent for agent in acting if not terminations[agent]]
        if self._render_mode == "human":
            self.render()
        return observations, rewards, terminations, dict.fromkeys(acting, at_limit), infos

    def observe_as(self, sight: AnySight) -> Observations:
        """Return what the agents in the game would observe with another sight than that of the world's options."""
        if self._world is None:
            raise RuntimeError("reset() must be called before observe_as()")
        slices = observation_slices(self._config, sight)
        seen = np.empty(slices[-1].stop, np.float32)
        observe_with(self._world, self._moved, self._rules, sight, seen)
        return {agent: seen[slices[i]] for agent, i in self._rows(self.agents)}

    def state(self) -> State:
        """Return the whole state for centralised critics: float32 ``(2 n_agents + n_prey + 1,)``.

        It holds all columns, all rows, which prey are free, and the fraction of the time limit that has passed, at most
        1.
        """
        if self._world is None:
            raise RuntimeError("reset() must be called before state()")
        passed = [min(1.0, self._time / self._rules.max_cycles)]  # max_cycles may have been lowered below the time
        return np.concatenate([*self._world, passed], dtype=np.float32)

    def render(self) -> str | Picture | None:
        """Return the world as text (`ansi`) or as an RGB picture, uint8 ``(height, width, 3)`` (`rgb_array`), or show
        it in a window (`human`).

        Trails connect successive steps that were rendered; steps that were not rendered leave no trail.
        """
        if self._world is None:
            raise RuntimeError("reset() must be called before render()")
        if self.render_mode is None:
            return None
        if self._render_mode == "ansi":
            return text(self._world, self._config, self._steps)
        if self._viewer is None:
            from predprey_env.rendering.viewer import Viewer

            self._viewer = Viewer(self._config, self.metadata["render_fps"])
        if self._render_mode == "rgb_array":
            return self._viewer.frame(self._world, self._time)
        self._viewer.show(self._world, self._time, last=not self.agents)
        return None

    def close(self) -> None:
        """Close the window; further calls do nothing."""
        if self._viewer is not None:
            self._viewer.close()
        self._viewer = None

    def _read(self, actions: dict[str, int], free: list[int]) -> None:
        """Store the actions of the agents that can act.

        Raises :class:`ValueError`, and stores nothing, if an action is missing or wrong.
        """
        check_agents(actions, self._index)
        chosen, in_turn, n_predators = self._actions.tolist(), self._in_turn[self._turn], self._config.n_predators
        for agent, i in self._rows(self.agents):
            if not in_turn[i] or (i >= n_predators and not free[i - n_predators]):
                continue
            chosen[i] = read_action(actions, agent, self._n_actions[i])
        self._actions[:] = chosen

    def _look(self, world: World, turn: int) -> Observations:
        """Play a turn, store its results for the step, and return the observations of the agents in the game."""
        seen = np.empty(self._slices[-1].stop, np.float32)
        over = play_turn(world, self._moved, self._actions, turn, self._steps, self._rules, seen, self._scores)
        self._over = over and turn != PREY  # a time step ends with the predators' turn
        self._alive: list[int] = world.alive.tolist()
        self._fitness: list[float] = self._scores.tolist()
        return {agent: seen[self._slices[i]] for agent, i in self._rows(self.agents)}

    def _rows(self, agents: list[str]) -> list[tuple[str, int]]:
        return [(agent, self._index[agent]) for agent in agents]

    @property
    def _time(self) -> float:
        """Number of steps that have passed, halves included."""
        return self._steps - 0.5 * (self._turn == PREDATORS)

    def _seeded(self) -> tuple[np.random.Generator, int]:
        if self._random is None:
            self._random = seeding.np_random()
        return self._random

    def _saved(self) -> dict[str, Any]:
        """Return everything that a step changes, for :meth:`_restore`."""
        world = self._world and World(*(rows.copy() for rows in self._world))
        state = self._random and self._random[0].bit_generator.state
        return {"attributes": {**self.__dict__, "_world": world, "_moved": self._moved.copy()}, "state": state}

    def _restore(self, saved: dict[str, Any]) -> None:
        self.__dict__.update(saved["attributes"])
        if self._random is not None:
            self._random[0].bit_generator.state = saved["state"]

    def _captured(self, agent: str) -> int:
        prey = self._index[agent] - self._config.n_predators
        return int(prey >= 0 and not self._alive[prey])

    def _infos(self, agents: list[str]) -> dict[str, Info]:
        n_captured, steps, in_turn = self._alive.count(0), self._steps, self._in_turn[self._turn]
        infos: dict[str, Info] = {
            agent: {
                "captured": self._captured(agent),
                "n_captured": n_captured,
                "fitness": self._fitness[i],
                "steps": steps,
                "in_turn": in_turn[i],
            }
            for agent, i in self._rows(agents)
        }
        if self._config.mask_actions:
            for agent, info in infos.items():
                acts = bool(info["in_turn"]) and not info["captured"]
                info["action_mask"] = action_mask(acts, self._n_actions[self._index[agent]])
        return infos
