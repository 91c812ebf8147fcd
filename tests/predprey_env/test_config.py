from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from predprey_env import EnvConfig
from predprey_env.config import PAYOFF, SHAPES, Rules
from predprey_env.settings import Settings, counted
from predprey_env.sight import Sight


class Inner(Settings):
    depth: int = 1


class Outer(Settings):
    name: str
    inner: Inner = Inner()


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"n_predators": 0}, "n_predators must be at least 1, got 0"),
        ({"n_prey": -2}, "n_prey must be at least 1, got -2"),
        ({"size": 2}, "size must be at least 3, got 2"),
        ({"size": 1}, "size must be at least 3, got 1"),
        ({"size": 10_001}, "size must be at most 10000, got 10001"),
        ({"max_cycles": 0}, "max_cycles must be at least 1, got 0"),
        ({"size": 3, "n_predators": 8}, "10 agents need at least as many cells, got size=3"),
    ],
)
def test_numbers_out_of_range_are_refused_in_one_line(fields: dict[str, object], line: str) -> None:
    assert _refusal(fields) == line


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"n_prey": 2.0}, "n_prey must be an integer, got 2.0"),
        ({"n_prey": "2"}, "n_prey must be an integer, got '2'"),
        ({"n_prey": True}, "n_prey must be an integer, got True"),
        ({"size": float("nan")}, "size must be an integer, got nan"),
        ({"max_cycles": None}, "max_cycles must be an integer, got None"),
        ({"swap_captures": 1}, "swap_captures must be a boolean, got 1"),
        ({"predator_idle": "yes"}, "predator_idle must be a boolean, got 'yes'"),
    ],
)
def test_values_of_the_wrong_type_are_refused_in_one_line(fields: dict[str, object], line: str) -> None:
    assert _refusal(fields) == line


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"size": np.float64(20)}, "size must be an integer, got 20.0"),
        ({"size": np.bool_(True)}, "size must be an integer, got True"),
        ({"size": np.str_("20")}, "size must be an integer, got '20'"),
        ({"size": np.array([20])}, "size must be an integer, got array([20])"),
        ({"size": np.int64(2)}, "size must be at least 3, got 2"),
        ({"swap_captures": np.int64(1)}, "swap_captures must be a boolean, got 1"),
    ],
)
def test_numpy_values_of_the_wrong_type_are_refused_as_pythons_own(fields: dict[str, object], line: str) -> None:
    assert _refusal(fields) == line


@pytest.mark.parametrize("twenty", [np.int64(20), np.int8(20), np.uint64(20), np.array(20)])
def test_numpy_scalars_are_kept_as_plain_values(twenty: object) -> None:
    config = EnvConfig(size=twenty, swap_captures=np.bool_(True), reward=np.str_("dense"))
    expected = EnvConfig(size=20, swap_captures=True, reward="dense")
    assert config == expected
    assert hash(config) == hash(expected)
    assert [type(value) for value in config.model_dump().values()] == [
        type(value) for value in expected.model_dump().values()
    ]
    assert json.dumps(config.model_dump()) == json.dumps(expected.model_dump())
    assert EnvConfig().replace(size=twenty).size == 20
    assert Outer.from_dict({"name": "a", "inner": {"depth": twenty}}) == Outer(name="a", inner=Inner(depth=20))


@pytest.mark.parametrize(
    ("field", "choices"),
    [
        ("move_order", "'simultaneous' or 'prey_first'"),
        ("captured_prey", "'inert' or 'removed'"),
        ("start_collisions", "'redraw' or 'allow'"),
        ("closeness", "'uncaught', 'all' or 'nearest'"),
        ("credit", "'team' or 'individual'"),
        ("prey_fitness", "'lifespan' or 'complementary'"),
        ("reward", "'terminal' or 'dense'"),
    ],
)
@pytest.mark.parametrize("value", ["other", 0, None])
def test_an_unknown_choice_is_answered_with_the_known_ones(field: str, choices: str, value: object) -> None:
    assert _refusal({field: value}) == f"{field} must be {choices}, got {value!r}"


def test_an_unknown_field_is_answered_with_the_nearest_one() -> None:
    assert _refusal({"sise": 50}) == "unknown field sise; did you mean size?"
    assert _refusal({"n_predator": 2}) == "unknown field n_predator; did you mean n_predators?"
    assert _refusal({"wind": 2}) == "unknown field wind"


def test_several_faults_are_answered_with_the_first() -> None:
    assert _refusal({"size": 1, "n_predators": 0, "wind": 2}) == "n_predators must be at least 1, got 0"


def _refusal(fields: dict[str, object]) -> str:
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the callers compare the whole text
        EnvConfig(**fields)
    assert not isinstance(refused.value, ValidationError)  # whose text has many lines
    return str(refused.value)


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({}, "name is missing"),
        ({"name": "a", "inner": {"depth": "deep"}}, "inner.depth must be an integer, got 'deep'"),
        ({"name": "a", "inner": {"dept": 2}}, "unknown field inner.dept; did you mean inner.depth?"),
        ({"name": "a", "depth": 2}, "unknown field depth; did you mean inner.depth?"),
        ([("name", "a")], "Outer must be a mapping of fields, got [('name', 'a')]"),
    ],
)
def test_faults_of_nested_settings_name_the_whole_path(fields: object, line: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        Outer.from_dict(fields)
    assert str(refused.value) == line


def test_a_config_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="frozen"):
        EnvConfig().size = 5


def test_replace_gives_a_validated_copy() -> None:
    config = EnvConfig(size=20, swap_captures=True)
    assert config.replace(n_prey=1) == EnvConfig(size=20, swap_captures=True, n_prey=1)
    assert config == EnvConfig(size=20, swap_captures=True)
    with pytest.raises(ValueError, match=r"^size must be at least 3, got 1$"):
        config.replace(size=1)
    with pytest.raises(ValueError, match=r"^unknown field sise; did you mean size\?$"):
        config.replace(sise=5)


@given(config=st.from_type(EnvConfig))
def test_a_config_survives_json(config: EnvConfig) -> None:
    assert EnvConfig.from_dict(json.loads(config.model_dump_json())) == config
    assert EnvConfig.from_dict(json.loads(json.dumps(config.model_dump()))) == config


def test_every_field_is_described() -> None:
    assert [name for name, field in EnvConfig.model_fields.items() if not field.description] == []


def test_the_defaults_are_the_papers_world() -> None:
    config = EnvConfig()
    assert (config.n_predators, config.n_prey, config.size, config.max_cycles) == (3, 2, 100, 150)
    assert (config.n_agents, config.n_predator_actions, config.n_prey_actions) == (5, 5, 4)
    assert EnvConfig(predator_idle=False).n_predator_actions == 4


def test_compiled_code_reads_every_switch() -> None:
    assert EnvConfig().rules == Rules(3, 2, 100, 150, False, False, 0, False, False, Sight())
    other = EnvConfig(
        n_predators=1,
        n_prey=4,
        size=7,
        max_cycles=9,
        move_order="prey_first",
        swap_captures=True,
        closeness="nearest",
        credit="individual",
        prey_fitness="complementary",
        see_nearest_first=True,
    )
    assert other.rules == Rules(1, 4, 7, 9, True, True, 2, True, True, Sight(nearest_first=True))
    assert EnvConfig(closeness="all").rules.closeness == 1


def test_payoff_and_shapes_are_fields_of_their_own() -> None:
    assert EnvConfig.model_fields.keys() >= PAYOFF | SHAPES
    assert not PAYOFF & SHAPES


def test_one_of_something_is_not_told_in_the_plural() -> None:
    assert [counted(n, "run") for n in (0, 1, 2)] == ["0 runs", "1 run", "2 runs"]
    assert [counted(n, "prey") for n in (1, 2)] == ["1 prey", "2 prey"]
