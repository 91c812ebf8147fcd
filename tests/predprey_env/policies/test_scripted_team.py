"""A scripted team as a policy: whose agents it plays, what it forgets, what it refuses."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from predprey_env import EnvConfig, predprey_v0
from predprey_env.agents import PREFIXES, agent_number, other_team
from predprey_env.config import TEAMS, TeamName
from predprey_env.policies import SCRIPTS, Policy, ScriptedTeam
from predprey_env.policies.scripted import NUMBERS, Script

Offsets = Callable[..., np.ndarray]
ALL = [(team, script) for team in TEAMS for script in SCRIPTS[team]]


# -- names --------------------------------------------------------------------------------------------------------


def test_the_scripts_are_those_of_the_documentation() -> None:
    assert SCRIPTS == {
        "predators": ("random", "greedy_chase", "parity_chase", "intercept", "surround"),
        "prey": ("random", "flee_nearest", "flee_centroid", "run_straight"),
    }
    assert set(NUMBERS) == {script for _, script in ALL}


def test_compiled_code_knows_each_script_by_a_number_of_its_own() -> None:
    """Not 0, by which the trainer's kernel knows networks."""
    assert len(set(NUMBERS.values())) == len(NUMBERS)
    assert 0 not in NUMBERS.values()


def test_agents_are_named_by_team_and_number() -> None:
    assert [other_team(team) for team in TEAMS] == ["prey", "predators"]
    assert PREFIXES == {"predators": "predator_", "prey": "prey_"}
    assert [agent_number(agent) for agent in ("predator_0", "prey_12", "red_adversary_3")] == [0, 12, 3]


@pytest.mark.parametrize("agent", ["predator", "predator_", "predator_x", "predator_-1", "predator_1.5"])
def test_an_agent_without_a_number_is_refused(agent: str, offsets: Offsets) -> None:
    line = f"^{agent} must end in an underscore and the agent's number$"
    with pytest.raises(ValueError, match=line):
        agent_number(agent)
    with pytest.raises(ValueError, match=line):
        ScriptedTeam("greedy_chase").act({agent: offsets((1, 2))})


# -- whose agents -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("team", "script"), ALL)
def test_a_team_acts_for_its_own_agents_only(team: TeamName, script: str) -> None:
    env = predprey_v0.parallel_env()
    observations, _ = env.reset(seed=0)
    own = [agent for agent in env.agents if agent.startswith(PREFIXES[team])]
    policy = ScriptedTeam(script, team)
    assert isinstance(policy, Policy)
    actions = policy.act(observations)
    assert list(actions) == own
    assert all(type(action) is int and action in env.action_space(agent) for agent, action in actions.items())
    assert policy.act({}) == {}
    assert list(policy.act({own[1]: observations[own[1]]})) == own[1:2]


def test_agents_of_another_name_are_played(offsets: Offsets) -> None:
    """A team evolved or scripted here can be tried in worlds that call their agents otherwise."""
    assert ScriptedTeam("greedy_chase").act({"adversary_1": offsets((5, 1)), "prey_0": offsets((5, 1))}) == {
        "adversary_1": 0
    }


def test_integers_and_doubles_are_seen_as_well(offsets: Offsets) -> None:
    for kind in (np.int64, np.int32, np.float64):
        for script in SCRIPTS["predators"][1:]:
            seen = {"predator_2": offsets((0, 0), (3, 5)).astype(kind)}
            assert ScriptedTeam(script).act(seen) == ScriptedTeam(script).act({"predator_2": offsets((0, 0), (3, 5))})


@pytest.mark.parametrize("seen", [np.array([[0, 3], [5, 3]], np.float32)[:, 0], [0.0, 5.0]], ids=["strided", "list"])
def test_views_of_any_layout_are_seen(seen: object) -> None:
    assert ScriptedTeam("greedy_chase").act({"predator_0": seen}) == {"predator_0": 2}


# -- episodes -----------------------------------------------------------------------------------------------------


def episode(policy: ScriptedTeam, n_steps: int = 30) -> list[dict[str, int]]:
    """What two agents do about the same things that they see."""
    seen = np.random.default_rng(0).integers(-9, 10, (n_steps, 2, 4)).astype(np.float32)
    return [policy.act({f"{PREFIXES[policy.team]}{i}": seen[step, i] for i in range(2)}) for step in range(n_steps)]


@pytest.mark.parametrize(("team", "script"), ALL)
def test_an_episode_follows_from_the_seed_whatever_went_before(team: TeamName, script: str) -> None:
    used, new = ScriptedTeam(script, team), ScriptedTeam(script, team)
    used.reset(1)
    episode(used, 7)
    for policy in (used, new):
        policy.reset(2)
    assert episode(used) == episode(new)


@pytest.mark.parametrize(("team", "script"), ALL)
def test_only_what_is_random_depends_on_the_seed(team: TeamName, script: str) -> None:
    episodes = []
    for seed in (None, 0, 1, 2**31 - 1, np.int64(5)):
        policy = ScriptedTeam(script, team)
        policy.reset(seed)
        episodes.append(str(episode(policy)))
    assert len(set(episodes)) == (5 if script == "random" else 1)


def test_a_team_that_was_never_reset_plays_at_once() -> None:
    assert len(episode(ScriptedTeam("random", "prey"))) == 30


@pytest.mark.parametrize(("team", "script"), ALL)
@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda policy: pickle.loads(pickle.dumps(policy))])
def test_a_copy_goes_on_like_the_original_and_shares_nothing(team: TeamName, script: str, duplicate: Callable) -> None:
    policy = ScriptedTeam(script, team)
    policy.reset(4)
    episode(policy, 5)
    twin = duplicate(policy)
    assert episode(policy) == episode(twin)


# -- what is refused ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            ("swim",),
            f"script must be one of {', '.join(NUMBERS)}, got 'swim'",
        ),
        (
            ("flee_nearest", "predators"),
            "script must be one of random, greedy_chase, parity_chase, intercept, surround, got 'flee_nearest'",
        ),
        (
            ("surround", "prey"),
            "script must be one of random, flee_nearest, flee_centroid, run_straight, got 'surround'",
        ),
        (("random",), "random can be predators or prey: name the team"),
    ],
)
def test_a_script_that_the_team_does_not_have_is_refused(arguments: tuple[str, ...], line: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        ScriptedTeam(*arguments)
    assert str(refused.value) == line


@pytest.mark.parametrize("team", ["birds", ["prey"], {"prey"}, 3])
def test_an_unknown_team_is_refused(team: Any) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        ScriptedTeam("random", team)
    assert str(refused.value) == f"team must be predators or prey, got {team!r}"


@pytest.mark.parametrize("in_turns", [3, None, "prey_first", 1.0])
def test_whether_teams_move_in_turns_is_yes_or_no(in_turns: Any) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        ScriptedTeam("surround", in_turns=in_turns)
    assert str(refused.value) == f"in_turns must be a boolean, got {in_turns!r}"
    assert ScriptedTeam("surround", in_turns=np.bool_(True)).in_turns is True


@pytest.mark.parametrize("n_actions", [3, 5.0, "5", True, np.float64(5), np.bool_(True)])
def test_a_number_of_actions_that_is_none_is_refused(n_actions: Any) -> None:
    with pytest.raises(ValueError, match=r"^n_actions must be an integer of at least 4, got "):
        ScriptedTeam("greedy_chase", n_actions=n_actions)


def test_a_number_of_actions_may_be_numpys() -> None:
    team = ScriptedTeam("parity_chase", n_actions=np.int64(5), in_turns=np.bool_(True))
    assert type(team.n_actions) is int
    assert team.compiled("predators", EnvConfig(move_order="prey_first"), 0).in_turns is True


# -- compiled -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lanes", [0, 16])
@pytest.mark.parametrize(("team", "script"), ALL)
def test_compiled_code_gets_the_script_and_the_numbers_of_the_world(team: TeamName, script: str, lanes: int) -> None:
    env = EnvConfig(n_predators=4, n_prey=3, predator_idle=False)
    player = ScriptedTeam(script, team, n_actions=4).compiled(team, env, lanes)
    assert player == Script(NUMBERS[script], 3 if team == "predators" else 4, 4, False)
    assert type(player) is Script


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
@pytest.mark.parametrize("predator_idle", [True, False])
@pytest.mark.parametrize(("team", "script"), ALL)
def test_a_team_can_be_made_for_a_world(team: TeamName, script: str, predator_idle: bool, move_order: str) -> None:
    env = EnvConfig(n_predators=4, n_prey=3, predator_idle=predator_idle, move_order=move_order)
    n_opponents, n_actions = (3, 4 + predator_idle) if team == "predators" else (4, 4)
    player = ScriptedTeam.of(script, team, env).compiled(team, env, 0)
    assert player == Script(NUMBERS[script], n_opponents, n_actions, move_order == "prey_first")


KEEPS_STEP = {"parity_chase", "intercept", "surround"}


@pytest.mark.parametrize(("team", "script"), [pair for pair in ALL if pair[1] not in KEEPS_STEP])
def test_scripts_that_do_not_keep_step_play_in_turns_or_not(team: TeamName, script: str) -> None:
    for move_order, in_turns in [("prey_first", False), ("simultaneous", True)]:
        policy = ScriptedTeam(script, team, in_turns=in_turns)
        assert policy.compiled(team, EnvConfig(move_order=move_order), 0).number == NUMBERS[script]


@pytest.mark.parametrize(
    ("policy", "team", "fields", "line"),
    [
        (ScriptedTeam("flee_nearest"), "predators", {}, "expected predators, got flee_nearest, a script of prey"),
        (ScriptedTeam("random", "predators"), "prey", {}, "expected prey, got random, a script of predators"),
        (
            ScriptedTeam("greedy_chase"),
            "predators",
            {"predator_idle": False},
            "predators have 4 actions in this world, got a team with 5",
        ),
        (
            ScriptedTeam("surround"),
            "predators",
            {"move_order": "prey_first"},
            "surround needs in_turns=True in this world, got False",
        ),
        (
            ScriptedTeam("parity_chase", in_turns=True),
            "predators",
            {},
            "parity_chase needs in_turns=False in this world, got True",
        ),
    ],
)
def test_a_world_that_a_team_cannot_play_in_is_refused(
    policy: ScriptedTeam, team: TeamName, fields: dict[str, object], line: str
) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        policy.compiled(team, EnvConfig(**fields), 0)
    assert str(refused.value) == line
