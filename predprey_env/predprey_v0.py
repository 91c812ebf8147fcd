"""# Predators and prey

A team of predators hunts a team of prey of the same speed on a square grid whose opposite edges are joined. By default no
agent observes its team-mates. Predators cannot outrun prey, so they must come from several sides at once; three predators
cannot block a prey's four ways out at once, so prey that anticipate their moves escape. The task is that of Rawal,
Rajagopalan & Miikkulainen (2010), *Constructing Competitive and Cooperative Agent Behavior Using Coevolution*.
`pettingzoo.make` exists from PettingZoo 1.27 on; it knows the environment after `import predprey_env`.

| Import             | `from predprey_env import predprey_v0`                          |
|--------------------|-----------------------------------------------------------------|
| Creation           | `pettingzoo.make("parallel", "predprey-v0")`                    |
| Actions            | Discrete                                                        |
| Parallel API       | Yes (AEC through `env()`)                                       |
| Manual control     | No                                                              |
| Agents             | `['predator_0', 'predator_1', 'predator_2', 'prey_0', 'prey_1']` |
| Action shape       | predators `Discrete(5)`, prey `Discrete(4)`                     |
| Action values      | `[0, 4]`                                                        |
| Observation shape  | predators `(2 * n_prey,)`, prey `(2 * n_predators,)`; more with options |
| Observation values | `[-(size // 2), size - size // 2 - 1]`                          |
| State shape        | `(2 * n_agents + n_prey + 1,)`                                  |
| State values       | `[0, size - 1]`                                                 |

### Observation space

An agent observes the other team, but not its own. The observation holds, for each opponent in order, its offset
along x and along y: opponent minus self, the shortest way round the torus, in cells, float32. The offset to or from a
caught prey is (0, 0).

| Entries        | Seen by a predator                  | Seen by a prey                          |
|----------------|-------------------------------------|-----------------------------------------|
| `2 i, 2 i + 1` | offset (x, y) to `prey_i`, in cells | offset (x, y) to `predator_i`, in cells |

The state, for centralised critics, holds all columns, all rows, which prey are free, and the fraction of the time limit
that has passed.

#### With options

Options whose names begin with `see_` add to the observation. In this order it then holds:

| Part      | Present with    | Entries                                                                              |
|-----------|-----------------|--------------------------------------------------------------------------------------|
| offsets   | always          | (x, y) to each opponent, then with `see_teammates` to each team-mate                 |
| moves     | `see_moves`     | last move (x, y) of each of these agents, -1, 0 or 1; 0 before the first             |
| identity  | `see_identity`  | one-hot index of the agent in its own team                                           |

Opponents are in order of their index, or with `see_nearest_first` of their distance. With `see_scaled` offsets are divided
by `size / 2`. With `move_order="prey_first"` predators see the move that the prey have just made. Scripts and evolved teams
keep the observation that they were made for in every world, so they can play against agents that observe more or less.

`observation="module:Class"` replaces all of this with an observation of your own (:mod:`predprey_env.sight`).

### Action space

| Action | Move                  |
|--------|-----------------------|
| 0      | east, x + 1           |
| 1      | west, x - 1           |
| 2      | north, y + 1          |
| 3      | south, y - 1          |
| 4      | idle (predators only) |

All agents move at once. With `move_order="prey_first"` each call of `step` is half a time step: first the prey move, then
the predators, who have observed where the prey went. Actions of the team that waits are ignored. The time limit and the
end of an episode count whole steps.

A prey is caught when a predator is in its cell after the move. With `captured_prey="inert"` a caught prey stays in
`agents`, does nothing, and its actions are ignored. With `"removed"` it terminates and leaves; its last reward is the one
that it would get if the episode ended at that moment, and later captures do not change it.

### Rewards

Rewards are 0 until the last step, on which every agent receives its fitness; with `captured_prey="inert"` the undiscounted
return is thus the paper's fitness. With `reward="dense"` the reward of each step is the change in what the fitness would be
if the episode ended now, so that the return is the last fitness minus the first. Predators are then rewarded for every step
that brings them nearer to the free prey. The prey's reward differs from 0 only when one of them is caught, because their
default fitness ignores distances.

| Team      | Prey caught, `g` of `n` | Fitness                        |
|-----------|-------------------------|--------------------------------|
| predators | `g = n`                 | `25`                           |
| predators | `g < n`                 | `20 * g/n + 2 * g + 20 * d/n`  |
| prey      | `g = 0`                 | `25`                           |
| prey      | `0 < g < n`             | `12.5`                         |
| prey      | `g = n`                 | `12.5 * rho/R`                 |

`d`, in [0, 1], measures how close the predators are to the free prey: 1 minus their mean toroidal Manhattan distance over
the largest distance on the torus. `rho` is the number of steps played, of at most `R = max_cycles`.

### Starting state

Cells are uniformly random; prey placed on a predator are placed again. `reset(options={"starts": cells})` places the
agents: integers `(n_agents, 2)`, predators first. An option that looks like a misspelt `starts` raises `ValueError`; other
options are ignored, as they may be meant for wrappers.

### Episode end

Termination: all prey are caught, even if only on step `max_cycles`. Truncation: `max_cycles` steps have passed and some prey
are free. After the end `step` returns five empty dictionaries.

### Info

| Key          | Value                                                    |
|--------------|----------------------------------------------------------|
| `captured`   | 1 if the agent is a caught prey, else 0                  |
| `n_captured` | number of prey caught so far                             |
| `fitness`    | the agent's fitness if the episode ended now             |
| `steps`      | number of time steps begun                               |
| `in_turn`    | 1 if the agent's next action counts, 0 out of its turn   |

With `mask_actions=True` infos also hold `action_mask`, int8: 1 for each valid action. For a caught prey, or an agent out of
its turn, only the entry of action 0 is 1.

### Arguments

{arguments}

:func:`predprey_env.team_view` returns an environment of one team, :func:`predprey_env.vector_env` one of many worlds.
Scripted teams are in :mod:`predprey_env.policies`.

### Version history

* v0: first release (0.2.0)
"""

from __future__ import annotations

from collections.abc import Collection
from inspect import signature
from typing import Any, Literal, Unpack

from pettingzoo import AECEnv
from pettingzoo.utils import parallel_to_aec, wrappers

from predprey_env.config import EnvConfig, EnvParameters
from predprey_env.envs.parallel import PredPreyEnv
from predprey_env.settings import spell_out, table_row, unknown_field
from predprey_env.tasks import TASKS, world

__all__ = ["env", "parallel_env", "raw_env"]


@spell_out(EnvConfig)
def parallel_env(
    *,
    task: str | None = None,
    render_mode: Literal["human", "ansi", "rgb_array"] | None = None,
    **parameters: Unpack[EnvParameters],
) -> PredPreyEnv:
    """Return the environment with PettingZoo's parallel API; the parameters are explained in :class:`EnvConfig`.

    With a ``task``, a name in :data:`predprey_env.TASKS`, the parameters override settings of the task's world.
    """
    _check_names("parallel_env", parameters)
    return PredPreyEnv(world(task, parameters), render_mode)


class _Parameters(EnvParameters, total=False):
    task: str | None
    render_mode: Literal["human", "ansi", "rgb_array"] | None


def env(**parameters: Unpack[_Parameters]) -> AECEnv[Any, Any, Any]:
    """Return the environment with PettingZoo's AEC API, with checks of actions and of the order of calls.

    The parameters are those of :func:`parallel_env`.
    """
    _check_names("env", parameters)
    return wrappers.OrderEnforcingWrapper(wrappers.AssertOutOfBoundsWrapper(raw_env(**parameters)))


def raw_env(**parameters: Unpack[_Parameters]) -> AECEnv[Any, Any, Any]:
    """Return the environment with PettingZoo's AEC API, without checks.

    The parameters are those of :func:`parallel_env`.
    """
    _check_names("raw_env", parameters)
    return parallel_to_aec(parallel_env(**parameters))


def _check_names(maker: str, parameters: Collection[str]) -> None:
    """Raise :class:`ValueError` for an unknown keyword, with the name of the function that was called."""
    known = list(signature(parallel_env).parameters)
    for name in parameters:
        if name not in known:
            raise ValueError(f"{maker}(): {unknown_field(name, known)}")


# help() and inspect.signature() then name the parameters one by one.
for _make in (env, raw_env):
    _make.__signature__ = signature(parallel_env).replace(  # type: ignore[attr-defined]
        return_annotation=signature(_make).return_annotation
    )
del _make


_ARGUMENTS = f"""\
| Argument | Meaning |
|----------|---------|
{chr(10).join(table_row(name, field) for name, field in EnvConfig.model_fields.items())}
| `task` | Named world, whose settings the other arguments override: {", ".join(f'`"{name}"`' for name in TASKS)}. Default: `None`. |
| `render_mode` | `None`: no rendering. `"human"`: a window. \
`"ansi"`: text. `"rgb_array"`: pixels, uint8 (672, 640, 3). Default: `None`. |"""

if __doc__:  # python -OO leaves docstrings out
    __doc__ = __doc__.replace("{arguments}", _ARGUMENTS)
