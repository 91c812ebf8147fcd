"""The specification, which is the module's docstring, against the code."""

from __future__ import annotations

import copy
import inspect
import json
import pickle
import pydoc
import re
from typing import Literal, get_args, get_origin, get_type_hints

import cloudpickle  # which Gymnasium needs
import pytest

import predprey_env
from predprey_env import EnvConfig, PredPreyEnv, parallel_vector_env, predprey_v0, team_view, vector_env
from predprey_env.config import MOVES, SIGHT_OPTIONS, EnvParameters
from predprey_env.envs.parallel import RENDER_MODES

DOC = inspect.getdoc(predprey_v0)


def table(heading: str) -> list[list[str]]:
    """The rows under a heading, without those of the header."""
    section = re.split(r"^#+ ", DOC, flags=re.MULTILINE)
    (text,) = [part for part in section if part.startswith(heading)]
    rows = [
        [cell.strip() for cell in re.split(r" \| |^\| | \|$", line)[1:-1]]
        for line in re.findall(r"^\| .*\|$", text, re.M)
    ]
    return rows if heading == "Predators and prey" else rows[1:]


TABLE = dict(table("Predators and prey"))
PARAMETERS = inspect.signature(predprey_v0.parallel_env).parameters


def test_the_parameters_are_those_of_env_config_with_their_defaults() -> None:
    assert list(PARAMETERS) == [*EnvConfig.model_fields, "task", "render_mode"]
    defaults = {name: PARAMETERS[name].default for name in EnvConfig.model_fields}
    assert defaults == EnvConfig().model_dump()
    assert {parameter.kind for parameter in PARAMETERS.values()} == {inspect.Parameter.KEYWORD_ONLY}
    assert PARAMETERS["render_mode"].default is None


def test_the_parameters_have_the_types_of_env_config() -> None:
    hints = {name: field.annotation for name, field in EnvConfig.model_fields.items()}
    assert {name: PARAMETERS[name].annotation for name in EnvConfig.model_fields} == hints
    assert get_type_hints(predprey_v0.parallel_env)["render_mode"] == Literal[RENDER_MODES] | None


@pytest.mark.parametrize("make", [team_view, vector_env, parallel_vector_env])
def test_the_other_makers_spell_out_the_same_parameters(make) -> None:
    parameters = inspect.signature(make).parameters
    assert {name: parameters[name].default for name in EnvConfig.model_fields} == EnvConfig().model_dump()
    assert not any(each.kind is inspect.Parameter.VAR_KEYWORD for each in parameters.values())


def test_the_keyword_arguments_of_the_other_makers_are_those_of_env_config() -> None:
    hints = {name: field.annotation for name, field in EnvConfig.model_fields.items()}
    assert get_type_hints(EnvParameters) == hints


@pytest.mark.parametrize("make", [predprey_v0.env, predprey_v0.raw_env])
def test_the_turn_based_makers_take_the_same_parameters(make) -> None:
    assert inspect.signature(make).parameters == PARAMETERS


@pytest.mark.parametrize("name", ["env", "raw_env"])
def test_the_turn_based_makers_are_functions_of_their_own(name: str) -> None:
    make = getattr(predprey_v0, name)
    assert (make.__name__, make.__qualname__, make.__module__) == (name, name, predprey_v0.__name__)
    assert inspect.signature(make).return_annotation == "AECEnv[Any, Any, Any]"
    assert make.__doc__.startswith("Return the environment with PettingZoo's AEC API, with")
    told = pydoc.render_doc(make, renderer=pydoc.plaintext)
    assert f"{name}(*, n_predators: int = 3, n_prey: int = 2, " in told
    assert "AEC API" in told


@pytest.mark.parametrize("dumps", [pickle.dumps, cloudpickle.dumps], ids=["pickle", "cloudpickle"])
@pytest.mark.parametrize(
    "make", [predprey_v0.env, predprey_v0.raw_env, predprey_v0.parallel_env, team_view, vector_env]
)
def test_every_maker_can_be_pickled(make, dumps) -> None:
    assert pickle.loads(dumps(make)) is make


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["copy", "pickle"])
@pytest.mark.parametrize("make", [predprey_v0.env, predprey_v0.raw_env])
def test_a_turn_based_environment_can_be_copied(make, copied) -> None:
    env = make(size=6)
    env.reset(seed=3)
    env.step(1)
    twin = copied(env)
    for _ in range(12):
        for each in (env, twin):
            each.step(2)
        assert twin.agent_selection == env.agent_selection
        assert twin.last()[0].tolist() == env.last()[0].tolist()


@pytest.mark.parametrize(("name", "near"), [("sizee", "size"), ("rendermode", "render_mode"), ("n_preys", "n_prey")])
def test_an_unknown_parameter_is_told_by_the_function_that_was_called(name: str, near: str) -> None:
    for maker in ("parallel_env", "env", "raw_env"):
        line = rf"^{maker}\(\): unknown field {name}; did you mean {near}\?$"
        with pytest.raises(ValueError, match=line):
            getattr(predprey_v0, maker)(**{name: 3})


def test_every_parameter_reaches_the_world() -> None:
    changed = {
        "n_predators": 2,
        "n_prey": 3,
        "size": 20,
        "max_cycles": 9,
        "move_order": "prey_first",
        "swap_captures": True,
        "captured_prey": "removed",
        "start_collisions": "allow",
        "predator_idle": False,
        "closeness": "nearest",
        "credit": "individual",
        "prey_fitness": "complementary",
        "reward": "dense",
        **dict.fromkeys(SIGHT_OPTIONS, True),
    }
    assert set(changed) == set(EnvConfig.model_fields) - {"observation"}
    assert not changed.items() & EnvConfig().model_dump().items()
    env = predprey_v0.parallel_env(**changed, render_mode="ansi")
    assert (env.config, env.render_mode) == (EnvConfig(**changed), "ansi")
    parallel = predprey_v0.env(**changed, render_mode="ansi").unwrapped
    assert (parallel.config, parallel.render_mode) == (EnvConfig(**changed), "ansi")


def test_the_table_of_arguments_is_that_of_env_config() -> None:
    rows = {name.strip("`"): meaning for name, meaning in table("Arguments")}
    assert list(rows) == list(PARAMETERS)
    for name, field in EnvConfig.model_fields.items():
        description = " ".join(field.description.split())
        default = f"Default: `{json.dumps(field.default) if isinstance(field.default, str) else field.default}`."
        if get_origin(field.annotation) is Literal:
            choices = ", ".join(f"`{json.dumps(value)}`" for value in get_args(field.annotation))
            assert rows[name] == f"{description} One of {choices}. {default}"
        else:
            assert rows[name].startswith(description)
            assert rows[name].endswith(default)
    assert re.findall(r"`\"(\w+)\"`", rows["render_mode"]) == list(RENDER_MODES)


@pytest.mark.parametrize("name", [name for name, field in EnvConfig.model_fields.items() if field.annotation is int])
def test_the_bounds_of_the_arguments_are_those_of_env_config(name: str) -> None:
    meaning = {argument.strip("`"): meaning for argument, meaning in table("Arguments")}[name]
    low, high = re.search(r"\. (?:At least|From) (\d+)(?: to (\d+))?\. Default", meaning).groups()
    room = {"size": 10_000, "max_cycles": 1, "n_predators": 1, "n_prey": 1}
    EnvConfig(**{**room, name: int(low)})
    with pytest.raises(ValueError, match=f"{name} must be at least {low}"):
        EnvConfig(**{**room, name: int(low) - 1})
    if high:
        EnvConfig(**{**room, name: int(high)})
        with pytest.raises(ValueError, match=f"{name} must be at most {high}"):
            EnvConfig(**{**room, name: int(high) + 1})


def test_the_table_names_the_agents_of_the_default_world() -> None:
    assert TABLE["Agents"] == f"`{PredPreyEnv().possible_agents}`"


def test_the_table_gives_the_action_spaces() -> None:
    env = PredPreyEnv()
    spaces = re.findall(r"(predator|prey)s? `(Discrete\(\d\))`", TABLE["Action shape"])
    assert spaces == [(team, str(env.action_space(f"{team}_0"))) for team in ("predator", "prey")]
    assert TABLE["Action values"] == f"`[0, {env.action_space('predator_0').n - 1}]`"


@pytest.mark.parametrize("config", [EnvConfig(), EnvConfig(n_predators=4, n_prey=3, size=7)], ids=["default", "other"])
def test_the_table_gives_the_shapes_and_bounds(config: EnvConfig) -> None:
    env = PredPreyEnv(config)
    numbers = {**config.model_dump(), "n_agents": config.n_agents}

    def value_of(formula: str) -> object:
        return eval(formula, {}, numbers)  # formulas of our own docstring

    shapes = re.findall(r"(predator|prey)s? `(.*?)`", TABLE["Observation shape"])
    assert [team for team, _ in shapes] == ["predator", "prey"]
    for team, formula in shapes:
        space = env.observation_space(f"{team}_0")
        assert space.shape == value_of(formula)
        bounds = TABLE["Observation values"].strip("`")
        assert [space.low.min(), space.high.max()] == [space.low.max(), space.high.min()] == value_of(bounds)
    assert env.state_space.shape == value_of(TABLE["State shape"].strip("`"))
    assert [env.state_space.low.min(), env.state_space.high.max()] == value_of(TABLE["State values"].strip("`"))


@pytest.mark.parametrize("opponent", [0, 1])
def test_the_table_of_observations_says_what_is_where(opponent: int) -> None:
    ((entries, by_predator, by_prey),) = table("Observation space")
    assert "`prey_i`" in by_predator
    assert "`predator_i`" in by_prey
    env = PredPreyEnv(EnvConfig(n_predators=2))
    seen, _ = env.reset(options={"starts": [(0, 0), (10, 20), (3, 5), (97, 40)]})
    places = [eval(entry.replace("2 i", f"2 * {opponent}")) for entry in entries.strip("`").split(",")]
    assert seen["predator_0"][places].tolist() == [[3, 5], [-3, 40]][opponent]
    assert seen["prey_0"][places].tolist() == [[-3, -5], [7, 15]][opponent]


def test_the_table_of_actions_says_what_moves_where() -> None:
    env = PredPreyEnv(EnvConfig(n_predators=1, n_prey=1, size=9))
    rows = table("Action space")
    assert len(rows) == env.action_space("predator_0").n
    for number, move in rows:
        env.reset(options={"starts": [(4, 4), (0, 0)]})
        env.step({"predator_0": int(number), "prey_0": 0})
        x, y = env.state()[[0, 2]].astype(int).tolist()
        told = re.search(r"([xy]) ([+-]) 1", move)
        change = {"x": 0, "y": 0} | ({told[1]: int(f"{told[2]}1")} if told else {})
        assert (x - 4, y - 4) == (change["x"], change["y"])
        assert MOVES[int(number)] == re.match(r"\w+", move)[0]
    assert [move for _, move in rows if "predators only" in move] == [rows[-1][1]]


@pytest.mark.parametrize("caught", [0, 1, 2])
def test_the_table_of_rewards_gives_the_fitness(caught: int) -> None:
    """One predator among two prey, of which it catches so many in its last step."""
    prey = [(1, 0) if i < caught else (5, 4) for i in range(2)]
    env = PredPreyEnv(EnvConfig(n_predators=1, n_prey=2, size=10, max_cycles=1))
    env.reset(options={"starts": [(0, 0), *prey]})
    _, rewards, *_ = env.step({"predator_0": 4, "prey_0": 1, "prey_1": 1})
    distance = (4 + 4) / 10  # of a free prey that went west
    numbers = {"g": caught, "n": 2, "d": 1 - distance, "rho": 1, "R": 1}
    for team, condition, formula in table("Rewards"):
        holds = condition.strip("`").replace("0 < g < n", "0 < g and g < n").replace("=", "==")
        if eval(holds, {}, numbers):
            assert rewards["predator_0" if team == "predators" else "prey_0"] == eval(formula.strip("`"), {}, numbers)


def test_the_infos_are_those_described() -> None:
    _, infos = PredPreyEnv().reset(seed=0)
    assert [key.strip("`") for key, _ in table("Info")] == list(infos["prey_0"])


def test_the_module_is_named_after_its_version() -> None:
    assert predprey_v0.__name__.rpartition(".")[2] == PredPreyEnv.metadata["name"]
    assert set(predprey_v0.__all__) == {"env", "parallel_env", "raw_env"} <= set(predprey_env.__all__)
    assert predprey_env.parallel_env is predprey_v0.parallel_env
