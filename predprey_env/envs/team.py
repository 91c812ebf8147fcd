"""An environment of one team, which plays the other team itself."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar, Unpack

from pettingzoo import ParallelEnv

from predprey_env.agents import PREFIXES, check_agents, other_team, read_action
from predprey_env.arrays import Observation, Observations, State
from predprey_env.config import EnvConfig, EnvParameters, TeamName
from predprey_env.envs.fixed import Around, Opposed, read_only
from predprey_env.envs.options import Options
from predprey_env.envs.parallel import Info, PredPreyEnv, Step
from predprey_env.envs.spaces import SpacesByAgent
from predprey_env.policies.opponents import as_policy, ask, draw_seed, own_copy, sight_in
from predprey_env.policies.pool import OpponentPool, Opponents, as_pool
from predprey_env.policies.protocol import Policy
from predprey_env.settings import spell_out
from predprey_env.tasks import or_default, world


@spell_out(EnvConfig)
def team_view(
    team: TeamName,
    opponent: Opponents | None = None,
    render_mode: str | None = None,
    *,
    task: str | None = None,
    **parameters: Unpack[EnvParameters],
) -> TeamView:
    """Return a parallel environment that holds the agents of one team; all of them have the same spaces.

    Args:
        team: ``"predators"`` or ``"prey"``.
        opponent: Policy of the other team: the name of a script (:data:`predprey_env.policies.SCRIPTS`), a
            :class:`predprey_env.policies.Policy` (an evolved team, for example), or a function from observations to
            actions, by agent. The environment plays its own copy of a policy, because a policy may have memory; the
            copy does not change when the policy learns. A function (a bound method, for example) and a policy with
            ``act_batch`` have no memory, so they are not copied, and play as they are at each step. From a list, or a
            :class:`predprey_env.OpponentPool`, each episode samples one opponent, whose index the infos hold as
            ``opponent``. The default is a script (:data:`predprey_env.tasks.DEFAULT_OPPONENTS`).
        render_mode: Render mode, as in :func:`predprey_env.predprey_v0.parallel_env`.
        task: Name of a world in :data:`predprey_env.TASKS`, whose settings the parameters override.
        parameters: The fields of :class:`predprey_env.EnvConfig`.
    """
    return TeamView(PredPreyEnv(world(task, parameters), render_mode), team, or_default(opponent, team))


class TeamView(Opposed, Around, SpacesByAgent, ParallelEnv[str, Observation, int]):
    """An environment of one team. If teams move in turns, each :meth:`step` is still a whole time step."""

    metadata: ClassVar[dict[str, Any]] = {**PredPreyEnv.metadata, "name": "predprey_team_v0"}
    env: PredPreyEnv = read_only("env", kept="_inner")
    team: TeamName = read_only("team")

    def __init__(self, env: PredPreyEnv, team: TeamName, opponent: Opponents) -> None:
        config = env.config
        config.team(team)  # raises ValueError for an unknown team
        self._inner = env
        self._team = team
        self._pool, self._policies = self._admit(opponent)
        self._member = 0  # index of the opponent that plays
        self.possible_agents = [agent for agent in env.possible_agents if agent.startswith(PREFIXES[team])]
        self.observation_spaces = {agent: env.observation_space(agent) for agent in self.possible_agents}
        self.action_spaces = {agent: env.action_space(agent) for agent in self.possible_agents}
        self.state_space = env.state_space
        self._in_turns = config.move_order == "prey_first"
        self._n_opponent_actions = config.team(other_team(team)).n_actions
        self._observations: Observations = {}
        self._infos: dict[str, Info] = {}

    def set_opponent(self, opponent: Opponents) -> None:
        """Replace the opponent, or the pool, from the next step on. During an episode, the new opponent is reset first.

        The old opponents stay if a new one cannot play or its ``reset`` raises an exception.
        """
        pool, policies = self._admit(opponent)
        member = 0
        if self.env.agents:
            with self._all_or_nothing():
                member = pool.sample(self.env.np_random)
                policies[member].reset(draw_seed(self.env.np_random))
        self._pool, self._policies, self._member = pool, policies, member

    def _admit(self, opponents: Opponents) -> tuple[OpponentPool, tuple[Policy, ...]]:
        """Return a pool, and a copy of each of its policies."""
        pool, others = as_pool(opponents), other_team(self.team)
        return pool, tuple(own_copy(as_policy(each, others, self.env.config)) for each in pool.opponents)

    @property
    def agents(self) -> list[str]:
        """Agents of the team that are still in the game."""
        return [agent for agent in self.env.agents if agent in self.observation_spaces]

    @property
    def render_mode(self) -> str | None:
        """Mode of :meth:`render`: None, or one of ``metadata["render_modes"]``."""
        return self.env.render_mode

    @render_mode.setter
    def render_mode(self, mode: str | None) -> None:
        self.env.render_mode = mode

    def reset(self, seed: int | None = None, options: Options | None = None) -> tuple[Observations, dict[str, Info]]:
        """Start an episode. After the start positions, the opponent is sampled if there are several, then its seed."""
        with self._all_or_nothing():
            self._observations, self._infos = self.env.reset(seed, options)
            self._member = self._pool.sample(self.env.np_random)
            self._policies[self._member].reset(draw_seed(self.env.np_random))
            if self._in_turns and self.team == "predators":
                self._observations, _, _, _, self._infos = self.env.step(self._opponents_choose())
        return self._own(self._observations), self._own_infos(self._infos)

    def step(self, actions: dict[str, int]) -> Step:
        """Play one time step: the team's actions and the opponent's.

        If the opponent raises an exception, or returns no usable actions, the world stays as it was.
        """
        check_agents(actions, self.possible_agents)
        for agent in self.agents:
            if not self._infos[agent]["captured"]:
                read_action(actions, agent, int(self.action_spaces[agent].n))
        if not self.agents:
            return self.env.step({})
        return self._play_turns(actions) if self._in_turns else self._play_together(actions)

    def state(self) -> State:
        """Return the state of the whole world; see :meth:`PredPreyEnv.state`."""
        return self.env.state()

    def _play_together(self, actions: dict[str, int]) -> Step:
        step = self.env.step({**actions, **self._opponents_choose()})
        self._observations, self._infos = step[0], step[4]
        return self._own_part(step)

    def _play_turns(self, actions: dict[str, int]) -> Step:
        infos = self._infos
        with self._all_or_nothing():
            ours = self.env.step(actions)
            self._observations = ours[0]
            theirs = self.env.step(self._opponents_choose()) if self.env.agents else ({}, {}, {}, {}, {})
        # Agents that left in the first turn are missing from the second, so merge the two.
        self._observations, self._infos = {**ours[0], **theirs[0]}, {**ours[4], **theirs[4]}
        terminations, truncations = {**ours[2], **theirs[2]}, {**ours[3], **theirs[3]}
        rewards = {agent: reward + theirs[1].get(agent, 0.0) for agent, reward in ours[1].items()}
        if self.env.config.reward == "dense":  # the change over both turns is rounded only once
            rewards = {agent: self._infos[agent]["fitness"] - infos[agent]["fitness"] for agent in rewards}
        return self._own_part((self._observations, rewards, terminations, truncations, self._infos))

    @contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        """Leave the world as it was if the opponent fails."""
        saved, observations, infos, member = self.env._saved(), self._observations, self._infos, self._member
        try:
            yield
        except BaseException:  # including KeyboardInterrupt
            self.env._restore(saved)
            self._observations, self._infos, self._member = observations, infos, member
            raise

    def _opponents_choose(self) -> dict[str, int]:
        """Return the other team's actions for its last observations."""
        others = [agent for agent in self.env.agents if agent not in self.observation_spaces]
        policy = self._policies[self._member]
        seen = observed_by(policy, self.env, self._observations)
        return ask(policy, {agent: seen[agent].copy() for agent in others}, self._n_opponent_actions)

    def _own_part(self, step: Step) -> Step:
        observations, rewards, terminations, truncations, infos = step
        own = self._own
        return own(observations), own(rewards), own(terminations), own(truncations), self._own_infos(infos)

    def _own_infos(self, infos: dict[str, Info]) -> dict[str, Info]:
        """Return the team's infos, with the index of the opponent if there are several."""
        own: dict[str, Info] = self._own(infos)
        return (
            own if len(self._pool) == 1 else {agent: info | {"opponent": self._member} for agent, info in own.items()}
        )

    def _own(self, by_agent: dict[str, Any]) -> dict[str, Any]:
        return {agent: value for agent, value in by_agent.items() if agent in self.observation_spaces}


def observed_by(policy: Policy, env: ParallelEnv[str, Observation, int], observations: Observations) -> Observations:
    """Return what a policy observes: the environment's observations, or others if the policy has its own ``sight``."""
    if not isinstance(env, PredPreyEnv):
        return observations
    sight = sight_in(policy, env.config)
    return observations if sight == env.config.sight else env.observe_as(sight)
