"""The named experiments against the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from esp_trainer.coevolution.sides import side_controller
from esp_trainer.config import EspConfig, RunConfig
from esp_trainer.presets import PRESETS, preset
from esp_trainer.tasks import WORLDS
from predprey_env import EnvConfig

if TYPE_CHECKING:
    from esp_trainer.types import Role

PAPER = ["paper-3v2", "paper-3v1", "monolithic-3v2", "monolithic-3v1", "monolithic-3v1-wide", "fleeing-prey"]
BESIDE = ["matched-3v2", "matched-3v1", "combiner-3v2", "combiner-3v1", "fleeing-prey-central"]
"""What takes the paper's systems apart, puts them together further, or is compared with them."""
MODERN = ["modern-3v2", "modern-3v1"]
DRAWN = ["drawn-3v2", "drawn-3v1"]
RACE = ["race-3v1", "race-3v2", "race-steppe", "race-meadow", "race-pond"]


def n_genes(name: str, role: Role) -> int:
    """How many genes a team has that its networks read."""
    config = preset(name)
    controller = side_controller(config, role)
    n_genomes = config.env.team(role).n_agents // controller.n_together
    return n_genomes * controller.n_hidden * sum(controller.used_genes)


def test_there_is_a_preset_for_each_experiment_and_a_small_one():
    assert sorted(PRESETS) == sorted([*PAPER, *BESIDE, *MODERN, *DRAWN, *RACE, "game", "smoke"])


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_can_be_made_and_says_what_it_is(name: str):
    config = preset(name)
    assert config.preset == name
    assert isinstance(config, RunConfig)
    assert RunConfig.from_dict(config.model_dump()) == config
    description = PRESETS[name][0]
    assert len(description) > 20
    assert "\n" not in description


def test_a_task_is_a_name_of_its_recommended_preset():
    assert {task: preset(task) for task in WORLDS} == {task: preset(f"race-{task}") for task in WORLDS}
    assert preset("race-3v2-40") == preset("steppe")  # its name until 0.1


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


@pytest.mark.parametrize("name", MODERN)
def test_modern_is_the_papers_setting_without_past_mates_and_with_scaled_offsets(name: str):
    paper = preset(name.replace("modern", "paper"))
    sides = {role: getattr(paper, role).replace(input_scale=0.2) for role in ("predators", "prey")}
    assert preset(name) == paper.replace(preset=name, esp=paper.esp.replace(hof_mates=0), **sides)


@pytest.mark.parametrize("name", RACE)
def test_the_race_has_the_papers_networks_trials_and_operators_and_comes_first(name: str):
    config, task = preset(name), name.removeprefix("race-")
    paper = preset("paper-3v1" if WORLDS[task].n_prey == 1 else "paper-3v2")
    assert name in list(PRESETS)[:5]
    assert ("recommended" in PRESETS[name][0]) == (name in ("race-3v1", "race-steppe"))
    assert config.predators == paper.predators.replace(bias=True)
    assert config.prey == paper.prey.replace(bias=True, input_scale=0.2)
    assert config.env == WORLDS[task].replace(credit="team" if WORLDS[task].n_prey == 1 else "individual")
    kept = ("subpopulation_size", "n_trials", "n_episodes", "elite_share", "mate", "mutation_rate", "mutation_scale")
    assert all(getattr(config.esp, field) == getattr(paper.esp, field) for field in kept)


@pytest.mark.parametrize("name", [*PAPER, *BESIDE, *DRAWN])
def test_all_but_the_small_one_differ_only_in_the_world_and_in_who_plays(name: str):
    config, default = preset(name), RunConfig()
    same = config.replace(preset="custom", env=default.env, predators=default.predators, prey=default.prey)
    assert same == default
    assert config.env.replace(n_prey=2) == default.env


def test_the_children_of_the_paper_replace_the_bottom_half():
    assert 2 * EspConfig().n_elite == EspConfig().subpopulation_size / 2


NETWORKS = {
    "paper-3v2": (2, "split", "split"),
    "paper-3v1": (1, "split", "split"),
    "monolithic-3v2": (2, "monolithic", "monolithic"),
    "monolithic-3v1": (1, "monolithic", "monolithic"),
    "monolithic-3v1-wide": (1, "monolithic", "monolithic"),
    "matched-3v2": (2, "monolithic", "monolithic"),
    "matched-3v1": (1, "split", "monolithic"),
    "combiner-3v2": (2, "combiner", "combiner"),
    "combiner-3v1": (1, "split", "combiner"),
    "fleeing-prey-central": (1, "central", "split"),
}
BESIDE = [name for name in NETWORKS if not name.startswith(("paper", "monolithic"))]


@pytest.mark.parametrize(("name", "expected"), NETWORKS.items())
def test_presets_have_the_teams_and_networks_of_section_vi(name: str, expected: tuple[int, str, str]):
    config = preset(name)
    assert (config.env.n_prey, config.predators.controller, config.prey.controller) == expected
    assert name in BESIDE or (config.predators.policy, config.prey.policy) == ("esp", "esp")


def test_the_wide_preset_has_more_hidden_neurons_in_the_prey_alone():
    config = preset("monolithic-3v1-wide")
    assert (config.predators.n_hidden, config.prey.n_hidden) == (10, 30)


@pytest.mark.parametrize("name", BESIDE)
def test_what_stands_beside_them_plays_on_their_worlds(name: str):
    config = preset(name)
    assert config.env == EnvConfig(n_prey=NETWORKS[name][0])
    for side in (config.predators, config.prey):
        assert set(side.model_dump(exclude_defaults=True)) <= {"controller", "n_hidden", "policy"}


@pytest.mark.parametrize(
    ("name", "like", "role", "tolerance"),
    [
        ("matched-3v2", "paper-3v2", "predators", 0.05),  # no number of hidden neurons is nearer
        ("matched-3v2", "paper-3v2", "prey", 0.0),
        ("matched-3v1", "paper-3v1", "predators", 0.0),
        ("matched-3v1", "paper-3v1", "prey", 0.0),
        ("combiner-3v1", "paper-3v1", "predators", 0.0),
        ("fleeing-prey-central", "fleeing-prey", "predators", 0.0),
    ],
)
def test_what_is_compared_has_as_many_genes(name: str, like: str, role: Role, tolerance: float):
    assert abs(n_genes(name, role) / n_genes(like, role) - 1) <= tolerance


def test_the_genes_of_the_papers_teams_counted_by_hand():
    """A neuron has its inputs and its outputs; ten of them to a network."""
    assert n_genes("paper-3v2", "predators") == 3 * 2 * 10 * (2 + 5)
    assert n_genes("paper-3v2", "prey") == 2 * 3 * 10 * (2 + 4)
    assert n_genes("matched-3v2", "predators") == 3 * 16 * (4 + 5)
    assert abs(15 * (4 + 5) - 140) > abs(16 * (4 + 5) - 140) < abs(17 * (4 + 5) - 140)
    assert n_genes("monolithic-3v2", "predators") == 3 * 10 * (4 + 5)
    assert n_genes("combiner-3v2", "predators") == 3 * (2 * 10 * (2 + 5) + 10 * (10 + 5))
    assert n_genes("combiner-3v1", "prey") == 3 * 10 * (2 + 4) + 10 * (12 + 4)
    assert n_genes("fleeing-prey-central", "predators") == 10 * (6 + 15)


def test_one_network_for_the_whole_team_is_all_that_differs_from_the_fleeing_prey():
    central, apart = preset("fleeing-prey-central"), preset("fleeing-prey")
    assert central.replace(preset=apart.preset, predators=apart.predators) == apart
    assert central.predators.replace(controller="split") == apart.predators


def test_the_fixed_prey_of_yong_flees_from_three_predators():
    config = preset("fleeing-prey")
    assert config.prey.policy == "flee_nearest"
    assert config.predators.policy == "esp"
    assert config.env.n_prey == 1


def test_an_unknown_preset_is_refused_with_the_nearest_name():
    with pytest.raises(ValueError, match=r"^unknown preset paper-3v3; did you mean paper-3v[12]\?$"):
        preset("paper-3v3")


def test_an_unknown_preset_without_a_near_name_is_refused_with_all_names():
    with pytest.raises(
        ValueError, match=r"^unknown preset xyz; there are race-3v1, .*, smoke, pond, meadow, steppe, 3v1, 3v2$"
    ):
        preset("xyz")
