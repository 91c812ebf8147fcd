"""Teams that are not compiled: asked in Python, world by world or all at once."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from predprey_env.config import EnvConfig, TeamName
from predprey_env.lanes import LANES
from predprey_env.policies.names import PREFIXES
from predprey_env.policies.opponents import Opponent, as_policy, ask, asked_at_once, compiled_player, own_copy
from predprey_env.policies.protocol import MEMORY, Policy
from predprey_env.worlds import Dictated, Worlds


def seat(
    opponent: Opponent, team: TeamName, config: EnvConfig, n_worlds: int
) -> tuple[Policy, OutsideTeam | None, Any]:
    """Return an opponent's policy, what asks it in Python if it is not compiled, and its player in compiled code."""
    policy = as_policy(opponent, team, config)
    player = compiled_player(policy, team, config, LANES)
    if player is not None:
        return policy, None, player
    return policy, OutsideTeam(policy, config, team, n_worlds), OutsideTeam.player


class OutsideTeam:
    """Any policy as a team in many worlds.

    Args:
        policy: Of one that has no ``act_batch``, each world gets a copy.
        config: The world.
        team: Which team it plays.
        n_worlds: How many.
        whose: Policy it is, as errors say.
    """

    player = Dictated()

    def __init__(
        self, policy: Policy, config: EnvConfig, team: TeamName, n_worlds: int, whose: str = "the opponent's"
    ) -> None:
        self._whose = whose
        self._shape = config.team(team)
        self._agents = [f"{PREFIXES[team]}{i}" for i in range(self._shape.n_agents)]
        self._at_once = asked_at_once(policy)
        self._policies = [policy] if self._at_once else [own_copy(policy, whose) for _ in range(n_worlds)]
        self.views = np.zeros((n_worlds, self._shape.n_agents, self._shape.n_seen), np.float32)
        """What the team sees: the caller writes it before :meth:`choose`."""

    def reset(self, which: np.ndarray, seeds: np.ndarray) -> None:
        """Start an episode in some worlds."""
        if self._at_once:
            if len(which) == len(self.views):
                self._policies[0].reset(int(seeds[0]))
            return
        for world, seed in zip(which.tolist(), seeds.tolist(), strict=True):
            self._policies[world].reset(seed)

    def act(self, playing: np.ndarray) -> np.ndarray:
        """What the team does, int ``(n_worlds, n_agents)``, on :attr:`views`.

        Args:
            playing: bool ``(n_worlds,)``: which worlds go on; in the others actions mean nothing.

        Raises:
            RuntimeError: From what the policy raised.
            ValueError: What it returned is not an action for each agent.
        """
        return self._ask_all() if self._at_once else self._ask_each(playing)

    def choose(self, worlds: Worlds) -> None:
        """Put the actions where :class:`~predprey_env.worlds.Dictated` finds them."""
        actions = self.act(worlds.over[:, 0].reshape(-1)[: len(self.views)] == 0)
        n_worlds, n_agents = actions.shape
        padded = np.zeros((len(worlds.kept) * LANES, n_agents), np.int32)
        padded[:n_worlds] = actions
        worlds.kept[:, ::MEMORY] = padded.reshape(-1, LANES, n_agents).transpose(0, 2, 1)

    def _ask_each(self, playing: np.ndarray) -> np.ndarray:
        actions = np.zeros((len(self._policies), len(self._agents)), np.int32)
        for world in np.flatnonzero(playing):
            seen = dict(zip(self._agents, self.views[world].copy(), strict=True))
            chosen = ask(self._policies[world], seen, self._shape.n_actions, self._whose)
            actions[world] = list(chosen.values())
        return actions

    def _ask_all(self) -> np.ndarray:
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
        return actions
