"""Every field of the config is an option, and every option is described."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest

from esp_trainer.cli.overrides import describe_fields, override
from esp_trainer.config import RunConfig
from esp_trainer.presets import PRESETS, preset
from esp_trainer.tasks import WORLDS
from predprey_env.settings import field_names

if TYPE_CHECKING:
    from collections.abc import Callable

FIELDS = field_names(RunConfig)
CHOSEN = [name for name in FIELDS if name not in ("preset", "league")]
"""All that one may set: the preset's name is its first argument, and the league follows from ``--league``."""

EARLIER = "cosample, previous_champion, hall_of_fame, mixed"


def _described(text: str) -> dict[str, str]:
    """Option -> value, as a description shows them."""
    return dict(re.findall(r"^  --(\S+) ?(.*)$", text, re.MULTILINE))


def _get(config: RunConfig, name: str) -> Any:
    value: Any = config
    for part in name.split("."):
        value = getattr(value, part)
    return value


@pytest.mark.parametrize(
    ("options", "name", "value"),
    [
        (["--seed", "3"], "seed", 3),
        (["--seed=3"], "seed", 3),
        (["--seed", "3", "--seed", "4"], "seed", 4),
        (["--checkpoint-every", "7"], "checkpoint_every", 7),
        (["--checkpoint_every=7"], "checkpoint_every", 7),
        (["--env.n-prey", "1"], "env.n_prey", 1),
        (["--env.swap_captures", "true"], "env.swap_captures", True),
        (["--env.predator_idle=false"], "env.predator_idle", False),
        (["--esp.init_range", "2"], "esp.init_range", 2.0),
        (["--esp.mutation_scale", "1e-3"], "esp.mutation_scale", 0.001),
        (["--esp.mutation_rate", ".5"], "esp.mutation_rate", 0.5),
        (["--esp.mutation_rate=.5"], "esp.mutation_rate", 0.5),
        (["--esp.init_range", "5."], "esp.init_range", 5.0),
        (["--esp.init_range", "+.5e1"], "esp.init_range", 5.0),
        (["--esp.init_range", "+5"], "esp.init_range", 5.0),
        (["--esp.n_trials", "1_000"], "esp.n_trials", 1000),
        (["--seed", "+3"], "seed", 3),
        (["--seed", "007"], "seed", 7),
        (["--env.swap_captures", "TRUE"], "env.swap_captures", True),
        (["--env.predator_idle=False"], "env.predator_idle", False),
        (["--esp.past_choice", "contested"], "esp.past_choice", "contested"),
        (["--esp.past_share=0.5"], "esp.past_share", 0.5),
        (["--esp.pairing", "hall_of_fame"], "esp.past_share", 1.0),  # an earlier name
        (["--prey.controller", "monolithic"], "prey.controller", "monolithic"),
        (["--champion.method", "argmax"], "champion.method", "argmax"),
    ],
)
def test_an_option_sets_the_field_of_its_name_and_no_other(options: list[str], name: str, value: Any) -> None:
    config = override(preset("smoke"), options)
    assert _get(config, name) == value
    assert type(_get(config, name)) is type(value)
    assert [field for field in FIELDS if _get(config, field) != _get(preset("smoke"), field)] == [name]


def test_no_options_change_nothing() -> None:
    assert override(preset("paper-3v1"), []) == preset("paper-3v1")


def test_fields_that_are_only_right_together_may_come_in_any_order() -> None:
    options = ["--esp.hof_mates", "10", "--esp.subpopulation_size", "40"]  # 10 are too many of the 20 of the preset
    assert override(preset("smoke"), options).esp.hof_mates == 10
    assert override(preset("smoke"), options[2:] + options[:2]).esp.hof_mates == 10


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--sed", "3"], "unknown option --sed; did you mean --seed?"),
        (["--n_prey", "3"], "unknown option --n_prey; did you mean --env.n_prey?"),
        (["--n-trials=3"], "unknown option --n-trials; did you mean --esp.n_trials?"),
        (["--esp.n_trails", "3"], "unknown option --esp.n_trails; did you mean --esp.n_trials?"),
        (["--ouput", "3"], "unknown option --ouput; did you mean --out?"),
        (["--quite"], "unknown option --quite; did you mean --quiet?"),
        (["--leage", "a"], "unknown option --leage; did you mean --league?"),
        (["--treads", "2"], "unknown option --treads; did you mean --threads?"),
        (["--xyzzy"], "unknown option --xyzzy"),
        (["--seed"], "--seed needs a value"),
        (["--seed", "3", "--esp.n_trials"], "--esp.n_trials needs a value"),
        (["seed", "3"], "expected an option like --seed 3, got 'seed'"),
        (["-s", "3"], "expected an option like --seed 3, got '-s'"),
        (["--seed", "three"], "seed must be an integer, got 'three'"),
        (["--seed="], "seed must be an integer, got ''"),
        (["--seed", "1.5"], "seed must be an integer, got 1.5"),
        (["--seed", "5."], "seed must be an integer, got 5.0"),
        (["--seed", "0x10"], "seed must be an integer, got '0x10'"),
        (["--esp.mutation_rate", "-.5"], "esp.mutation_rate must be at least 0.0, got -0.5"),
        (["--esp.mutation_rate", ".5.5"], "esp.mutation_rate must be a number, got '.5.5'"),
        (["--seed", "null"], "seed must be an integer, got None"),
        (["--seed", "[1]"], "seed must be an integer, got [1]"),
        (["--seed", "-1"], "seed must be at least 0, got -1"),
        (["--seed", str(2**63)], f"seed must be less than {2**63}, got {2**63}"),
        (["--generations", "0"], "generations must be at least 1, got 0"),
        (["--env.n_prey", "0"], "env.n_prey must be at least 1, got 0"),
        (["--env.swap_captures", "maybe"], "env.swap_captures must be a boolean, got 'maybe'"),
        (["--esp.mutation_rate", "2"], "esp.mutation_rate must be at most 1.0, got 2"),
        (["--esp.init_range", "0"], "esp.init_range must be greater than 0.0, got 0"),
        (["--esp.hof_mates", "6"], "esp.hof_mates must be at most the 5 breeding pairs, got 6"),
        (
            ["--esp.pairing", "5"],
            f"esp: pairing, an earlier name for past_share, must be one of {EARLIER}, got 5",
        ),
        (
            ["--predators.policy", "greedy_chase", "--prey.policy", "flee_nearest"],
            "at least one of predators.policy and prey.policy must be 'esp', got two scripts",
        ),
    ],
)
def test_an_option_that_is_wrong_is_refused_in_one_line(options: list[str], line: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(line)}$"):
        override(preset("smoke"), options)


@pytest.mark.parametrize("value", ["NaN", "Infinity", "-Infinity", "1e999", "nan", "inf", "-inf"])
@pytest.mark.parametrize("name", ["esp.init_range", "esp.mutation_rate", "esp.elite_share", "prey.input_scale"])
def test_a_number_that_is_not_finite_is_refused(name: str, value: str) -> None:
    with pytest.raises(ValueError, match=rf"^{name} must be .*, got -?(nan|inf)$"):
        override(preset("smoke"), [f"--{name}", value])


@pytest.mark.parametrize("value", ["1" * 10_000, "[" * 100_000])
def test_a_value_that_python_will_not_read_is_refused_in_one_line(value: str) -> None:
    with pytest.raises(ValueError, match=r"\A[^\n]+\Z"):
        override(preset("smoke"), ["--seed", value])


def test_the_first_of_several_faults_is_told_alone() -> None:
    with pytest.raises(ValueError, match=r"^seed must be at least 0, got -1$"):
        override(preset("smoke"), ["--env.n_prey", "0", "--seed", "-1"])


def test_the_name_of_a_preset_cannot_be_given_to_other_settings() -> None:
    """A champion says which preset it came from, and a run is kept under that name."""
    for name in ("paper-3v2", "../../elsewhere"):
        with pytest.raises(ValueError, match="preset"):
            override(preset("smoke"), ["--preset", name])


@pytest.mark.parametrize("name", PRESETS)
def test_a_description_names_every_field_with_its_value_and_meaning(name: str) -> None:
    config = preset(name)
    text = describe_fields(config)
    described = _described(text)
    assert [field for field in described if field != "preset"] == CHOSEN
    for field in CHOSEN:
        assert described[field].lower() == str(_get(config, field)).lower()
    lines = text.splitlines()
    for at, line in enumerate(lines):
        if line.startswith("  --"):
            assert re.match(r" {6}\S.*\.$", lines[at + 1]), f"{line} has no meaning"


@pytest.mark.parametrize("name", PRESETS)
def test_a_description_can_be_typed_back(name: str) -> None:
    """Each value stands as the command line takes it."""
    described = _described(describe_fields(preset(name)))
    options = [text for field in CHOSEN for text in (f"--{field}", described[field])]
    typed = override(preset("paper-3v2"), options)
    assert {field: _get(typed, field) for field in CHOSEN} == {field: _get(preset(name), field) for field in CHOSEN}


@pytest.mark.parametrize("section", ["env", "esp", "predators"])
def test_a_description_says_what_the_docstrings_say(section: str) -> None:
    """Quotes and apostrophes included."""
    config = getattr(preset("smoke"), section)
    text = describe_fields(preset("smoke"))
    for field in type(config).model_fields.values():
        assert " ".join((field.description or "").split()) in text


@pytest.mark.parametrize("name", PRESETS)
def test_presets_of_a_name_shows_what_it_is_and_every_field(name: str, esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("presets", name)
    assert outcome.code == 0
    assert outcome.err == ""
    assert outcome.out.startswith(f"{name}: {PRESETS[name][0]}\n")
    assert set(CHOSEN) <= set(_described(outcome.out))


def test_presets_lists_every_experiment_and_what_it_is(esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("presets")
    assert outcome.code == 0
    *lines, blank, tasks = outcome.out.splitlines()
    assert [line.split()[0] for line in lines] == list(PRESETS)
    for line, (meaning, _) in zip(lines, PRESETS.values(), strict=True):
        assert line.endswith(f"  {meaning}")
    assert not blank
    assert tasks.startswith("A task stands for its recommended preset: pond for race-pond, ")


@pytest.mark.parametrize("name", WORLDS)
def test_a_task_shows_its_recommended_preset(name: str, esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("presets", name).out == esp_trainer("presets", f"race-{name}").out


def test_help_of_train_names_every_field(esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("train", "--help")
    assert outcome.code == 0
    assert set(CHOSEN) <= set(_described(outcome.out))
    for own in ("--out DIR", "--threads N", "--quiet", "PRESET"):
        assert own in outcome.out


@pytest.mark.parametrize(
    ("given", "preset", "share"),
    [
        ([], "paper-3v2", "0.0"),
        (["race-3v1"], "race-3v1", "0.5"),
        (["pond"], "race-pond", "0.5"),
        (["x"], "paper-3v2", "0.0"),
    ],
)
def test_help_of_train_shows_the_values_of_the_preset(
    given: list[str], preset: str, share: str, esp_trainer: Callable[..., Any]
) -> None:
    told = esp_trainer("train", *given, "--help").out
    assert f"with its value in {preset}:" in told
    assert f"--esp.past_share {share}\n" in told


@pytest.mark.parametrize("command", ["train", "resume", "evaluate", "replay", "show", "presets"])
def test_every_command_has_help(command: str, esp_trainer: Callable[..., Any]) -> None:
    assert command in esp_trainer("--help").out
    outcome = esp_trainer(command, "--help")
    assert outcome.code == 0
    assert outcome.out.startswith(f"usage: esp-trainer {command}")
