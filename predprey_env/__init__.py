"""Predators and prey on a torus: PettingZoo and Gymnasium environments.

A parallel environment of both teams::

    >>> from predprey_env import parallel_env
    >>> env = parallel_env(n_prey=1, size=20)
    >>> observations, infos = env.reset(seed=0)
    >>> while env.agents:
    ...     actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    ...     observations, rewards, terminations, truncations, infos = env.step(actions)

An environment of one team, against a script, an evolved team or a policy of yours, in one world or in many::

    >>> from predprey_env import team_view, vector_env
    >>> env = team_view("predators", opponent="flee_nearest")
    >>> envs = vector_env(64, "predators", opponent="flee_nearest", reward="dense")
    >>> observations, infos = envs.reset(seed=0)
    >>> observations.shape
    (192, 4)

The specification is the docstring of :mod:`predprey_env.predprey_v0`.
"""

import gymnasium
import pettingzoo

from predprey_env.config import EnvConfig
from predprey_env.envs.both import ParallelVectorEnv, parallel_vector_env
from predprey_env.envs.joint import JointTeam, joint_env
from predprey_env.envs.parallel import PredPreyEnv
from predprey_env.envs.team import TeamView, team_view
from predprey_env.envs.vector import PredPreyVectorEnv, vector_env
from predprey_env.policies import SCRIPTS, OpponentPool, Policy, ScriptedTeam, choose, memory_rows, sees_team, sight_of
from predprey_env.predprey_v0 import env, parallel_env, raw_env
from predprey_env.rules.observation import move_of, observe, offset_to
from predprey_env.rules.torus import manhattan
from predprey_env.sight import AnySight, Sight
from predprey_env.tasks import DEFAULT_OPPONENTS, TASKS

__all__ = [
    "SCRIPTS",
    "TASKS",
    "AnySight",
    "EnvConfig",
    "JointTeam",
    "OpponentPool",
    "ParallelVectorEnv",
    "Policy",
    "PredPreyEnv",
    "PredPreyVectorEnv",
    "ScriptedTeam",
    "Sight",
    "TeamView",
    "choose",
    "env",
    "joint_env",
    "manhattan",
    "memory_rows",
    "move_of",
    "observe",
    "offset_to",
    "parallel_env",
    "parallel_vector_env",
    "raw_env",
    "sees_team",
    "sight_of",
    "team_view",
    "vector_env",
]
__version__ = "0.2.0"

for _task in (None, *TASKS):
    _prefix = "" if _task is None else f"{_task}-"
    if hasattr(pettingzoo, "register"):  # from PettingZoo 1.27 on
        for _api, _maker in (("parallel", "parallel_env"), ("aec", "env")):
            _entry = f"predprey_env.predprey_v0:{_maker}"
            pettingzoo.register(_api, f"predprey-{_prefix}v0", _entry, kwargs={"task": _task})
    for _team in DEFAULT_OPPONENTS:
        gymnasium.register(
            f"predprey/{_prefix.capitalize()}{_team.capitalize()}-v0",
            entry_point="predprey_env.envs.joint:joint_env",
            vector_entry_point="predprey_env.envs.vector:vector_env",
            kwargs={"team": _team, "task": _task},
        )
del _task, _prefix, _team
