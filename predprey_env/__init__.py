"""Predators and prey on a toroid, as a PettingZoo environment."""

import pettingzoo

from predprey_env.config import EnvConfig
from predprey_env.envs.both import ParallelVectorEnv, parallel_vector_env
from predprey_env.envs.parallel import PredPreyEnv
from predprey_env.envs.team import TeamView, team_view
from predprey_env.envs.vector import PredPreyVectorEnv, vector_env
from predprey_env.policies import SCRIPTS, OpponentPool, Policy, ScriptedTeam, choose, sees_team
from predprey_env.predprey_v0 import env, parallel_env, raw_env

__all__ = [
    "SCRIPTS",
    "EnvConfig",
    "OpponentPool",
    "ParallelVectorEnv",
    "Policy",
    "PredPreyEnv",
    "PredPreyVectorEnv",
    "ScriptedTeam",
    "TeamView",
    "choose",
    "env",
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
