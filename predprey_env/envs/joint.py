"""A whole team as one agent, for tools that know only Gymnasium's ``Env``."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium
import numpy as np
from gymnasium.spaces import Box, MultiDiscrete

from predprey_env.arrays import ActionMask, Actions, Observation, Observations
from predprey_env.config import EnvConfig, EnvParameters, TeamName
from predprey_env.envs.fixed import Around, read_only
from predprey_env.envs.masks import action_mask
from predprey_env.envs.options import Options
from predprey_env.envs.parallel import Info
from predprey_env.envs.team import TeamView, team_view
from predprey_env.policies.pool import Opponents
from predprey_env.policies.protocol import Policy
from predprey_env.settings import spell_out, whole_numbers


@spell_out(EnvConfig)
def joint_env(
    team: TeamName,
    opponent: Opponents | None = None,
    render_mode: str | None = None,
    *,
    task: str | None = None,
    **parameters: Unpack[EnvParameters],
) -> JointTeam:
    """Return an environment in which one agent plays a whole team.

    Args:
        team: ``"predators"`` or ``"prey"``.
        opponent: Policy of the other team, or a pool, as in :func:`predprey_env.team_view`.
        render_mode: Render mode, as in :func:`predprey_env.predprey_v0.parallel_env`.
        task: Name of a world in :data:`predprey_env.TASKS`, whose settings the parameters override.
        parameters: The fields of :class:`predprey_env.EnvConfig`; ``captured_prey`` must be ``"inert"``.
    """
    return JointTeam(team_view(team, opponent, render_mode, task=task, **parameters))


class JointTeam(Around, gymnasium.Env[Observation, Actions]):  # type: ignore[override]  # np_random is read-only
    """A team as one agent, which observes what all agents of the team observe, and chooses all of their actions.

    An observation holds those of the agents one after the other, float32 ``(n_agents * n_seen,)``. An action holds one
    for each agent, int ``(n_agents,)``. The reward is the mean of the agents' rewards, which are equal unless
    ``credit="individual"``. Infos hold ``n_captured`` and ``steps``, and with several opponents ``opponent``.
    """

    view: TeamView = read_only("view", kept="_inner")
    """The environment of the team's agents."""

    opponent: Policy | tuple[Policy, ...] = read_only("opponent", "call set_opponent(opponent)", "_inner.opponent")
    """Policy that plays the other team, or all policies of a pool; see :attr:`predprey_env.TeamView.opponent`."""

    def __init__(self, view: TeamView) -> None:
        if view.captured_prey != "inert":
            raise ValueError(
                f"in a joint env captured_prey must be 'inert', as the team is one agent, got {view.captured_prey!r}"
            )
        self._inner = view
        first, n_agents = view.possible_agents[0], len(view.possible_agents)
        space, choices = view.observation_space(first), view.action_space(first)
        self.observation_space = Box(np.tile(space.low, n_agents), np.tile(space.high, n_agents), dtype=np.float32)
        self.action_space = MultiDiscrete([int(choices.n)] * n_agents)
        self._infos: dict[str, Info] = {agent: {"captured": 0} for agent in view.possible_agents}
        self.metadata = {**view.metadata, "name": "predprey_joint_v0"}
        self.render_mode = view.render_mode

    _np_random = Around.np_random  # Gymnasium's checker looks here

    def set_opponent(self, opponent: Opponents) -> None:
        """Replace the opponent, or the pool; see :meth:`predprey_env.TeamView.set_opponent`."""
        self.view.set_opponent(opponent)

    def reset(self, *, seed: int | None = None, options: Options | None = None) -> tuple[Observation, Info]:
        """Start an episode; see :meth:`predprey_env.TeamView.reset`."""
        observations, infos = self.view.reset(seed, options)
        self._infos = infos
        return self._together(observations), self._info(infos)

    def step(self, action: Actions) -> tuple[Observation, float, bool, bool, Info]:
        """Play one time step with an action for each agent, int ``(n_agents,)``."""
        if not self.view.agents:
            raise RuntimeError("reset() must be called before step()")
        chosen = whole_numbers("actions", action, (len(self.view.possible_agents),))
        step = self.view.step(dict(zip(self.view.possible_agents, chosen.tolist(), strict=True)))
        observations, rewards, terminations, truncations, infos = step
        reward = float(np.mean(list(rewards.values())))
        ended = any(terminations.values()), any(truncations.values())
        self._infos = infos
        return self._together(observations), reward, *ended, self._info(infos)

    def action_masks(self) -> ActionMask:
        """Return which actions of each agent are valid, one agent after the other, bool ``(n_agents * n_actions,)``;
        for sb3-contrib's ``MaskablePPO``.
        """
        acts = np.array([not self._infos[agent]["captured"] for agent in self.view.possible_agents])
        return action_mask(acts, self._config.team(self.view.team).n_actions).ravel().astype(np.bool_)

    def _together(self, observations: Observations) -> Observation:
        return np.concatenate([observations[agent] for agent in self.view.possible_agents])

    def _info(self, infos: dict[str, Any]) -> Info:
        first = infos[self.view.possible_agents[0]]
        return {name: first[name] for name in ("n_captured", "steps", "opponent") if name in first}
