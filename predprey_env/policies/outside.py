"""Teams whose policy is called in Python, for each world or for all worlds at once."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np

from predprey_env.agents import PREFIXES
from predprey_env.arrays import Actions, Seeds, WorldIndices, WorldMask
from predprey_env.config import EnvConfig, TeamName
from predprey_env.jit.lanes import LANES
from predprey_env.policies.opponents import Opponent, as_policy, ask, asked_at_once, compiled_player, own_copy, sight_in
from predprey_env.policies.protocol import Player, Policy


class Seat(NamedTuple):
    """An opponent in many worlds. Exactly one of ``outside`` and ``player`` is None."""

    policy: Policy
    outside: OutsideTeam | None
    """Asks the policy in Python; None if a player is compiled."""
    player: Player | None
    """The policy in compiled code."""


def seat(opponent: Opponent, team: TeamName, config: EnvConfig, n_worlds: int) -> Seat:
    """Return an opponent in many worlds: in compiled code if its policy has a player, else called in Python."""
    policy = as_policy(opponent, team, config)
    player = compiled_player(policy, team, config, LANES)
    return Seat(policy, OutsideTeam(policy, config, team, n_worlds) if player is None else None, player)


class OutsideTeam:
    """A team in many worlds whose actions a Python policy chooses.

    Args:
        policy: Policy that plays. Each world gets a copy unless the policy has ``act_batch``.
        config: The world.
        team: Team that the policy plays.
        n_worlds: Number of worlds.
        whose: Owner of the policy, as error messages name it.
    """

    def __init__(
        self, policy: Policy, config: EnvConfig, team: TeamName, n_worlds: int, whose: str = "the opponent's"
    ) -> None:
        self._whose = whose
        shape = config.team(team)
        self.sight = sight_in(policy, config)
        """The team's observation."""
        self._shape = shape._replace(n_seen=self.sight.n_seen(shape.n_agents, shape.n_opponents))
        self._agents = [f"{PREFIXES[team]}{i}" for i in range(self._shape.n_agents)]
        self.at_once = asked_at_once(policy)
        """True if the policy chooses for all worlds in one call."""
        self._policies = [policy] if self.at_once else [own_copy(policy, whose) for _ in range(n_worlds)]
        self.views = np.zeros((n_worlds, self._shape.n_agents, self._shape.n_seen), np.float32)
        """Observations of the team, float32 ``(n_worlds, n_agents, n_seen)``. The caller writes them before
        :meth:`act`."""

    def reset(self, which: WorldIndices, seeds: Seeds) -> None:
        """Start an episode in the worlds ``which``, int ``(n,)``, with a seed for each, int ``(n,)``.

        A policy with ``act_batch`` is reset only when all worlds start together, with the first seed.
        """
        if self.at_once:
            if len(which) == len(self.views):
                self._policies[0].reset(int(seeds[0]))
            return
        for world, seed in zip(which.tolist(), seeds.tolist(), strict=True):
            self._policies[world].reset(seed)

    def act(self, playing: WorldMask) -> Actions:
        """Return the team's actions for the observations in :attr:`views`, int32 ``(n_worlds, n_agents)``.

        Args:
            playing: True for the worlds in which the episode goes on, bool ``(n_worlds,)``; in the others the actions
                are meaningless.

        Raises:
            RuntimeError: The policy raised an exception.
            ValueError: The policy did not return an action for each agent.
        """
        return self._ask_all() if self.at_once else self._ask_each(playing)

    def _ask_each(self, playing: WorldMask) -> Actions:
        actions = np.zeros((len(self._policies), len(self._agents)), np.int32)
        for world in np.flatnonzero(playing):
            seen = dict(zip(self._agents, self.views[world].copy(), strict=True))
            chosen = ask(self._policies[world], seen, self._shape.n_actions, self._whose)
            actions[world] = list(chosen.values())
        return actions

    def _ask_all(self) -> Actions:
        expected, policy = self.views.shape[:2], cast("Any", self._policies[0])
        try:
            actions = np.asarray(policy.act_batch(self.views.copy()))
        except (Exception, SystemExit) as error:
            raise RuntimeError(f"{self._whose} act_batch() raised {type(error).__name__}: {error}") from error
        if actions.shape != expected or not np.issubdtype(actions.dtype, np.integer):
            raise ValueError(
                f"{self._whose} act_batch() must return integers of shape {expected}, "
                f"got {actions.dtype} of shape {actions.shape}"
            )
        if actions.min() < 0 or actions.max() >= self._shape.n_actions:
            raise ValueError(
                f"{self._whose} act_batch() must return actions in 0..{self._shape.n_actions - 1}, "
                f"got {actions.min()} to {actions.max()}"
            )
        return np.ascontiguousarray(actions, np.int32)
