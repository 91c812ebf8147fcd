"""Policies that play a team: the policy protocol, and scripted teams to evolve, train and compare against."""

from predprey_env.policies.names import SCRIPTS, PredatorScript, PreyScript
from predprey_env.policies.pool import OpponentPool
from predprey_env.policies.protocol import Policy, choose, memory_rows, sees_team, sight_of
from predprey_env.policies.readings import nearest, towards
from predprey_env.policies.scripted import ScriptedTeam

__all__ = [
    "SCRIPTS",
    "OpponentPool",
    "Policy",
    "PredatorScript",
    "PreyScript",
    "ScriptedTeam",
    "choose",
    "memory_rows",
    "nearest",
    "sees_team",
    "sight_of",
    "towards",
]
