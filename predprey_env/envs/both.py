"""Many worlds in which the caller plays both teams: dictionaries by agent, with an array for all worlds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias, Unpack

import numpy as np
from gymnasium.spaces import Box, Discrete, Space
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from predprey_env.agents import PREFIXES, check_agents
from predprey_env.arrays import Actions, Starts, State, WorldIndices
from predprey_env.config import TEAMS, EnvConfig, EnvParameters, TeamName
from predprey_env.engine import TeamRows, team_rows
from predprey_env.envs.fixed import read_only
from predprey_env.envs.inputs import read_n_worlds
from predprey_env.envs.many import ManyWorlds
from predprey_env.envs.masks import action_mask
from predprey_env.envs.options import Options
from predprey_env.envs.pictures import NO_PICTURES, Pictured
from predprey_env.envs.results import count, judge, make_counts, make_results
from predprey_env.envs.spaces import action_space, observation_space, state_space
from predprey_env.envs.worlds import look, move_given, move_team
from predprey_env.settings import spell_out, whole_numbers
from predprey_env.tasks import world

ByAgent: TypeAlias = dict[str, np.ndarray]
"""An array for each agent, whose first axis is the worlds."""
InfosByAgent: TypeAlias = dict[str, dict[str, np.ndarray]]


@spell_out(EnvConfig)
def parallel_vector_env(
    n_worlds: int | None = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
    *,
    num_envs: int | None = None,
    task: str | None = None,
    render_mode: str | None = None,
    follow: int | None = None,
    **parameters: Unpack[EnvParameters],
) -> ParallelVectorEnv:
    """Return ``n_worlds`` worlds in which the caller plays both teams, stepped together in compiled code.

    Args:
        n_worlds: Number of worlds.
        num_envs: Another name for ``n_worlds``.
        task: Name of a world in :data:`predprey_env.TASKS`, whose settings the parameters override.
        autoreset_mode: Behaviour after the end of an episode, as in :class:`gymnasium.vector.SyncVectorEnv`. The
            default is what AgileRL's vector environments do: a world starts again in the step in which it ends.
        render_mode: ``"rgb_array"`` to let ``render()`` return pictures; needs the extra ``render``.
        follow: Width in cells of pictures that follow the chase; by default pictures show the whole world.
        parameters: The fields of :class:`predprey_env.EnvConfig`; ``captured_prey`` must be ``"inert"``, and
            ``move_order`` ``"simultaneous"``.
    """
    pictured = Pictured(render_mode, follow)
    return ParallelVectorEnv(world(task, parameters), read_n_worlds(n_worlds, num_envs), autoreset_mode, pictured)


class ParallelVectorEnv(ManyWorlds):
    """Many worlds in PettingZoo's parallel API: each dictionary of :class:`predprey_env.PredPreyEnv` holds, for each
    agent, an array over the worlds instead of a number.

    Methods and attributes have the names and shapes of AgileRL's ``PettingZooVecEnv``. :meth:`state` holds the whole
    state of each world for centralised critics. All agents of a world end together; after the end, worlds start again
    as in :class:`predprey_env.PredPreyVectorEnv`.

    Infos hold, for each agent, ``captured``, ``n_captured`` and ``steps``, int64 ``(n_worlds,)``, and with
    ``mask_actions=True`` ``action_mask``, int8 ``(n_worlds, n_actions)``. With
    ``AutoresetMode.SAME_STEP``, in a step in which a world ended they also hold ``final_obs``, the observation before
    any reset, and ``_final_obs``, bool ``(n_worlds,)``, which marks the worlds that ended. :attr:`final_state` is the
    state before any reset.
    """

    num_envs: int = read_only("num_envs", kept="_n_worlds")
    possible_agents: list[str] = read_only("possible_agents")
    agents: list[str] = read_only("agents", kept="_possible_agents")
    observation_spaces: dict[str, Box] = read_only("observation_spaces")
    action_spaces: dict[str, Discrete] = read_only("action_spaces")
    state_space: Box = read_only("state_space")

    def __init__(
        self,
        config: EnvConfig,
        n_worlds: int,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        pictured: Pictured = NO_PICTURES,
    ) -> None:
        if config.move_order != "simultaneous":
            raise ValueError(
                f"with both teams in one vector env move_order must be 'simultaneous', got {config.move_order!r}"
            )
        self._make_worlds(config, n_worlds, autoreset_mode, pictured)
        self._metadata["name"] = "predprey_parallel_vector_v0"
        self._names = {team: [f"{PREFIXES[team]}{i}" for i in range(config.team(team).n_agents)] for team in TEAMS}
        self._possible_agents = [agent for team in TEAMS for agent in self._names[team]]
        self._observation_spaces = {agent: observation_space(config, team) for team, agent in self._seats()}
        self._action_spaces = {agent: action_space(config, team) for team, agent in self._seats()}
        self._state_space = state_space(config)
        self._shapes = {team: config.team(team) for team in TEAMS}
        self._rows = {team: team_rows(config, team) for team in TEAMS}
        self._everybody = TeamRows(0, config.n_agents)
        self._final_state: State | None = None  # None where no world started again in the last step

    def _seats(self) -> list[tuple[TeamName, str]]:
        return [(team, agent) for team in TEAMS for agent in self._names[team]]

    def single_observation_space(self, agent: str) -> Box:
        """Return an agent's observation space in one world."""
        return self.observation_spaces[agent]

    def single_action_space(self, agent: str) -> Discrete:
        """Return an agent's action space in one world."""
        return self.action_spaces[agent]

    def observation_space(self, agent: str) -> Space[Any]:
        """Return the space of an agent's observations in all worlds."""
        return batch_space(self.observation_spaces[agent], self.n_worlds)

    def action_space(self, agent: str) -> Space[Any]:
        """Return the space of an agent's actions in all worlds."""
        return batch_space(self.action_spaces[agent], self.n_worlds)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Options | None = None
    ) -> tuple[ByAgent, InfosByAgent]:
        """Start all worlds, or with ``options={"reset_mask": bool (n_worlds,)}`` the worlds that the mask marks.

        Seeds and ``options={"starts": cells}`` are as in :meth:`predprey_env.PredPreyVectorEnv.reset`.
        """
        which, given = self._read_options(options, self.n_worlds)
        self._seed(seed, which)
        self._start(which, given)
        self._mark_started(which)
        return self._look(), self._count()

    def step(self, actions: Mapping[str, Actions]) -> tuple[ByAgent, ByAgent, ByAgent, ByAgent, InfosByAgent]:
        """Play one time step of every world, with actions for each agent: int ``(n_worlds,)``.

        Returns observations, float32 ``(n_worlds, n_seen)``, rewards, terminations, truncations and infos by agent. If
        an action is wrong, all worlds stay as they were.
        """
        before, dense = self._check_ready(), self.config.reward == "dense"
        check_agents(actions, self._possible_agents)
        predators, prey = (self._read_actions(actions, team) for team in TEAMS)
        move_team(self._worlds, self._rows["predators"], self._rules, predators)
        move_given(self._worlds, self._rows["prey"], self._rules, self._scratch, prey)
        if self._autoreset_mode is AutoresetMode.NEXT_STEP and before.any():
            self._start(np.flatnonzero(before))
        results = make_results(self.n_worlds, self._everybody)
        judge(self._worlds, self._everybody, self._rules, dense, self._scratch, self._scores, results)
        self._over = over = (results.terminated | results.truncated)[:, 0]
        self._final_state = None
        observations, infos = self._look(), self._count()
        if self._autoreset_mode is AutoresetMode.SAME_STEP and over.any():
            final, self._final_state = observations, self.state()
            self._start(np.flatnonzero(over))
            observations, infos = self._look(), self._count()
            for agent, info in infos.items():
                info |= {"final_obs": final[agent], "_final_obs": over}
        rewards, terminated, truncated = (self._by_agent(array) for array in results)
        return observations, rewards, terminated, truncated, infos

    def state(self) -> State:
        """Return the whole state of each world, float32 ``(n_worlds, n_state)``, as :meth:`PredPreyEnv.state`."""
        if self._over is None:
            raise RuntimeError("reset() must be called before state()")
        blocks = self._worlds.blocks
        rows = [array.swapaxes(1, 2).reshape(-1, array.shape[1]) for array in (*blocks.world, blocks.clock)]
        state = np.concatenate(rows, axis=1, dtype=np.float32)[: self.n_worlds]
        state[:, -1] = np.minimum(1, rows[-1][: self.n_worlds, 0] / self.max_cycles)
        return state

    @property
    def final_state(self) -> State:
        """The state of each world after the last step and before any reset, float32 ``(n_worlds, n_state)``."""
        return self.state() if self._final_state is None else self._final_state

    def close(self) -> None:
        """Do nothing: there is nothing to close."""

    def _read_actions(self, actions: Mapping[str, Any], team: TeamName) -> Actions:
        """Return a team's actions, int32 ``(n_worlds, n_agents)``."""
        names, n_actions = self._names[team], self._shapes[team].n_actions
        chosen = np.empty((self.n_worlds, len(names)), np.int64)
        for i, agent in enumerate(names):
            if agent not in actions:
                raise ValueError(f"actions for {agent} are missing")
            chosen[:, i] = whole_numbers(f"actions for {agent}", actions[agent], (self.n_worlds,))
        if chosen.min() < 0 or chosen.max() >= n_actions:
            agent, row = next(
                (a, r) for a, r in zip(names, chosen.T, strict=True) if not 0 <= r.min() <= r.max() < n_actions
            )
            raise ValueError(f"actions for {agent} must be in 0..{n_actions - 1}, got {row.min()} to {row.max()}")
        return chosen.astype(np.int32)

    def _start(self, which: WorldIndices, given: Starts | None = None) -> None:
        self._place(which, self._draw_starts(which, given), np.zeros(len(which), np.int64))
        self._score(which)

    def _look(self) -> ByAgent:
        seen: ByAgent = {}
        for team in TEAMS:
            shape = self._shapes[team]
            views = np.empty((self.n_worlds, shape.n_agents, shape.n_seen), np.float32)
            look(self._worlds, self._rows[team], self._rules, self._rules.sight, self._scratch, views)
            seen |= {agent: views[:, i] for i, agent in enumerate(self._names[team])}
        return seen

    def _count(self) -> InfosByAgent:
        infos: InfosByAgent = {}
        for team in TEAMS:
            rows = self._rows[team]
            counts = make_counts(self.n_worlds, rows)
            count(self._worlds, rows, self._rules, counts)
            for i, agent in enumerate(self._names[team]):
                infos[agent] = {name: array[:, i] for name, array in counts._asdict().items()}
                if self.config.mask_actions:
                    infos[agent]["action_mask"] = action_mask(
                        infos[agent]["captured"] == 0, self._shapes[team].n_actions
                    )
        return infos

    def _by_agent(self, array: np.ndarray) -> ByAgent:
        return {agent: array[:, i] for i, agent in enumerate(self._possible_agents)}
