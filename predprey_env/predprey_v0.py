"""Predators and prey on a toroid: the pursuit-evasion task of Rawal, Rajagopalan & Miikkulainen (2010).

A team of predators hunts a team of prey of the same speed on a square grid whose edges are joined. Nobody is told what
a team-mate does. As prey cannot be outrun, predators must come from several sides at once; as three predators cannot
close four exits at once, prey that foresee them escape.

| Import             | ``from predprey_env import predprey_v0``           |
|--------------------|----------------------------------------------------|
| Actions            | Discrete                                           |
| Parallel API       | Yes (AEC through ``env()``)                        |
| Agents             | ``predator_0``.. (3), ``prey_0``.. (2)             |
| Action shape       | predators ``Discrete(5)``, prey ``Discrete(4)``    |
| Observation shape  | predators ``(2 n_prey,)``, prey ``(2 n_predators,)`` |
| Observation values | ``[-(size // 2), size - size // 2 - 1]``, in cells |
| State shape        | ``(2 n_agents + n_prey + 1,)``                     |

**Observation.** For each opponent in order: its offset along x and along y, opponent minus self, the shortest way
round the torus, in cells, float32. The offset to and from a caught prey is (0, 0).

**Actions.** 0 east, 1 west, 2 north, 3 south, and for predators 4 idle. All agents move at once. With
``move_order="prey_first"`` each call of ``step`` is half a time step: first the prey's turn, then the predators',
by then aware of where the prey went. Actions of the team that is not in turn are ignored; time and the end are counted
in whole steps.

**Capture.** A prey is caught when a predator is in its cell after the move. A caught prey stays in ``agents``, does
nothing and has its actions ignored (``captured_prey="inert"``), or terminates and leaves, its last reward being the
fitness if the episode ended then (``"removed"``).

**Rewards.** 0 until the last step, on which every agent receives its fitness; the undiscounted return is thus the
paper's fitness. With ``g`` of ``n`` prey caught, predators score 25 if ``g = n``, else ``20 g/n + 2 g + 20 d/n`` with
``d`` in [0, 1] their closeness to the free prey; prey score 25 if ``g = 0``, 12.5 if ``0 < g < n``, else ``12.5
rho/R`` for an episode of ``rho`` of at most ``R`` steps. With ``reward="dense"`` each step pays the change in that
fitness.

**Start.** Uniform random cells; drawn again while a predator shares a prey's cell. ``reset(options={"starts": cells})``
sets them.

**End.** All prey caught: terminated. ``max_cycles`` steps: truncated. After that ``step`` returns five empty
dictionaries.

**Info.** For each agent ``captured`` (0 or 1), ``n_captured``, ``fitness``, the fitness if the episode
ended now, and ``steps``, the time steps begun.

The parameters are those of :class:`predprey_env.EnvConfig` and ``render_mode`` (``"human"``, ``"ansi"``,
``"rgb_array"``).

Version history: v0, first release.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, Literal, ParamSpec

from pettingzoo import AECEnv
from pettingzoo.utils import parallel_to_aec, wrappers

from predprey_env.config import EnvConfig
from predprey_env.parallel_env import PredPreyEnv

__all__ = ["env", "parallel_env", "raw_env"]

Parameters = ParamSpec("Parameters")


def parallel_env(
    *,
    n_predators: int = 3,
    n_prey: int = 2,
    size: int = 100,
    max_cycles: int = 150,
    move_order: Literal["simultaneous", "prey_first"] = "simultaneous",
    swap_captures: bool = False,
    captured_prey: Literal["inert", "removed"] = "inert",
    start_collisions: Literal["redraw", "allow"] = "redraw",
    predator_idle: bool = True,
    closeness: Literal["uncaught", "all", "nearest"] = "uncaught",
    credit: Literal["team", "individual"] = "team",
    prey_fitness: Literal["lifespan", "complementary"] = "lifespan",
    reward: Literal["terminal", "dense"] = "terminal",
    render_mode: Literal["human", "ansi", "rgb_array"] | None = None,
) -> PredPreyEnv:
    """The environment with PettingZoo's parallel API; the parameters are explained in :class:`EnvConfig`."""
    config = {name: value for name, value in locals().items() if name != "render_mode"}
    return PredPreyEnv(EnvConfig(**config), render_mode)


def _as_aec(
    make: Callable[Parameters, PredPreyEnv], wrap: Callable[[Any], Any]
) -> Callable[Parameters, AECEnv[Any, Any, Any]]:
    @wraps(make)
    def make_aec(*args: Parameters.args, **kwargs: Parameters.kwargs) -> AECEnv[Any, Any, Any]:
        return wrap(parallel_to_aec(make(*args, **kwargs)))

    return make_aec


raw_env = _as_aec(parallel_env, lambda aec: aec)
"""The environment with PettingZoo's AEC API, without checks."""

env = _as_aec(parallel_env, lambda aec: wrappers.OrderEnforcingWrapper(wrappers.AssertOutOfBoundsWrapper(aec)))
"""The environment with PettingZoo's AEC API, with checks of actions and of the order of calls."""
