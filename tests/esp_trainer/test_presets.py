"""The named experiments against the paper."""

from __future__ import annotations

import pytest

from esp_trainer.config import EspConfig, RunConfig
from esp_trainer.presets import PRESETS, preset

PAPER = ["paper-3v2", "paper-3v1", "monolithic-3v2", "monolithic-3v1", "monolithic-3v1-wide", "fleeing-prey"]


def test_there_is_a_preset_for_each_experiment_and_a_small_one():
    assert list(PRESETS) == [*PAPER, "smoke"]


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_can_be_made_and_says_what_it_is(name: str):
    config = preset(name)
    assert config.preset == name
    assert isinstance(config, RunConfig)
    assert RunConfig.from_dict(config.model_dump()) == config
    description = PRESETS[name][0]
    assert len(description) > 20
    assert "\n" not in description


@pytest.mark.parametrize("name", PAPER)
def test_paper_presets_have_the_parameters_of_section_v(name: str):
    config = preset(name)
    assert config.env.size == 100  # "a 100x100 toroid"
    assert config.env.n_predators == 3
    assert config.env.max_cycles == 150
    assert config.env.move_order == "simultaneous"  # "all the agents in the world take a step simultaneously"
    assert config.env.predator_idle
    assert config.env.prey_fitness == "lifespan"
    assert config.esp.subpopulation_size == 100
    assert config.esp.n_trials == 1000
    assert config.esp.n_episodes == 6
    assert config.esp.elite_share == 0.25
    assert config.esp.n_elite == 25
    assert config.esp.mutation_rate == 0.4
    assert config.predators.n_hidden == 10
    assert config.predators.output == "logistic"


@pytest.mark.parametrize("name", PAPER)
def test_paper_presets_differ_only_in_the_world_and_in_who_plays(name: str):
    config, default = preset(name), RunConfig()
    same = config.replace(preset="custom", env=default.env, predators=default.predators, prey=default.prey)
    assert same == default
    assert config.env.replace(n_prey=2) == default.env


def test_the_children_of_the_paper_replace_the_bottom_half():
    assert 2 * EspConfig().n_elite == EspConfig().subpopulation_size / 2


@pytest.mark.parametrize(
    ("name", "n_prey", "predators", "prey"),
    [
        ("paper-3v2", 2, "split", "split"),
        ("paper-3v1", 1, "split", "split"),
        ("monolithic-3v2", 2, "monolithic", "monolithic"),
        ("monolithic-3v1", 1, "monolithic", "monolithic"),
        ("monolithic-3v1-wide", 1, "monolithic", "monolithic"),
    ],
)
def test_presets_have_the_teams_and_networks_of_section_vi(name: str, n_prey: int, predators: str, prey: str):
    config = preset(name)
    assert config.env.n_prey == n_prey
    assert (config.predators.controller, config.prey.controller) == (predators, prey)
    assert (config.predators.policy, config.prey.policy) == ("esp", "esp")


def test_the_wide_preset_has_more_hidden_neurons_in_the_prey_alone():
    config = preset("monolithic-3v1-wide")
    assert (config.predators.n_hidden, config.prey.n_hidden) == (10, 30)


def test_the_fixed_prey_of_yong_flees_from_three_predators():
    config = preset("fleeing-prey")
    assert config.prey.policy == "flee_nearest"
    assert config.predators.policy == "esp"
    assert config.env.n_prey == 1


def test_an_unknown_preset_is_refused_with_the_nearest_name():
    with pytest.raises(ValueError, match=r"^unknown preset paper-3v3; did you mean paper-3v[12]\?$"):
        preset("paper-3v3")


def test_an_unknown_preset_without_a_near_name_is_refused_with_all_names():
    with pytest.raises(ValueError, match=r"^unknown preset xyz; there are paper-3v2, .*, smoke$"):
        preset("xyz")
