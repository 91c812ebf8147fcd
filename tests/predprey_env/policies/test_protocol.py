"""`choose`: the rule of a player's class, in Python, in compiled code for one world, and for sixteen side by side."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit

from predprey_env import EnvConfig
from predprey_env.config import TEAMS, TeamName
from predprey_env.jit.compilation import entry_point, rule
from predprey_env.jit.lanes import LANES, lane_zeros, store
from predprey_env.policies import SCRIPTS, ScriptedTeam
from predprey_env.policies.chance import scramble
from predprey_env.policies.protocol import MEMORY, choose
from predprey_env.policies.scripted import Script

N_STEPS = 60
MOVES = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (0, 0)])


class Stranger(NamedTuple):
    """A player that nobody registered a rule for."""

    n_actions: int


@entry_point
def _choose(player: Any, agent: int, seen: Any, memory: Any, at: int, action: Any) -> None:
    store(action, 0, choose(player, agent, seen, memory, at))


def new_memory(seed: int, agent: int, at: int = 0) -> np.ndarray:
    memory = np.zeros(at + MEMORY, np.int32)
    memory[at] = scramble(seed, agent)
    return memory


# -- who is known -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("player", [Stranger(4), 3, None, (1, 2, 3)])
def test_an_unknown_player_is_refused_in_python(player: Any) -> None:
    line = f"^player must be of a class that choose\\(\\) knows, got {type(player).__name__}$"
    with pytest.raises(TypeError, match=line):
        choose(player, 0, np.ones(2, np.float32), new_memory(0, 0), 0)


@pytest.mark.parametrize("player", [Stranger(4), 3, (1, 2, 3)])
def test_an_unknown_player_is_refused_in_compiled_code(player: Any) -> None:
    with pytest.raises(ValueError, match=r"^a rule \(test_protocol.py, line \d+\) does not compile: .*_Choose"):
        _choose(player, 0, np.ones(2, np.float32), new_memory(0, 0), 0, np.zeros(1, np.int32))


@rule
def _lost(seen: Any) -> Any:
    return nowhere  # type: ignore[name-defined]  # noqa: F821


@rule
def _adds_text(seen: Any) -> Any:
    return "a" + seen[0]


@entry_point
def _finds(seen: Any) -> None:
    seen[0] = _lost(seen)


@entry_point
def _adds(seen: Any) -> None:
    seen[0] = _adds_text(seen)


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (_finds, r"the rule _lost does not compile: NameError: name 'nowhere' is not defined"),
        (_adds, r"the rule _adds_text \(test_protocol.py, line \d+\) does not compile: .* signature: add\(.*float32\)"),
    ],
)
def test_a_rule_that_does_not_compile_is_named(call: Any, line: str) -> None:
    with pytest.raises(ValueError, match=f"^{line}$"):
        call(np.ones(2, np.float32))


# -- scripts ------------------------------------------------------------------------------------------------------


class Walks:
    """What an agent sees of opponents that walk at random, each a step at a time and now and then caught, while it
    moves itself: consistent, so that memory matters.
    """

    def __init__(self, seed: int, n_opponents: int) -> None:
        self.random = np.random.default_rng(seed)
        self.offsets = self.random.integers(-6, 7, (n_opponents, 2))

    def seen(self) -> np.ndarray:
        return self.offsets.astype(np.float32).ravel()

    def move(self, action: int) -> None:
        free = (self.offsets != 0).any(axis=1, keepdims=True) & (self.random.random((len(self.offsets), 1)) > 0.01)
        self.offsets = (self.offsets + MOVES[self.random.integers(0, 4, len(free))] - MOVES[action]) * free


WORLD = EnvConfig(n_predators=2, n_prey=2)
WORLDS = [WORLD, WORLD.replace(predator_idle=False), WORLD.replace(move_order="prey_first")]


@pytest.mark.parametrize("agent", [0, 1, 2, 3])
@pytest.mark.parametrize("config", WORLDS, ids=["idle", "no idle", "in turns"])
@pytest.mark.parametrize(("team", "script"), [(team, script) for team in TEAMS for script in SCRIPTS[team]])
def test_a_block_of_worlds_chooses_like_each_of_them_alone(
    team: TeamName, script: str, agent: int, config: EnvConfig
) -> None:
    n_opponents, at = 2, MEMORY  # the rows of a team-mate before it, which it must not touch
    player = ScriptedTeam.of(script, team, config).compiled(team, config, LANES)
    worlds = [Walks(seed, n_opponents) for seed in range(LANES)]
    alone = [new_memory(seed, agent, at) for seed in range(LANES)]
    memory, seen = lane_zeros(np.int32, at + MEMORY), lane_zeros(np.float32, 2 * n_opponents)
    memory[:] = np.stack(alone, axis=1)
    actions, action = lane_zeros(np.int32, 1), np.zeros(1, np.int32)
    taken = set()
    for _ in range(N_STEPS):
        seen[:] = np.stack([world.seen() for world in worlds], axis=1)
        _choose(player, agent, seen, memory, at, actions)
        for lane, world in enumerate(worlds):
            _choose(player, agent, world.seen(), alone[lane], at, action)
            assert actions[0, lane] == action[0]
            assert memory[:, lane].tolist() == alone[lane].tolist()
            world.move(int(action[0]))
            taken.add(int(action[0]))
    assert not memory[:at].any()
    assert taken >= {0, 1, 2, 3}


@pytest.mark.parametrize("script", ["random", "intercept", "run_straight"])
def test_python_dispatches_to_the_same_rule(script: str) -> None:
    team: TeamName = "prey" if script == "run_straight" else "predators"
    policy = ScriptedTeam(script, team)
    policy.reset(11)
    player, memory = policy.compiled(team, WORLD, 0), new_memory(11, 1)
    world = Walks(3, 2)
    for _ in range(N_STEPS):
        agent = f"{'prey' if team == 'prey' else 'predator'}_1"
        action = policy.act({agent: world.seen()})[agent]
        assert choose(player, 1, world.seen(), memory, 0) == action
        world.move(action)


# -- compiled players ---------------------------------------------------------------------------------------------


def player(name: str, action: int) -> tuple[type, Any]:
    """A class of player of a name, and its rule, which always takes one action."""

    @rule
    def act(player: Any, agent: int, seen: Any, memory: Any, at: int) -> Any:
        return action + player.extra

    return NamedTuple(name, [("extra", int)]), act


@njit(_nrt=False)
def ask(player: Any, memory: Any) -> Any:
    return choose(player, 0, memory, memory, 0)


def test_players_of_one_name_have_each_its_own_rule() -> None:
    """A notebook's cell that is run again makes another class of the same name."""
    memory, answers = np.zeros(4, np.int32), []
    for action in (1, 2, 3):
        made, act = player("Again", action)
        assert choose.register(made, act) is act
        assert choose.register(made)(act) is act
        answers.append(ask(made(10), memory))
    assert answers == [11, 12, 13]


def test_a_player_whose_rule_may_be_compiled_already_is_given_no_other() -> None:
    made, act = player("Once", 1)
    choose.register(made, act)
    with pytest.raises(ValueError, match=r"^Once has a rule already; define the class anew to give it another$"):
        choose.register(made, player("Once", 2)[1])


@pytest.mark.parametrize(
    ("first", "got"), [(player("Bare", 1)[1], "act"), (int, "int"), (3, "3"), (tuple, "tuple"), (Stranger(4), None)]
)
def test_the_class_of_player_is_not_forgotten(first: Any, got: str | None) -> None:
    """``@choose.register`` alone above a rule gives the rule for the class."""
    with pytest.raises(TypeError) as refused:
        choose.register(first)
    assert str(refused.value) == (
        f"choose.register() needs the player's class first, a named tuple, got {got or 'Stranger(n_actions=4)'}"
    )


def test_a_kind_of_a_player_has_no_rule_in_python_as_in_compiled_code() -> None:
    class Kind(Script):
        pass

    with pytest.raises(TypeError, match=r"^player must be of a class that choose\(\) knows, got Kind$"):
        choose(Kind(1, 3, 4), 0, np.zeros(2, np.float32), np.ones(4, np.int32), 0)


def test_a_rule_that_is_not_compiled_is_refused() -> None:
    made, act = player("Plain", 1)
    with pytest.raises(
        TypeError, match=r"^the rule of Plain is not compiled: put @rule below @choose.register\(Plain\)$"
    ):
        choose.register(made, act.py_func)
    choose.register(made, act)
