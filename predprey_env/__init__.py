"""Predators and prey on a toroid, as a PettingZoo environment."""

import gymnasium
import pettingzoo

from predprey_env.config import EnvConfig
from predprey_env.envs.both import ParallelVectorEnv, parallel_vector_env
from predprey_env.envs.joint import JointTeam, joint_env
from predprey_env.envs.parallel import PredPreyEnv
from predprey_env.envs.team import TeamView, team_view
from predprey_env.envs.vector import PredPreyVectorEnv, vector_env
from predprey_env.policies import SCRIPTS, OpponentPool, Policy, ScriptedTeam, choose, sees_team
from predprey_env.predprey_v0 import env, parallel_env, raw_env

__all__ = [
    "SCRIPTS",
    "EnvConfig",
    "JointTeam",
    "OpponentPool",
    "ParallelVectorEnv",
    "Policy",
    "PredPreyEnv",
    "PredPreyVectorEnv",
    "ScriptedTeam",
    "TeamView",
    "choose",
    "env",
    "joint_env",
    "parallel_env",
    "parallel_vector_env",
    "raw_env",
    "sees_team",
    "team_view",
    "vector_env",
]
__version__ = "0.1.0"

if hasattr(pettingzoo, "register"):  # from PettingZoo 1.27 on
    pettingzoo.register("parallel", "predprey-v0", "predprey_env.predprey_v0:parallel_env")
    pettingzoo.register("aec", "predprey-v0", "predprey_env.predprey_v0:env")

for _team, _name, _opponent in (("predators", "Predators", "flee_nearest"), ("prey", "Prey", "surround")):
    gymnasium.register(
        f"predprey/{_name}-v0",
        entry_point="predprey_env.envs.joint:joint_env",
        vector_entry_point="predprey_env.envs.vector:registered",
        kwargs={"team": _team, "opponent": _opponent},
    )
del _team, _name, _opponent
