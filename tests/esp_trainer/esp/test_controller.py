"""From a side's settings to its networks."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest

from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.networks.controller import Controller
from predprey_env.sight import Sight

KINDS = ["split", "monolithic", "combiner", "double", "pairs", "central"]


def made(kind: str, n_opponents: int, n_actions: int = 5, n_agents: int = 3, **settings: Any) -> Controller:
    """The controller of a team in a world of offsets."""
    side = SideConfig(controller=kind, **settings)
    return make_controller(side, wiring_for(side, n_opponents, n_agents), n_actions, n_agents)


def test_the_kinds_tested_here_are_all_that_there_are():
    assert list(get_args(SideConfig.model_fields["controller"].annotation)) == KINDS


# -- what each network sees --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "wiring"),
    [
        ("split", [[0, 1], [2, 3], [4, 5]]),
        ("monolithic", [[0, 1, 2, 3, 4, 5]]),
        ("combiner", [[0, 1], [2, 3], [4, 5]]),
        ("double", [[0, 1], [2, 3], [4, 5], [0, 1], [2, 3], [4, 5]]),
        ("pairs", [[0, 1, 2, 3], [0, 1, 4, 5], [2, 3, 4, 5]]),
        ("central", [[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]]),
    ],
)
def test_each_kind_has_networks_for_its_own_groups_of_three_opponents(kind: str, wiring: list[list[int]]):
    assert wiring_for(SideConfig(controller=kind), 3, n_agents=2).tolist() == wiring


@pytest.mark.parametrize(
    ("kind", "wiring"),
    [
        ("split", [[0, 1]]),
        ("monolithic", [[0, 1]]),
        ("combiner", [[0, 1]]),
        ("double", [[0, 1], [0, 1]]),
        ("pairs", [[0, 1]]),
        ("central", [[0, 1, 2, 3]]),
    ],
)
def test_a_single_opponent_is_seen_by_every_network(kind: str, wiring: list[list[int]]):
    assert wiring_for(SideConfig(controller=kind), 1, n_agents=2).tolist() == wiring


@pytest.mark.parametrize(
    ("kind", "wiring"),
    [
        ("split", [[0, 1, 6, 7], [2, 3, 8, 9], [4, 5, 10, 11]]),
        ("monolithic", [[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]]),
        ("pairs", [[0, 1, 2, 3, 6, 7, 8, 9], [0, 1, 4, 5, 6, 7, 10, 11], [2, 3, 4, 5, 8, 9, 10, 11]]),
        ("central", [list(range(28))]),  # with the two agents' identities
    ],
)
def test_a_team_mate_that_is_seen_counts_as_an_opponent_and_moves_go_with_offsets(kind: str, wiring: list[list[int]]):
    sight = Sight(teammates=True, moves=True, identity=True)
    assert wiring_for(SideConfig(controller=kind), 2, n_agents=2, sight=sight).tolist() == wiring


def test_there_is_a_network_for_each_pair_of_opponents():
    assert [len(wiring_for(SideConfig(controller="pairs"), n)) for n in (1, 2, 3, 4, 5)] == [1, 1, 3, 6, 10]


@pytest.mark.parametrize("n_agents", [1, 2, 3])
@pytest.mark.parametrize("n_opponents", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_reads_all_that_an_agent_sees(kind: str, n_opponents: int, n_agents: int):
    controller = made(kind, n_opponents, n_agents=n_agents)
    assert controller.n_seen == 2 * n_opponents
    n_views = n_agents if kind == "central" else 1
    assert np.unique(controller.wiring).tolist() == list(range(2 * n_opponents * n_views))


# -- what a genome holds -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "fan_in", "used_genes", "shape"),
    [
        ("split", (2, 2), (7, 7), (2, 10, 7)),
        ("monolithic", (4,), (9,), (1, 10, 9)),
        ("combiner", (2, 2, 10), (7, 7, 15), (3, 10, 15)),  # it reads five outputs of each
        ("double", (2, 2, 2, 2), (7, 7, 7, 7), (4, 10, 7)),
        ("pairs", (4,), (9,), (1, 10, 9)),
        ("central", (12,), (27,), (1, 10, 27)),  # three views of four numbers, and three times five outputs
    ],
)
def test_the_networks_of_three_predators_of_two_prey(
    kind: str, fan_in: tuple[int, ...], used_genes: tuple[int, ...], shape: tuple[int, int, int]
):
    controller = made(kind, 2)
    assert (controller.fan_in, controller.used_genes, controller.shape) == (fan_in, used_genes, shape)
    assert controller.n_genes == shape[-1]
    with_bias = made(kind, 2, bias=True)
    assert with_bias.fan_in == fan_in
    assert with_bias.used_genes == tuple(n + 1 for n in used_genes)
    assert with_bias.n_genes == shape[-1] + 1


@pytest.mark.parametrize(
    ("kind", "fan_in", "used_genes"),
    [
        ("split", (2,), (6,)),
        ("monolithic", (2,), (6,)),
        ("combiner", (2, 4), (6, 8)),
        ("double", (2, 2), (6, 6)),
        ("pairs", (2,), (6,)),
        ("central", (4,), (12,)),
    ],
)
def test_the_networks_of_two_prey_of_one_predator(kind: str, fan_in: tuple[int, ...], used_genes: tuple[int, ...]):
    controller = made(kind, 1, n_actions=4, n_agents=2)
    assert (controller.fan_in, controller.used_genes) == (fan_in, used_genes)
    assert controller.shape == (len(fan_in), 10, max(used_genes))


def test_where_the_combiner_reads_little_its_genes_are_filled_up():
    """One wide network with two outputs: the combiner's two inputs are fewer than the six of the other."""
    controller = make_controller(SideConfig(controller="combiner"), np.arange(6).reshape(1, 6), 2)
    assert controller.fan_in == (6, 2)
    assert controller.used_genes == (8, 4)
    assert controller.shape == (2, 10, 8)


def test_a_combiner_needs_room_for_the_outputs_of_all_networks():
    assert made("combiner", 3, n_actions=4).n_votes == 3 * 4
    assert made("combiner", 1, n_actions=4).n_votes == 4
    assert {made(kind, 3, n_actions=4).n_votes for kind in KINDS if kind != "combiner"} == {4}


@pytest.mark.parametrize("kind", KINDS)
def test_only_the_central_controller_steers_several_agents_and_only_the_combiner_combines(kind: str):
    controller = made(kind, 2, n_agents=3)
    assert controller.n_together == (3 if kind == "central" else 1)
    assert controller.combines == (kind == "combiner")


def test_the_central_controller_of_one_agent_is_the_monolithic_one():
    central, monolithic = made("central", 3, n_agents=1), made("monolithic", 3, n_agents=1)
    assert central.wiring.tolist() == monolithic.wiring.tolist()
    assert central._replace(wiring=monolithic.wiring) == monolithic


@pytest.mark.parametrize(
    ("side", "wiring", "shape"),
    [
        (SideConfig(), [[0, 1], [2, 3]], (2, 10, 2 + 5)),
        (SideConfig(bias=True), [[0, 1], [2, 3]], (2, 10, 2 + 1 + 5)),
        (SideConfig(n_hidden=30), [[0, 1, 2, 3, 4, 5]], (1, 30, 6 + 5)),
    ],
)
def test_a_gene_string_holds_input_weights_bias_and_output_weights(
    side: SideConfig, wiring: list[list[int]], shape: tuple[int, int, int]
):
    controller = make_controller(side, np.array(wiring), 5)
    assert controller.shape == shape
    assert controller.n_genes == shape[-1]


# -- settings ----------------------------------------------------------------------------------------------------------


def test_settings_become_plain_numbers():
    side = SideConfig(bias=True, output="linear", captured_vote="skip", input_scale=0.1)
    controller = make_controller(side, np.array([[0, 1]]), 4)
    assert (controller.bias, controller.logistic_output, controller.skip_silent) == (True, False, True)
    assert controller.input_scale == np.float32(0.1)
    assert controller.input_scale.dtype == np.float32
    assert controller.network.blank == (0.0, 0.0, 0.0, 0.0)


def test_defaults_are_logistic_outputs_without_bias_on_raw_offsets():
    controller = make_controller(SideConfig(), np.array([[0, 1]]), 4)
    assert (controller.bias, controller.logistic_output, controller.skip_silent) == (False, True, False)
    assert controller.input_scale == 1.0


def test_wiring_of_any_layout_becomes_what_compiled_code_reads():
    wiring = np.asfortranarray(np.array([[0, 1, 2], [3, 4, 5]], np.int32))
    controller = make_controller(SideConfig(), wiring, 4)
    assert controller.wiring.dtype == np.int64
    assert controller.wiring.flags.c_contiguous
    assert controller.wiring.tolist() == wiring.tolist()


@pytest.mark.parametrize(("wiring", "n_actions"), [([[0, 1]], 1), ([[0], [1]], 4), ([0, 1], 4)])
def test_fewer_than_two_actions_or_inputs_are_refused(wiring: list[object], n_actions: int):
    with pytest.raises(ValueError, match=r"needs 2 actions and 2 inputs a network, got"):
        make_controller(SideConfig(), np.array(wiring), n_actions)


@pytest.mark.parametrize("wiring", [[[0, -1]], [[0.0, 1.0]]])
def test_wiring_that_is_no_index_is_refused(wiring: list[list[float]]):
    with pytest.raises(ValueError, match="wiring must hold indices of an observation, got"):
        make_controller(SideConfig(), np.array(wiring), 4)
