"""From a side's settings to its networks."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, offset_wiring


def test_split_controllers_have_a_network_for_each_opponent():
    assert offset_wiring(SideConfig(), 3).tolist() == [[0, 1], [2, 3], [4, 5]]


def test_monolithic_controllers_have_one_network_that_sees_all_opponents():
    assert offset_wiring(SideConfig(controller="monolithic"), 3).tolist() == [[0, 1, 2, 3, 4, 5]]


@pytest.mark.parametrize("controller", ["split", "monolithic"])
def test_both_controllers_are_the_same_against_one_opponent(controller: str):
    assert offset_wiring(SideConfig(controller=controller), 1).tolist() == [[0, 1]]


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


def test_settings_become_plain_numbers():
    side = SideConfig(bias=True, output="linear", captured_vote="skip", input_scale=0.1)
    controller = make_controller(side, np.array([[0, 1]]), 4)
    assert (controller.bias, controller.logistic_output, controller.skip_silent) == (True, False, True)
    assert controller.input_scale == np.float32(0.1)
    assert controller.input_scale.dtype == np.float32
    assert controller.blank == (0.0, 0.0, 0.0, 0.0)


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
