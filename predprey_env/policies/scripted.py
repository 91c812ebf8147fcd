"""Scripted teams: every agent of a team follows the same script, from the paper's observation alone."""

from __future__ import annotations

import re
from pathlib import PurePath
from typing import NamedTuple

import numpy as np

from predprey_env.agents import PREFIXES, agent_number, other_team
from predprey_env.arrays import Observation, Observations
from predprey_env.config import TEAMS, EnvConfig, TeamName
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.lanes import load, store
from predprey_env.jit.values import FloatRows, IntegerRows, Value
from predprey_env.policies.chance import next_state, pick
from predprey_env.policies.names import SCRIPTS
from predprey_env.policies.predators import greedy_chase, intercept, parity_chase, surround
from predprey_env.policies.prey import flee_centroid, flee_nearest, run_straight
from predprey_env.policies.protocol import Memories, choose
from predprey_env.settings import counted, plain, whole_number
from predprey_env.sight import PLAIN_SIGHT

RANDOM, GREEDY_CHASE, PARITY_CHASE, INTERCEPT, SURROUND, FLEE_NEAREST, FLEE_CENTROID, RUN_STRAIGHT = range(1, 9)

NUMBERS = {
    "random": RANDOM,
    "greedy_chase": GREEDY_CHASE,
    "parity_chase": PARITY_CHASE,
    "intercept": INTERCEPT,
    "surround": SURROUND,
    "flee_nearest": FLEE_NEAREST,
    "flee_centroid": FLEE_CENTROID,
    "run_straight": RUN_STRAIGHT,
}
"""Number of each script in compiled code."""

KEEP_STEP = (PARITY_CHASE, INTERCEPT, SURROUND)
"""Scripts that play differently if teams move in turns."""


class Script(NamedTuple):
    """A scripted team in the form that compiled code reads."""

    number: int
    """Number of the script, one of :data:`NUMBERS`."""
    n_opponents: int
    n_actions: int
    in_turns: bool = False
    """True if the predators move after the prey, and see its move."""


@rule
def follow(script: Script, agent: int, seen: FloatRows, memory: IntegerRows, at: int) -> Value:
    """Return the action of one agent of a scripted team; see :func:`predprey_env.policies.protocol.choose`."""
    number, n_opponents, n_actions, in_turns = script
    if number == GREEDY_CHASE:
        return greedy_chase(seen, n_opponents, n_actions)
    if number == PARITY_CHASE:
        return parity_chase(seen, n_opponents, n_actions, in_turns)
    if number == INTERCEPT:
        return intercept(seen, n_opponents, n_actions, in_turns, memory, at)
    if number == SURROUND:
        return surround(agent, seen, n_opponents, n_actions, in_turns)
    if number == FLEE_NEAREST:
        return flee_nearest(seen, n_opponents)
    if number == FLEE_CENTROID:
        return flee_centroid(seen, n_opponents)
    if number == RUN_STRAIGHT:
        return run_straight(seen, n_opponents, memory, at)
    state = load(memory, at)
    store(memory, at, next_state(state))
    return pick(state, n_actions)


choose.register(Script, follow)


@entry_point
def _act(script: Script, agent: int, seen: FloatRows, memory: IntegerRows) -> int:
    return follow(script, agent, seen, memory, 0)


def how_to_load(name: object) -> str:
    """Return a hint on how to load an evolved team, to add to an error about its name or path.

    This package cannot read evolved teams. The hint is empty if the name does not look like that of a team.
    """
    if not isinstance(name, str | PurePath):
        return ""
    path = PurePath(name)
    if path.suffix == ".safetensors" or isinstance(name, PurePath):
        return f"; load the file of an evolved team with esp_trainer.Team.load({str(name)!r})"
    if re.search(r"[/\\\d]", name) and not path.suffix:  # no script's name has a slash or a digit
        team = name.replace("\\", "/")
        return f"; load a team of the zoo with esp_trainer.load_team({team!r})"
    return ""


class ScriptedTeam:
    """A team in which every agent follows the same script.

    It follows the policy protocol. An agent's role in a script depends on the number at the end of the agent's name.

    Args:
        script: Name of the script, one of the team's :data:`SCRIPTS`.
        team: Team that the script plays; needed only for ``random``, which both teams can play.
        n_actions: Number of actions of an agent; by default 5 for predators and 4 for prey.
        in_turns: True if the predators move after the prey, and see its move.
    """

    sight = PLAIN_SIGHT
    """Observation of scripts, in every world."""

    def __init__(
        self, script: str, team: TeamName | None = None, n_actions: int | None = None, *, in_turns: bool = False
    ) -> None:
        if team is not None and team not in TEAMS:
            raise ValueError(f"team must be {' or '.join(TEAMS)}, got {team!r}")
        if not isinstance(plain(in_turns), bool):
            raise ValueError(f"in_turns must be a boolean, got {in_turns!r}")
        teams = [name for name, scripts in SCRIPTS.items() if script in scripts and team in (None, name)]
        if not teams:
            known = NUMBERS if team is None else SCRIPTS[team]
            raise ValueError(f"script must be one of {', '.join(known)}, got {script!r}{how_to_load(script)}")
        if len(teams) > 1:
            raise ValueError(f"{script} can be predators or prey: name the team")
        self.script = script
        self.team = teams[0]
        n_actions = EnvConfig().team(self.team).n_actions if n_actions is None else n_actions
        self.n_actions = whole_number("n_actions", n_actions, 4)  # scripts use all four moves
        self.in_turns = plain(in_turns)
        self._n_opponents: int | None = None  # any number
        self._memories = Memories(self.team == "prey")

    def reset(self, seed: int | None = None) -> None:
        """Start an episode; without a seed, random choices differ each time."""
        self._memories.reset(seed)

    def act(self, observations: Observations) -> dict[str, int]:
        """Return an action for each agent that has an observation; agents of the other team are skipped."""
        other = PREFIXES[other_team(self.team)]
        return {agent: self._choose(agent, seen) for agent, seen in observations.items() if not agent.startswith(other)}

    def compiled(self, team: TeamName, env: EnvConfig, lanes: int) -> Script:  # noqa: ARG002 - the same for any number
        """Return the team as a player in compiled code.

        Raises :class:`ValueError` if the script cannot play that team in that world.
        """
        _, n_opponents, n_actions, _ = env.team(team)
        if self.team != team:
            raise ValueError(f"expected {team}, got {self.script}, a script of {self.team}")
        if self.n_actions != n_actions:
            raise ValueError(f"{team} have {n_actions} actions in this world, got a team with {self.n_actions}")
        in_turns = env.move_order == "prey_first"
        if self.in_turns != in_turns and NUMBERS[self.script] in KEEP_STEP:
            raise ValueError(f"{self.script} needs in_turns={in_turns} in this world, got {self.in_turns}")
        return Script(NUMBERS[self.script], n_opponents, n_actions, self.in_turns)

    @classmethod
    def of(cls, script: str, team: TeamName, env: EnvConfig) -> ScriptedTeam:
        """Return the scripted team for a world."""
        made = cls(script, team, env.team(team).n_actions, in_turns=env.move_order == "prey_first")
        made._n_opponents = env.team(team).n_opponents
        return made

    def _choose(self, agent: str, seen: Observation) -> int:
        n_opponents = len(seen) // 2 if self._n_opponents is None else self._n_opponents
        if len(seen) != 2 * n_opponents:
            raise ValueError(
                f"{self.script} must observe the offsets to {counted(n_opponents, 'opponent')}, {2 * n_opponents} "
                f"numbers, got {len(seen)}: give it env.observe_as(policy.sight)"
            )
        script = Script(NUMBERS[self.script], n_opponents, self.n_actions, self.in_turns)
        number = agent_number(agent)
        return int(_act(script, number, np.ascontiguousarray(seen, np.float32), self._memories.of(number)))
