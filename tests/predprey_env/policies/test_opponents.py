"""Whoever can play the other team: what counts as a policy, and what is made of its answers."""

from __future__ import annotations

from pathlib import PurePosixPath
from types import MappingProxyType
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import pytest

import esp_trainer
from predprey_env import EnvConfig, team_view, vector_env
from predprey_env.config import TEAMS, TeamName
from predprey_env.policies import SCRIPTS, ScriptedTeam
from predprey_env.policies.opponents import as_policy, ask, draw_seed
from predprey_env.policies.scripted import Script

VIEWS = {"prey_0": np.ones(6, np.float32), "prey_1": np.ones(6, np.float32)}
WORLD = EnvConfig(predator_idle=False)


class Answers:
    """A policy that always gives the same answer."""

    def __init__(self, answer: Any) -> None:
        self.answer = answer

    def reset(self, seed: int | None = None) -> None:
        pass

    def act(self, observations: dict[str, np.ndarray]) -> Any:
        return self.answer


# -- as_policy ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("team", "script"), [(team, script) for team in TEAMS for script in SCRIPTS[team]])
def test_a_name_becomes_the_script_of_that_team_with_the_actions_of_the_world(team: TeamName, script: str) -> None:
    policy = as_policy(script, team, WORLD)
    assert isinstance(policy, ScriptedTeam)
    assert (policy.script, policy.team, policy.n_actions) == (script, team, 4)
    assert as_policy("greedy_chase", "predators", EnvConfig()).n_actions == 5


def test_a_policy_is_taken_as_it_is() -> None:
    policy = Answers({})
    assert as_policy(policy, "prey", WORLD) is policy


def test_a_function_is_asked_with_the_observations() -> None:
    asked = []

    def function(observations: dict[str, np.ndarray]) -> dict[str, int]:
        asked.append(observations)
        return {"prey_0": 2}

    policy = as_policy(function, "prey", WORLD)
    policy.reset(3)
    assert policy.act(VIEWS) == {"prey_0": 2}
    assert asked == [VIEWS]


@pytest.mark.parametrize("opponent", [None, 3, ["greedy_chase"], b"random", {"prey_0": 1}])
def test_what_is_neither_is_refused(opponent: Any) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        as_policy(opponent, "prey", WORLD)
    assert str(refused.value) == (
        "opponent must be the name of a script, a policy with reset(seed) and act(observations), or a function of the "
        f"observations, got {opponent!r}"
    )


def test_an_unknown_name_is_answered_with_the_scripts_of_the_team() -> None:
    line = r"^script must be one of random, flee_nearest, flee_centroid, run_straight, got 'greedy_chase'$"
    with pytest.raises(ValueError, match=line):
        as_policy("greedy_chase", "prey", WORLD)


ZOO = "load a team of the zoo with esp_trainer.load_team"
FILE = "load the file of an evolved team with esp_trainer.Team.load"
EVOLVED = [
    ("modern-3v2/prey/seed-500-late", ZOO),
    ("held-out/paper-3v1/prey/x", ZOO),
    ("runs/x/prey-00099.safetensors", FILE),
    ("prey.safetensors", FILE),
]


@pytest.mark.parametrize(("name", "remedy"), EVOLVED)
@pytest.mark.parametrize(
    "use",
    [
        lambda name: as_policy(name, "prey", WORLD),
        lambda name: ScriptedTeam(name, "prey"),
        lambda name: team_view("predators", name),
        lambda name: vector_env(2, "predators", name),
        lambda name: team_view("predators", "random").set_opponent(name),
        lambda name: vector_env(2, "predators", "random").set_opponent(name),
    ],
    ids=["as_policy", "ScriptedTeam", "team_view", "vector_env", "TeamView.set_opponent", "VectorEnv.set_opponent"],
)
def test_the_name_or_file_of_an_evolved_team_is_answered_with_how_to_load_it(use: Any, name: str, remedy: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        use(name)
    scripts = ", ".join(SCRIPTS["prey"])
    assert str(refused.value) == f"script must be one of {scripts}, got {name!r}; {remedy}({name!r})"


@pytest.mark.parametrize(
    ("name", "team"),
    [
        ("seed-500-late", "seed-500-late"),
        ("modern-3v2", "modern-3v2"),
        ("modern-3v2\\prey\\seed-500-late", "modern-3v2/prey/seed-500-late"),
    ],
)
def test_what_looks_like_a_part_of_a_zoo_teams_name_is_answered_so_too(name: str, team: str) -> None:
    with pytest.raises(ValueError, match=rf"; {ZOO}\('{team}'\)$"):
        as_policy(name, "prey", WORLD)


@pytest.mark.parametrize("name", ["greedy-chase", "Random", ""])
def test_a_misspelt_script_is_not_taken_for_a_team(name: str) -> None:
    with pytest.raises(ValueError, match=rf"^script must be one of .*, got '{name}'$"):
        as_policy(name, "prey", WORLD)


def test_a_path_is_answered_with_how_to_load_it() -> None:
    with pytest.raises(ValueError, match=r"; load the file of an evolved team with esp_trainer.Team.load\('a/b'\)$"):
        as_policy(PurePosixPath("a/b"), "prey", WORLD)


def test_the_calls_that_load_evolved_teams_are_there() -> None:
    assert as_policy(esp_trainer.load_team("paper-3v2/prey/seed-500-late"), "prey", EnvConfig()).role == "prey"
    assert callable(esp_trainer.Team.load)


class OnlyActs:
    act = Answers.act


class OnlyResets:
    reset = Answers.reset


class CannotAct(OnlyResets):
    act = 3


class OnlyActsAndIsCalled(OnlyActs):
    def __call__(self, observations: dict[str, np.ndarray]) -> Any:
        return {}


class OnlyActsOnAll:
    def act_batch(self, observations: np.ndarray) -> Any:
        return {}


class CompilesAlone(Answers):
    def __init__(self) -> None:
        super().__init__({})

    def compiled(self) -> Any:
        raise AssertionError


class ActsOnNothing(CompilesAlone):
    compiled = 3  # type: ignore[assignment]

    def act_batch(self) -> Any:
        raise AssertionError


class TakesNoSeed(OnlyActs):
    def reset(self) -> None:
        pass


class TakesTwo(OnlyResets):
    def act(self, observations: Any, states: Any) -> Any:
        return {}


@pytest.mark.parametrize(
    ("opponent", "line"),
    [
        (OnlyActs(), "opponent has act() but no reset(seed)"),
        (OnlyActsAndIsCalled(), "opponent has act() but no reset(seed)"),
        (OnlyResets(), "opponent has reset() but no act(observations)"),
        (CannotAct(), "opponent has reset() but no act(observations)"),
        (OnlyActsOnAll(), "opponent has act_batch() but no reset(seed) and no act(observations)"),
        (Answers, "opponent must be an object, got the class Answers: give Answers(...)"),
        (ScriptedTeam, "opponent must be an object, got the class ScriptedTeam: give ScriptedTeam(...)"),
        (TakesNoSeed(), "opponent's reset() cannot be called as reset(seed): too many positional arguments"),
        (TakesTwo(), "opponent's act() cannot be called as act(observations): missing a required argument: 'states'"),
        (CompilesAlone(), "opponent's compiled() cannot be called as compiled(team, env, lanes): {}"),
        (ActsOnNothing(), "opponent's act_batch() cannot be called as act_batch(observations): {}"),
        (lambda: {}, "opponent cannot be called with the observations alone: too many positional arguments"),
    ],
)
def test_what_a_policy_lacks_is_named(opponent: Any, line: str) -> None:
    for named in ("opponent", "m:P"):
        with pytest.raises(ValueError) as refused:  # noqa: PT011
            as_policy(opponent, "prey", WORLD, named)
        assert str(refused.value) == line.replace("opponent", named, 1).format("too many positional arguments")


def test_a_function_that_does_not_tell_its_arguments_is_taken() -> None:
    assert as_policy(dict.fromkeys, "prey", WORLD).act(VIEWS) == dict.fromkeys(VIEWS)


def test_a_team_that_says_that_it_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^expected prey, got surround, a script of predators$"):
        as_policy(ScriptedTeam("surround"), "prey", WORLD)
    with pytest.raises(ValueError, match=r"^predators have 4 actions in this world, got a team with 5$"):
        as_policy(ScriptedTeam("surround"), "predators", WORLD)


class Compiles(Answers):
    """Its player is what it is given, or it raises it."""

    def __init__(self, player: Any) -> None:
        super().__init__({"prey_0": 1, "prey_1": 1})
        self.player = player

    def compiled(self, team: TeamName, env: EnvConfig, lanes: int) -> Any:
        if isinstance(self.player, BaseException):
            raise self.player
        return self.player


Namesake = NamedTuple("Script", [(name, kind) for name, kind in get_type_hints(Script).items()])

COMPILED = [
    (KeyError("size"), "raised KeyError: 'size'"),
    (SystemExit("bye"), "raised SystemExit: bye"),
    *(
        (player, f"must return a player whose class has a rule: choose.register(Player, rule), got {player!r}")
        for player in (3, None, (1, 2), Namesake(1, 3, 4, False), Script)
    ),
]


@pytest.mark.parametrize(("player", "line"), COMPILED)
@pytest.mark.parametrize(
    "use",
    [
        lambda policy: as_policy(policy, "prey", WORLD),
        lambda policy: team_view("predators", policy),
        lambda policy: vector_env(2, "predators", policy),
    ],
    ids=["as_policy", "team_view", "vector_env"],
)
def test_a_player_that_no_rule_is_registered_for_is_refused(use: Any, player: Any, line: str) -> None:
    """One that has the name and the fields of another is not played by the other's rule."""
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        use(Compiles(player))
    assert str(refused.value) == f"opponent's compiled() {line}"


def test_a_policy_whose_act_batch_is_no_method_is_asked_world_by_world() -> None:
    policy = Answers({"prey_0": 1, "prey_1": 1})
    policy.act_batch = 3  # type: ignore[attr-defined]
    envs = vector_env(2, "predators", policy, size=10)
    envs.reset(seed=1)
    envs.step(np.zeros(6, int))
    assert team_view("predators", policy).opponent is not policy


# -- draw_seed ----------------------------------------------------------------------------------------------------


def test_a_seed_is_one_number_of_31_bits_from_the_generator() -> None:
    drawn, expected = np.random.default_rng(0), np.random.default_rng(0)
    seeds = [draw_seed(drawn) for _ in range(2000)]
    assert seeds == expected.integers(2**31, size=2000).tolist()
    assert {type(seed) for seed in seeds} == {int}
    assert min(seeds) >= 0
    assert 2**31 - 2**22 < max(seeds) < 2**31


# -- ask ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "answer",
    [
        {"prey_0": 3, "prey_1": 0},
        {"prey_1": np.int64(0), "prey_0": np.uint8(3)},
        {"prey_0": np.array(3), "prey_1": False},
        {"prey_0": 3, "prey_1": 0, "prey_2": None, "predator_0": 99},
        MappingProxyType({"prey_0": 3, "prey_1": 0}),
    ],
)
def test_answers_are_read_as_integers_in_the_order_of_the_observations(answer: Any) -> None:
    actions = ask(Answers(answer), VIEWS, 4)
    assert list(actions.items()) == [("prey_0", 3), ("prey_1", 0)]
    assert {type(action) for action in actions.values()} == {int}


@pytest.mark.parametrize("answer", [None, [3, 0], [0] * 30, (3, 0), "30", 3, {"prey_0"}])
def test_an_answer_that_is_no_mapping_is_the_opponents_fault(answer: Any) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        ask(Answers(answer), VIEWS, 4)
    assert str(refused.value) == (f"the opponent's act() must return a mapping from agents to actions, got {answer!r}")


@pytest.mark.parametrize(
    ("answer", "fault"),
    [
        ({"prey_0": 3}, "an action for prey_1 is missing; got actions for ['prey_0']"),
        ({}, "an action for prey_0 is missing; got actions for []"),
        ({"prey_0": 4, "prey_1": 0}, "the action of prey_0 must be in 0..3, got 4"),
        ({"prey_0": 0, "prey_1": -1}, "the action of prey_1 must be in 0..3, got -1"),
        ({"prey_0": float("nan"), "prey_1": 0}, "the action of prey_0 must be an integer, got nan"),
        ({"prey_0": 0, "prey_1": 2.0}, "the action of prey_1 must be an integer, got 2.0"),
        ({"prey_0": 0, "prey_1": [0, 1, 2]}, "the action of prey_1 must be an integer, got [0, 1, 2]"),
        ({"prey_0": None, "prey_1": 0}, "the action of prey_0 must be an integer, got None"),
    ],
)
def test_a_bad_action_is_the_opponents_fault(answer: Any, fault: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        ask(Answers(answer), VIEWS, 4)
    assert str(refused.value) == f"the opponent's act() must return an action for each agent: {fault}"


@pytest.mark.parametrize(
    "answer",
    [np.zeros((2, 2)), np.zeros(10_000), [0] * 500, {"prey_0": np.zeros((2, 2)), "prey_1": 0}, {0: "\n" * 500}],
)
def test_however_long_an_answer_is_one_line_says_what_came(answer: Any) -> None:
    with pytest.raises(ValueError, match=r"\Athe opponent's act\(\) must return [^\n]*\Z") as refused:
        ask(Answers(answer), VIEWS, 4)
    assert len(str(refused.value)) < 250


def test_what_an_opponent_raises_is_named_and_kept_as_the_cause() -> None:
    def function(observations: dict[str, np.ndarray]) -> dict[str, int]:
        raise OSError("the line is down")

    with pytest.raises(RuntimeError, match=r"^the opponent's act\(\) raised OSError: the line is down$") as raised:
        ask(as_policy(function, "prey", WORLD), VIEWS, 4)
    assert isinstance(raised.value.__cause__, OSError)
