"""Settings that fit together, and errors of one clear line."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.presets import preset
from predprey_env import EnvConfig
from predprey_env.settings import field_names


def refusal(fields: dict[str, Any]) -> str:
    with pytest.raises(ValueError) as caught:  # noqa: PT011  # the callers look at the line
        RunConfig.from_dict(fields)
    line = str(caught.value)
    assert "\n" not in line
    return line


def test_fields_may_be_numpy_scalars() -> None:
    numpy = {
        "seed": np.uint64(2**62),
        "env.size": np.int32(20),
        "esp.n_trials": np.int64(9),
        "prey.bias": np.bool_(True),
    }
    plain = {"seed": 2**62, "env.size": 20, "esp.n_trials": 9, "prey.bias": True}
    config = RunConfig().with_fields({**numpy, "esp.mutation_rate": np.float32(0.5)})
    assert config == RunConfig().with_fields({**plain, "esp.mutation_rate": 0.5})
    assert RunConfig.from_dict(json.loads(json.dumps(config.model_dump()))) == config
    assert type(config.esp.mutation_rate) is float


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"esp": {"n_trials": 0}}, "esp.n_trials must be at least 1, got 0"),
        ({"esp": {"subpopulation_size": 3}}, "esp.subpopulation_size must be at least 4, got 3"),
        ({"esp": {"mutation_rate": 1.5}}, "esp.mutation_rate must be at most 1.0, got 1.5"),
        ({"esp": {"n_episodes": 2.5}}, "esp.n_episodes must be an integer, got 2.5"),
        ({"esp": {"n_episodes": "6"}}, "esp.n_episodes must be an integer, got '6'"),
        ({"esp": {"mutation_scale": 0.0}}, "esp.mutation_scale must be greater than 0.0, got 0.0"),
        ({"predators": {"input_scale": -1.0}}, "predators.input_scale must be at least 1e-06, got -1.0"),
        ({"prey": {"n_hidden": 0}}, "prey.n_hidden must be at least 1, got 0"),
        ({"champion": {"n_candidates": 0}}, "champion.n_candidates must be at least 1, got 0"),
        ({"env": {"size": 2}}, "env.size must be at least 3, got 2"),
        ({"generations": 0}, "generations must be at least 1, got 0"),
        ({"seed": -1}, "seed must be at least 0, got -1"),
        ({"seed": 2**63}, f"seed must be less than {2**63}, got {2**63}"),
        ({"seed": True}, "seed must be an integer, got True"),
        ({"prey": {"output": "tanh"}}, "prey.output must be 'logistic' or 'linear', got 'tanh'"),
        ({"prey": {"bias": 1}}, "prey.bias must be a boolean, got 1"),
        (
            {"predators": {"controller": "sum"}},
            "predators.controller must be 'split', 'monolithic', 'combiner', 'double', 'pairs' or 'central', got 'sum'",
        ),
        ({"esp": {"fitness_sharing": "yes"}}, "esp.fitness_sharing must be a boolean, got 'yes'"),
    ],
)
def test_a_field_out_of_range_is_refused_with_its_section(fields: dict[str, Any], line: str):
    assert refusal(fields) == line


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"esp": {"n_trails": 5}}, "unknown field esp.n_trails; did you mean esp.n_trials?"),
        ({"n_trials": 5}, "unknown field n_trials; did you mean esp.n_trials?"),
        ({"predators": {"hidden": 5}}, "unknown field predators.hidden; did you mean predators.n_hidden?"),
        ({"zzz": 1}, "unknown field zzz"),
    ],
)
def test_an_unknown_field_is_refused_with_the_nearest_name(fields: dict[str, Any], line: str):
    assert refusal(fields) == line


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
@pytest.mark.parametrize("field", ["mutation_scale", "init_range", "mutation_limit", "burst_scale", "elite_share"])
def test_numbers_that_are_not_finite_are_refused(field: str, value: float):
    assert refusal({"esp": {field: value}}).startswith(f"esp.{field} must be ")


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"esp": {"hof_mates": 26}}, ["esp", "hof_mates must be at most the 25 breeding pairs, got 26"]),
        ({"esp": {"subpopulation_size": 4, "elite_share": 0.1}}, ["esp", "must select a neuron of 4, got 0.1"]),
        ({"env": {"size": 3, "n_predators": 9}}, ["env", "agents need at least as many cells, got size=3"]),
        (
            {"predators": {"policy": "flee_nearest"}},
            ["predators.policy must be one of esp, random, greedy", "got 'flee_nearest'"],
        ),
        ({"prey": {"policy": "greedy_chase"}}, ["prey.policy must be one of esp, random, flee", "got 'greedy_chase'"]),
        (
            {"predators": {"policy": "greedy_chase"}, "prey": {"policy": "flee_nearest"}},
            ["predators.policy and prey.policy", "'esp'", "got two scripts"],
        ),
        (
            {"esp": {"exploiters_every": 5}},
            ["esp.exploiters_every must be 0", "esp.past_share and champion.n_past are 0"],
        ),
    ],
)
def test_fields_that_do_not_fit_together_are_refused(fields: dict[str, Any], words: list[str]):
    line = refusal(fields)
    assert all(part in line for part in words)


def test_fitness_is_shared_and_networks_are_combined_only_where_one_asks_for_it():
    assert not EspConfig().fitness_sharing
    assert SideConfig().controller == "split"


def test_a_section_that_is_no_mapping_is_refused():
    assert refusal({"esp": 5}).startswith("esp must be ")


def test_hof_mates_may_be_all_pairs_and_none():
    assert EspConfig(hof_mates=25).hof_mates == EspConfig().n_elite
    assert EspConfig(hof_mates=0).hof_mates == 0


@pytest.mark.parametrize(
    ("share", "size", "n_elite"),
    [(0.25, 100, 25), (0.29, 100, 29), (0.25, 4, 1), (0.25, 7, 1), (1 / 3, 100, 33), (1 / 3, 9, 3), (0.07, 100, 7)],
)
def test_the_elite_is_the_share_of_the_subpopulation(share: float, size: int, n_elite: int):
    assert EspConfig(elite_share=share, subpopulation_size=size, hof_mates=0).n_elite == n_elite


@given(st.integers(4, 1000), st.floats(0.25, 1 / 3))
def test_an_elite_and_its_children_fit_into_a_subpopulation(size: int, share: float):
    assert 3 * EspConfig(subpopulation_size=size, elite_share=share, hof_mates=0).n_elite <= size


def test_settings_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        EspConfig().n_trials = 5  # type: ignore[misc]


def test_a_config_survives_json():
    config = RunConfig(
        seed=2**63 - 1,
        env=EnvConfig(size=101),
        predators=SideConfig(input_scale=0.2, controller="combiner"),
        prey=SideConfig(controller="central"),
        esp=EspConfig(past_share=0.5, fitness_sharing=True),
        champion=ChampionConfig(method="argmax"),
    )
    assert RunConfig.from_dict(json.loads(json.dumps(config.model_dump()))) == config


def test_replaced_settings_are_validated():
    with pytest.raises(ValueError, match="n_trials must be at least 1, got 0"):
        EspConfig().replace(n_trials=0)


def test_a_field_of_a_section_is_pointed_to_what_sets_it():
    line = "esp.n_trials is a field of esp; set it by with_fields({'esp.n_trials': ...})"
    dotted = {"esp.n_trials": 5}
    for change in (RunConfig().replace, RunConfig, lambda **fields: RunConfig.from_dict(fields)):
        with pytest.raises(ValueError, match=f"^{re.escape(line)}$"):
            change(**dotted)
    assert RunConfig().with_fields(dotted).esp.n_trials == 5


@pytest.mark.parametrize("name", ["replace", "with_fields"])
def test_a_section_that_is_given_in_part_keeps_its_other_fields(name: str):
    config, fields = preset("smoke"), {"esp": {"n_trials": 5}}
    changed = config.replace(**fields) if name == "replace" else config.with_fields(fields)
    assert changed == config.replace(esp=config.esp.replace(n_trials=5))


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"esp.n_trails": 5}, "unknown field esp.n_trails; did you mean esp.n_trials?"),
        ({"esp": {"n_trails": 5}}, "unknown field esp.n_trails; did you mean esp.n_trials?"),
        ({"n_trials": 5}, "unknown field n_trials; did you mean esp.n_trials?"),
        ({"zzz.n_trials": 5}, "unknown field zzz"),
        ({"seed.low": 5}, "unknown field seed.low; did you mean seed?"),
        ({5: 5}, "unknown field 5"),
        ({"esp": {5: 5}}, "unknown field esp.5"),
        ({"esp": 5}, "esp must be a dictionary or instance of EspConfig, got 5"),
        ([("seed", 5)], "fields must be a mapping from names of fields to values, got [('seed', 5)]"),
    ],
)
def test_fields_that_cannot_be_set_are_refused_in_one_line(fields: Any, line: str):
    with pytest.raises(ValueError, match=f"^{re.escape(line)}$"):
        RunConfig().with_fields(fields)


def test_every_field_says_what_it_is():
    for settings in (RunConfig, EspConfig, SideConfig, ChampionConfig):
        for name, field in settings.model_fields.items():
            assert field.description, f"{settings.__name__}.{name}"
    assert "esp.n_trials" in field_names(RunConfig)


@pytest.mark.parametrize(
    ("pairing", "share", "choice"),
    [
        *(("cosample", 0.0, "uniform"), ("previous_champion", 1.0, "latest")),
        *(("hall_of_fame", 1.0, "uniform"), ("mixed", 0.5, "uniform")),
    ],
)
def test_the_opponents_of_earlier_versions_keep_their_meaning(pairing: str, share: float, choice: str) -> None:
    for config in (
        EspConfig.from_dict({"pairing": pairing, "n_trials": 7}),
        EspConfig(n_trials=7).replace(pairing=pairing),
        RunConfig(esp=EspConfig(n_trials=7)).with_fields({"esp.pairing": pairing}).esp,
    ):
        assert (config.past_share, config.past_choice, config.n_trials) == (share, choice, 7)


@pytest.mark.parametrize(
    ("fields", "n_past"),
    [
        ({"past_share": 0.5}, 3),
        ({"past_share": 1.0}, 6),
        ({"past_share": 0.1}, 1),
        ({"n_episodes": 3, "past_share": 0.5}, 2),
    ],
)
def test_a_share_of_episodes_is_rounded_to_whole_ones(fields: dict[str, Any], n_past: int) -> None:
    assert EspConfig(**fields).n_past == n_past


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"past_share": 0.05}, "past_share must be a share of n_episodes=6 in whole episodes, got 0.05"),
        ({"past_share": 0.95}, "past_share must be a share of n_episodes=6 in whole episodes, got 0.95"),
        ({"n_episodes": 1, "past_share": 0.5}, "past_share must be a share of n_episodes=1 in whole episodes, got 0.5"),
        ({"n_trials": 10, "block_size": 11}, "block_size must be at most n_trials=10, got 11"),
    ],
)
def test_a_share_of_no_whole_episode_and_a_block_of_too_many_trials_are_refused(fields: Any, line: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        EspConfig(**fields)
    assert str(refused.value) == line
