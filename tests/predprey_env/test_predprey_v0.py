"""The specification, which is the module's docstring, against the code."""

from __future__ import annotations

import inspect
import re
from typing import Literal, get_type_hints

import pytest

import predprey_env
from predprey_env import EnvConfig, PredPreyEnv, predprey_v0
from predprey_env.parallel_env import RENDER_MODES

TABLE = dict(re.findall(r"^\| (\S.*?) +\| (.*?) +\|$", predprey_v0.__doc__, re.MULTILINE))
PARAMETERS = inspect.signature(predprey_v0.parallel_env).parameters


def test_the_parameters_are_those_of_env_config_with_their_defaults() -> None:
    assert list(PARAMETERS) == [*EnvConfig.model_fields, "render_mode"]
    defaults = {name: parameter.default for name, parameter in PARAMETERS.items() if name != "render_mode"}
    assert defaults == EnvConfig().model_dump()
    assert {parameter.kind for parameter in PARAMETERS.values()} == {inspect.Parameter.KEYWORD_ONLY}
    assert PARAMETERS["render_mode"].default is None


def test_the_parameters_have_the_types_of_env_config() -> None:
    hints = get_type_hints(predprey_v0.parallel_env)
    assert {name: hints[name] for name in EnvConfig.model_fields} == {
        name: field.annotation for name, field in EnvConfig.model_fields.items()
    }
    assert hints["render_mode"] == Literal[RENDER_MODES] | None


@pytest.mark.parametrize("make", [predprey_v0.env, predprey_v0.raw_env])
def test_the_turn_based_makers_take_the_same_parameters(make) -> None:
    assert inspect.signature(make).parameters == PARAMETERS


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
    }
    assert set(changed) == set(EnvConfig.model_fields)
    assert not changed.items() & EnvConfig().model_dump().items()
    env = predprey_v0.parallel_env(**changed, render_mode="ansi")
    assert (env.config, env.render_mode) == (EnvConfig(**changed), "ansi")
    parallel = predprey_v0.env(**changed, render_mode="ansi").unwrapped
    assert (parallel.config, parallel.render_mode) == (EnvConfig(**changed), "ansi")


def test_the_table_names_the_agents_of_the_default_world() -> None:
    names = PredPreyEnv().possible_agents
    for team, count in re.findall(r"``(\w+)_0``\.\. \((\d)\)", TABLE["Agents"]):
        assert sum(name.startswith(team) for name in names) == int(count)
    assert len(re.findall(r"\(\d\)", TABLE["Agents"])) == 2


def test_the_table_gives_the_action_spaces() -> None:
    env = PredPreyEnv()
    spaces = re.findall(r"(predator|prey)s? ``(Discrete\(\d\))``", TABLE["Action shape"])
    assert spaces == [(team, str(env.action_space(f"{team}_0"))) for team in ("predator", "prey")]


@pytest.mark.parametrize("config", [EnvConfig(), EnvConfig(n_predators=4, n_prey=3, size=7)], ids=["default", "other"])
def test_the_table_gives_the_shapes_and_bounds(config: EnvConfig) -> None:
    env = PredPreyEnv(config)
    numbers = {
        "n_predators": config.n_predators,
        "n_prey": config.n_prey,
        "n_agents": config.n_agents,
        "size": config.size,
    }

    def value_of(formula: str) -> object:
        return eval(formula.replace("2 n", "2 * n"), {}, numbers)  # formulas of our own docstring

    shapes = re.findall(r"(predator|prey)s? ``(.*?)``", TABLE["Observation shape"])
    assert [team for team, _ in shapes] == ["predator", "prey"]
    for team, formula in shapes:
        space = env.observation_space(f"{team}_0")
        assert space.shape == value_of(formula)
        bounds = re.search(r"``(.*)``", TABLE["Observation values"])[1]
        assert [space.low.min(), space.high.max()] == [space.low.max(), space.high.min()] == value_of(bounds)
    assert env.state_space.shape == value_of(re.search(r"``(.*)``", TABLE["State shape"])[1])


def test_the_numbers_of_the_actions_are_those_of_the_world() -> None:
    env = PredPreyEnv(EnvConfig(n_predators=1, n_prey=1, size=9))
    listed = re.search(r"\*\*Actions\.\*\* (.*?)\. All", predprey_v0.__doc__.replace("\n", " "))[1]
    ways = {"east": (1, 0), "west": (-1, 0), "north": (0, 1), "south": (0, -1), "idle": (0, 0)}
    found = re.findall(rf"(\d) ({'|'.join(ways)})", listed)
    assert len(found) == env.action_space("predator_0").n
    for number, word in found:
        env.reset(options={"starts": [(4, 4), (0, 0)]})
        env.step({"predator_0": int(number), "prey_0": 0})
        x, y = env.state()[[0, 2]].tolist()
        assert (x - 4, y - 4) == ways[word]


def test_the_infos_are_those_described() -> None:
    _, infos = PredPreyEnv().reset(seed=0)
    paragraph = re.search(r"\*\*Info\.\*\*(.*?)\n\n", predprey_v0.__doc__, re.DOTALL)[1]
    assert re.findall(r"``(\w+)``", paragraph) == list(infos["prey_0"])


def test_the_module_is_named_after_its_version() -> None:
    assert predprey_v0.__name__.rpartition(".")[2] == PredPreyEnv.metadata["name"]
    assert set(predprey_v0.__all__) == {"env", "parallel_env", "raw_env"} <= set(predprey_env.__all__)
    assert predprey_env.parallel_env is predprey_v0.parallel_env
