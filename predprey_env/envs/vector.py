"""Many worlds at once as a Gymnasium vector environment: the caller plays one team, the environment the other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Unpack

import numpy as np
from gymnasium.spaces import Box, Discrete, MultiDiscrete
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from predprey_env.agents import other_team
from predprey_env.arrays import ActionMask, Actions, Members, Observation, Rewards, RowMask, Seeds, Starts, WorldIndices
from predprey_env.config import EnvConfig, EnvParameters, TeamName
from predprey_env.engine import team_rows
from predprey_env.envs.fixed import Opposed, read_only
from predprey_env.envs.inputs import read_actions, read_n_worlds
from predprey_env.envs.many import ManyWorlds
from predprey_env.envs.masks import action_mask
from predprey_env.envs.options import Options
from predprey_env.envs.pictures import NO_PICTURES, Pictured
from predprey_env.envs.results import count, judge, make_counts, make_results
from predprey_env.envs.spaces import action_space, observation_space
from predprey_env.envs.worlds import (
    forget,
    let_member_choose,
    look,
    move_chosen,
    move_opponents,
    move_team,
    with_memory,
    with_views,
    write_actions,
)
from predprey_env.jit.lanes import LANES
from predprey_env.policies.opponents import draw_seed
from predprey_env.policies.outside import Seat, seat
from predprey_env.policies.pool import OpponentPool, Opponents, as_pool
from predprey_env.policies.protocol import memory_rows, sight_of
from predprey_env.settings import spell_out
from predprey_env.tasks import or_default, world

Infos = dict[str, Any]


@spell_out(EnvConfig)
def vector_env(
    n_worlds: int | None = None,
    team: TeamName = "predators",
    opponent: Opponents | None = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    *,
    num_envs: int | None = None,
    task: str | None = None,
    render_mode: str | None = None,
    follow: int | None = None,
    **parameters: Unpack[EnvParameters],
) -> PredPreyVectorEnv:
    """Return ``n_worlds`` worlds in which the caller plays one team, stepped together in compiled code.

    Args:
        n_worlds: Number of worlds; the environment has a row for each agent of the team in each world.
        team: ``"predators"`` or ``"prey"``.
        opponent: Policy of the other team, as in :func:`predprey_env.team_view`. Scripts and evolved teams play in
            compiled code. A policy with ``act_batch`` is called once for all worlds, and reset when all worlds start at
            once. Any other policy is copied for each world, and the copies are called one by one. A function is called
            for each world. From a list, or a :class:`predprey_env.OpponentPool`, each world samples one opponent for
            each episode. The default is a script (:data:`predprey_env.tasks.DEFAULT_OPPONENTS`).
        autoreset_mode: Behaviour after the end of an episode, as in :class:`gymnasium.vector.SyncVectorEnv`.
        num_envs: Another name for ``n_worlds``.
        task: Name of a world in :data:`predprey_env.TASKS`, whose settings the parameters override.
        render_mode: ``"rgb_array"`` to let ``render()`` return pictures; needs the extra ``render``.
        follow: Width in cells of pictures that follow the chase; by default pictures show the whole world.
        parameters: The fields of :class:`predprey_env.EnvConfig`; ``captured_prey`` must be ``"inert"``.
    """
    pictured = Pictured(render_mode, follow)
    n, config = read_n_worlds(n_worlds, num_envs), world(task, parameters)
    return PredPreyVectorEnv(config, n, team, or_default(opponent, team), autoreset_mode, pictured)


class PredPreyVectorEnv(ManyWorlds, Opposed, VectorEnv[Observation, Actions, Rewards]):  # type: ignore[misc] # np_random is read-only
    """Many worlds as a vector environment whose rows are agents: row ``w * n_agents + a`` is agent ``a`` of world
    ``w``.

    A library that knows vector environments can therefore train one policy for all agents of the team without extra
    code: spaces are a plain ``Box`` and a plain ``Discrete``. With one row for each world, the joint action would be a
    ``MultiDiscrete``, which many algorithms do not support. All rows of a world end together.

    Infos are arrays with a number for each row: ``captured`` (of the agent itself), ``n_captured`` and ``steps``, and
    with several opponents ``opponent``, the index of the one that plays in the row's world. With
    ``AutoresetMode.SAME_STEP``, ``final_obs`` holds each row's observation before any reset, from which to bootstrap
    values where ``truncated`` is set, and ``final_info`` holds the infos from before any reset. With
    ``mask_actions=True``, ``action_mask`` is int8 ``(num_envs, n_actions)``.
    """

    team: TeamName = read_only("team")
    num_envs: int = read_only("num_envs")
    single_observation_space: Box = read_only("single_observation_space")
    single_action_space: Discrete = read_only("single_action_space")
    observation_space: Box = read_only("observation_space")
    action_space: MultiDiscrete = read_only("action_space")
    _pool: OpponentPool
    _seats: list[Seat]
    """The members of the pool."""

    def __init__(
        self,
        config: EnvConfig,
        n_worlds: int,
        team: TeamName,
        opponent: Opponents,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        pictured: Pictured = NO_PICTURES,
    ) -> None:
        self._make_worlds(config, n_worlds, autoreset_mode, pictured)
        shape, others = config.team(team), other_team(team)
        self._team = team
        self._num_envs = self.n_worlds * shape.n_agents
        self._single_observation_space = observation_space(config, team)
        self._single_action_space = action_space(config, team)
        self._observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._action_space = batch_space(self.single_action_space, self.num_envs)

        self._in_turns = config.move_order == "prey_first"
        self._rows, self._other_rows = team_rows(config, team), team_rows(config, others)
        self._seat(opponent)
        self._all_rows = np.ones(self.num_envs, np.bool_)  # Gymnasium's mask of each info: all rows have it
        self._all_rows.flags.writeable = False

    def set_opponent(self, opponent: Opponents) -> None:
        """Replace the opponent, or the pool, in all worlds from the next step on; the new opponents are reset first.

        The old opponents stay if a new one cannot play or its ``reset`` raises an exception.
        """
        old = self._pool, self._seats, self._policies
        try:
            self._seat(opponent)
            with self._all_or_nothing():
                if self._over is not None:
                    self._wake()
        except BaseException:
            self._pool, self._seats, self._policies = old
            raise

    def _seat(self, opponents: Opponents) -> None:
        pool, others = as_pool(opponents), other_team(self.team)
        self._seats = [seat(each, others, self.config, self.n_worlds) for each in pool.opponents]
        self._pool, self._policies = pool, tuple(each.policy for each in self._seats)
        n_memory = max(memory_rows(each.player) for each in self._seats)
        self._worlds, self._scratch = with_memory(self._worlds, self._scratch, n_memory)
        self._scratch = with_views(self._scratch, self._rules, [sight_of(each.player) for each in self._seats])

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Options | None = None
    ) -> tuple[Observation, Infos]:
        """Start all worlds, or with ``options={"reset_mask": bool (num_envs,)}`` the worlds whose rows the mask marks.

        World ``w`` is seeded with ``seed + w``, as in Gymnasium, or with ``seed[w]``: runs that are to differ need
        seeds at least ``n_worlds`` apart. ``options={"starts": cells}``, int ``(n_worlds, n_agents, 2)``, places the
        agents of the worlds that start. An option that looks like a misspelling of one of these raises
        :class:`ValueError`; other options are ignored, as they may be meant for wrappers.
        """
        which, given = self._read_options(options, self.num_envs)
        with self._all_or_nothing():
            self._seed(seed, which)
            self._start(which, given)
            self._mark_started(which)
        return self._look(), self._count()

    def step(self, actions: Actions) -> tuple[Observation, Rewards, RowMask, RowMask, Infos]:
        """Play one time step of every world, with an action for each row: int ``(num_envs,)``.

        All worlds stay as they were if an action is wrong, or if the opponent raises an exception or returns no usable
        actions.
        """
        before, n_agents, dense = self._check_ready(), self._rows.n_agents, self.config.reward == "dense"
        chosen = read_actions(actions, self.n_worlds, self._rows.n_agents, self.config.team(self.team).n_actions)
        results = make_results(self.n_worlds, self._rows)
        with self._all_or_nothing():
            move_team(self._worlds, self._rows, self._rules, chosen)
            self._opponents_move()
            if self._autoreset_mode is AutoresetMode.NEXT_STEP and before.any():
                self._start(np.flatnonzero(before))
            judge(self._worlds, self._rows, self._rules, dense, self._scratch, self._scores, results)
            self._over = (results.terminated | results.truncated)[:, 0]
            observations, infos = self._look(), self._count()
            if self._autoreset_mode is AutoresetMode.SAME_STEP and self._over.any():
                ended, final = np.repeat(self._over, n_agents), {"final_obs": observations, "final_info": infos}
                self._start(np.flatnonzero(self._over))
                observations, infos = self._look(), self._count()
                infos |= {**final, "_final_obs": ended, "_final_info": ended}
        rewards, terminated, truncated = (array.ravel() for array in results)
        return observations, rewards, terminated, truncated, infos

    def action_masks(self) -> ActionMask:
        """Return which actions of each row are valid, bool ``(num_envs, n_actions)``, for sb3-contrib's
        ``MaskablePPO``.
        """
        mask: ActionMask = action_mask(self._count()["captured"] == 0, int(self.single_action_space.n))
        return mask.astype(np.bool_)

    @contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        """Leave all worlds as they were if an opponent outside compiled code fails."""
        if not any(seat.outside for seat in self._seats):
            yield
            return
        changing, over, random = [*self._worlds.arrays(), self._scores], self._over, self._random[:]
        saved = [array.copy() for array in changing]
        drawn = [(seeded[0], seeded[0].bit_generator.state) for seeded in random if seeded is not None]
        try:
            yield
        except BaseException:  # including KeyboardInterrupt
            for array, old in zip(changing, saved, strict=True):
                array[:] = old
            self._over, self._random = over, random
            for generator, state in drawn:
                generator.bit_generator.state = state
            raise

    def _wake(self) -> None:
        """Reset new opponents that take over during episodes."""
        every = np.arange(self.n_worlds)
        members, seeds = self._draw_opponents(every)
        self._set_members(every, members)
        forget(self._worlds, seeds)
        self._reset_outside(every, members, seeds)

    def _draw_opponents(self, which: WorldIndices) -> tuple[Members, Seeds]:
        """Sample the opponent of each world, and then its seed, from the world's own generator."""
        drawn = [(self._pool.sample(generator), draw_seed(generator)) for generator in self._generators(which)]
        members, seeds = np.array(drawn, np.int64).reshape(-1, 2).T
        return members, seeds

    def _set_members(self, which: WorldIndices, members: Members) -> None:
        self._worlds.member[which // LANES, 0, which % LANES] = members

    def _members(self) -> Members:
        """Return the index of each world's opponent in the pool."""
        return self._worlds.member[:, 0].ravel()[: self.n_worlds]

    def _reset_outside(self, which: WorldIndices, members: Members, seeds: Seeds) -> None:
        for number, (_, outside, _) in enumerate(self._seats):
            if outside:
                mine = np.ones(len(which), np.bool_) if outside.at_once else members == number
                outside.reset(which[mine], seeds[mine])

    def _opponents_move(self) -> None:
        if len(self._seats) == 1 and not self._seats[0].outside:
            move_opponents(self._worlds, self._other_rows, self._seats[0].player, self._rules, self._scratch)
            return
        playing, members = self._worlds.over[:, 0].ravel()[: self.n_worlds] == 0, self._members()
        for number, (_, outside, player) in enumerate(self._seats):
            mine = playing & (members == number)
            if outside and mine.any():
                look(self._worlds, self._other_rows, self._rules, outside.sight, self._scratch, outside.views)
                write_actions(self._worlds, self._other_rows, mine, outside.act(mine))
            elif mine.any():
                let_member_choose(self._worlds, self._other_rows, player, number, self._rules, self._scratch)
        move_chosen(self._worlds, self._other_rows, self._rules, self._scratch)

    def _start(self, which: WorldIndices, given: Starts | None = None) -> None:
        """Start some worlds, each from its own generator unless starts are given."""
        starts = self._draw_starts(which, given)
        members, seeds = self._draw_opponents(which)
        self._set_members(which, members)
        self._place(which, starts, seeds)
        self._reset_outside(which, members, seeds)
        if self._in_turns and self.team == "predators":
            self._play_first_turn(which)
        self._score(which)

    def _play_first_turn(self, which: WorldIndices) -> None:
        """Let the prey move in the worlds that just started; in the others they stay, as if the episode were over."""
        over = self._worlds.over.copy()
        self._worlds.over[:] = 1
        self._worlds.over[which // LANES, 0, which % LANES] = 0
        try:
            self._opponents_move()
        finally:
            self._worlds.over[:] = over

    def _look(self) -> Observation:
        shape = self.config.team(self.team)
        views = np.empty((self.n_worlds, shape.n_agents, shape.n_seen), np.float32)
        look(self._worlds, self._rows, self._rules, self._rules.sight, self._scratch, views)
        return views.reshape(self.num_envs, -1)

    def _count(self) -> Infos:
        counts = make_counts(self.n_worlds, self._rows)
        count(self._worlds, self._rows, self._rules, counts)
        infos: Infos = {name: array.ravel() for name, array in counts._asdict().items()}
        if self.config.mask_actions:
            infos["action_mask"] = action_mask(infos["captured"] == 0, int(self.single_action_space.n))
        if len(self._seats) > 1:
            infos["opponent"] = np.repeat(self._members().astype(np.int64), self._rows.n_agents)
        return infos | {f"_{name}": self._all_rows for name in infos}
