"""The forward pass against arithmetic in double precision, and in lanes against itself one at a time."""

from __future__ import annotations

from math import exp, log
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.network import exponential, logistic, most_votes, sample_action, vote
from esp_trainer.networks.controller import Controller
from predprey_env.jit.compilation import entry_point
from predprey_env.jit.lanes import LANES, load, store

SMALLEST_NORMAL = np.finfo(np.float32).tiny


@entry_point
def _logistics(z: Any, out: Any) -> None:
    for row in range(len(z)):
        store(out, row, logistic(load(z, row)))


@entry_point
def _decide(controller: Any, weights: Any, seen: Any, inputs: Any, votes: Any, memory: Any, action: Any) -> None:
    vote(controller, weights, 0, 0, seen, inputs, votes, memory, 1)
    store(action, 0, most_votes(controller, votes))


@entry_point
def _draw(controller: Any, votes: Any, memory: Any, action: Any) -> None:
    store(action, 0, sample_action(controller, votes, memory, 0))


@entry_point
def _exponentials(z: Any, out: Any) -> None:
    for row in range(len(z)):
        store(out, row, exponential(load(z, row)))


def logistics(z: Any) -> np.ndarray:
    z = np.asarray(z, np.float32)
    out = np.empty_like(z)
    _logistics(z, out)
    return out


def play(controller: Controller, genes: Any, seen: Any) -> tuple[np.ndarray, np.ndarray]:
    """Votes and action of one agent, or of ``LANES`` of them: ``genes (..., G)`` and ``seen (..., n)``."""
    weights = np.ascontiguousarray(np.asarray(genes, np.float32).T)
    view = np.ascontiguousarray(np.asarray(seen, np.float32).T)
    lanes = weights.shape[1:]
    inputs = np.empty((controller.n_inputs + 1, *lanes), np.float32)
    votes = np.empty((controller.n_actions, *lanes), np.float32)
    action = np.empty((1, *lanes), np.int32)
    _decide(controller, weights, view, inputs, votes, np.zeros((controller.n_memory, *lanes), np.int32), action)
    return votes.T, action[0]


def sigmoid(z: float) -> float:
    return 1 / (1 + exp(-z))


def expected_votes(controller: Controller, side: SideConfig, genes: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The sums of the networks' outputs in double precision, from section VI and the meaning of the switches."""
    genes, seen = np.asarray(genes, np.float64), np.asarray(seen, np.float64)
    total = np.zeros(controller.n_actions)
    for network, wires in zip(genes.reshape(controller.shape), controller.wiring, strict=True):
        offsets = seen[wires] * side.input_scale
        inputs = np.append(offsets, 1.0) if side.bias else offsets
        hidden = 1 / (1 + np.exp(-np.clip(network[:, : len(inputs)] @ inputs, -700, 700)))
        outputs = hidden @ network[:, len(inputs) :]
        if side.output == "logistic":
            outputs = 1 / (1 + np.exp(-np.clip(outputs, -700, 700)))
        if side.captured_vote == "zero" or offsets.any():
            total += outputs
    return total


def one_network(n_hidden: int = 1, n_actions: int = 2, **settings: Any) -> Controller:
    side = SideConfig(n_hidden=n_hidden, **settings)
    return make_controller(side, np.array([[0, 1]]), n_actions)


def two_networks(n_actions: int = 2, **settings: Any) -> Controller:
    return make_controller(SideConfig(n_hidden=1, **settings), np.array([[0, 1], [2, 3]]), n_actions)


# -- the logistic ---------------------------------------------------------------------------------------------------

JOINTS = np.float32(log(2)) * (np.arange(-20, 20) + np.float32(0.5))
"""Where the rounded exponent changes, and with it the piece of the approximation."""


def dense_grid() -> np.ndarray:
    around_joints = JOINTS[:, None] + np.linspace(-1e-4, 1e-4, 2001)
    return np.sort(np.concatenate([np.linspace(-50, 50, 400_001), around_joints.ravel()]).astype(np.float32))


def test_logistic_is_as_near_the_truth_as_its_docstring_says():
    z = dense_grid()
    truth = 1 / (1 + np.exp(-z.astype(np.float64)))
    assert np.abs(logistics(z) - truth).max() < 2e-7


def test_logistic_of_zero_is_one_half_exactly():
    assert logistics([0.0, -0.0]).tolist() == [0.5, 0.5]


def test_logistic_never_falls_by_more_than_its_error():
    values = logistics(dense_grid())
    assert (np.maximum.accumulate(values) - values).max() < 1.2e-7


def test_logistic_rises_wherever_inputs_are_a_thousandth_apart():
    values = logistics(np.arange(-5, 5, 0.001))
    assert (np.diff(values) > 0).all()


def test_logistic_saturates_beyond_its_bound():
    low, high = logistics([-44.0, -45.0, -1e6, -3e38, -np.inf]), logistics([44.0, 45.0, 1e6, 3e38, np.inf])
    assert (low == low[0]).all()
    assert 0 < low[0] < 1e-19
    assert (high == 1.0).all()


def test_logistic_never_makes_a_denormal_even_times_a_small_weight():
    values = logistics(np.concatenate([dense_grid(), [-1e30, 1e30]]))
    assert (values * np.float32(1e-15) >= SMALLEST_NORMAL).all()


def test_logistic_in_lanes_equals_the_scalar_bit_for_bit():
    z = np.random.default_rng(0).uniform(-60, 60, (500, LANES)).astype(np.float32)
    assert logistics(z).tobytes() == logistics(z.ravel()).tobytes()


# -- one network, by hand ----------------------------------------------------------------------------------------------


def test_a_hidden_neuron_weighs_its_inputs_and_feeds_every_output():
    votes, action = play(one_network(output="linear"), [0.5, 0.25, 2.0, -4.0], [1.0, -2.0])
    assert votes.tolist() == [1.0, -2.0]  # z = 0.5 - 0.5 = 0, so half of each output weight
    assert action == 0


def test_a_hidden_neuron_squashes_its_sum():
    votes, _ = play(one_network(output="linear"), [1.0, -2.0, 1.0, -3.0], [3.0, 1.0])
    np.testing.assert_allclose(votes, [sigmoid(1), -3 * sigmoid(1)], atol=4e-6)


def test_outputs_are_squashed_too_by_default():
    votes, _ = play(one_network(), [0.5, 0.25, 2.0, -4.0], [1.0, -2.0])
    np.testing.assert_allclose(votes, [sigmoid(1), sigmoid(-2)], atol=1e-6)


def test_hidden_neurons_add_up():
    genes = [0.0, 0.0, 2.0, 6.0, 1.0, 0.0, 1.0, -1.0]
    votes, action = play(one_network(2, output="linear"), genes, [2.0, 9.0])
    np.testing.assert_allclose(votes, [1 + sigmoid(2), 3 - sigmoid(2)], atol=2e-6)
    assert action == 1


def test_the_bias_gene_stands_between_input_and_output_weights():
    controller = one_network(bias=True, output="linear")
    votes, _ = play(controller, [0.5, 0.25, log(3), 4.0, 8.0], [1.0, -2.0])
    np.testing.assert_allclose(votes, [3.0, 6.0], atol=1e-5)  # the logistic of log(3) is 3/4


def test_input_scale_multiplies_what_the_network_reads_but_not_its_bias():
    controller = one_network(bias=True, output="linear", input_scale=0.5)
    votes, _ = play(controller, [1.0, 0.0, 1.0, 1.0, 0.0], [4.0, 0.0])
    np.testing.assert_allclose(votes, [sigmoid(3), 0.0], atol=1e-6)


def test_a_network_reads_the_entries_that_it_is_wired_to():
    controller = make_controller(SideConfig(n_hidden=1, output="linear"), np.array([[3, 1]]), 2)
    votes, _ = play(controller, [1.0, 10.0, 1.0, 0.0], [99.0, 0.1, 99.0, 1.0])
    np.testing.assert_allclose(votes, [sigmoid(2), 0.0], atol=1e-6)


def test_saturated_neurons_stay_finite():
    votes, _ = play(one_network(output="linear"), [1e6, 1e6, 10.0, -10.0], [5000.0, 5000.0])
    assert votes.tolist() == [10.0, -10.0]


# -- several networks ------------------------------------------------------------------------------------------------

HALVES = [0.0, 0.0]  # input weights with which the hidden neuron is at 1/2, whatever it sees


def test_the_networks_outputs_are_summed_per_action():
    genes = [*HALVES, 2.0, 0.0, 1.0, *HALVES, 0.0, 3.0, 1.0]
    votes, action = play(two_networks(3, output="linear"), genes, [1, 2, 3, 4])
    assert votes.tolist() == [1.0, 1.5, 1.0]
    assert action == 1


def test_each_network_squashes_its_own_outputs_before_the_sum():
    """Two lukewarm votes beat one hot vote, which a sum of raw outputs would let win."""
    genes = [*HALVES, 20.0, 2.0, *HALVES, -8.0, 2.0]
    assert play(two_networks(output="linear"), genes, [1, 2, 3, 4])[1] == 0
    votes, action = play(two_networks(), genes, [1, 2, 3, 4])
    np.testing.assert_allclose(votes, [sigmoid(10) + sigmoid(-4), 2 * sigmoid(1)], atol=2e-6)
    assert action == 1


@pytest.mark.parametrize(
    ("votes", "winner"),
    [
        ([1, 1, 1, 1, 1], 0),
        ([0, 1, 1, 0, 1], 1),
        ([0, 0, 2, 2, 2], 2),
        ([0, 0, 0, 2, 2], 3),
        ([0, 0, 0, 0, 2], 4),
        ([-1, -2, -1, -2, -2], 0),
        ([-3, -2, -2, -2, -2], 1),
    ],
)
def test_the_largest_sum_wins_and_of_equal_ones_the_lowest_index(votes: list[int], winner: int):
    genes = [*HALVES, *(2 * vote for vote in votes)]
    shown, action = play(one_network(n_actions=5, output="linear"), genes, [1, 1])
    assert shown.tolist() == votes
    assert action == winner


@pytest.mark.parametrize("output", ["linear", "logistic"])
def test_by_default_the_network_of_a_caught_prey_votes_on_zero(output: str):
    votes, _ = play(two_networks(output=output), [*HALVES, 2.0, 0.0, *HALVES, 4.0, 8.0], [1, 2, 0, 0])
    expected = [3.0, 4.0] if output == "linear" else [sigmoid(1) + sigmoid(2), 0.5 + sigmoid(4)]
    np.testing.assert_allclose(votes, expected, atol=2e-6)


@pytest.mark.parametrize("bias", [False, True])
def test_a_network_that_sees_nothing_has_no_vote_where_it_is_skipped(bias: bool):
    inputs = [*HALVES, 5.0] if bias else HALVES
    controller = two_networks(output="logistic", captured_vote="skip", bias=bias)
    genes = [*inputs, 2.0, 0.0, *inputs, 4.0, 8.0]
    both, _ = play(controller, genes, [1, 0, 0, 1])
    first, _ = play(controller, genes, [1, 2, 0, 0])
    hidden = sigmoid(5) if bias else 0.5
    np.testing.assert_allclose(first, [sigmoid(2 * hidden), 0.5], atol=1e-5)
    np.testing.assert_allclose(both - first, [sigmoid(4 * hidden), sigmoid(8 * hidden)], atol=1e-5)
    nobody, action = play(controller, genes, [0, 0, 0, 0])
    assert nobody.tolist() == [0.0, 0.0]
    assert action == 0


def test_one_offset_of_zero_is_not_silence():
    controller = one_network(output="linear", captured_vote="skip")
    for seen in ([0.0, 3.0], [3.0, 0.0], [-1.0, 0.0]):
        assert play(controller, [*HALVES, 2.0, 4.0], seen)[0].tolist() == [1.0, 2.0]


# -- any network -----------------------------------------------------------------------------------------------------

SIDES = st.builds(
    SideConfig,
    n_hidden=st.integers(1, 12),
    bias=st.booleans(),
    output=st.sampled_from(["linear", "logistic"]),
    input_scale=st.sampled_from([1.0, 0.5, 0.02]),
    captured_vote=st.sampled_from(["zero", "skip"]),
)
WIRINGS = st.sampled_from([[[0, 1]], [[0, 1], [2, 3], [4, 5]], [[0, 1, 2, 3, 4, 5]], [[5, 0, 3], [1, 1, 2]]])


def random_lanes(side: SideConfig, wiring: list[list[int]], seed: int) -> tuple[Controller, np.ndarray, np.ndarray]:
    controller = make_controller(side, np.array(wiring), 5)
    generator = np.random.default_rng(seed)
    genes = generator.uniform(-6, 6, (LANES, int(np.prod(controller.shape)))).astype(np.float32)
    seen = generator.integers(-50, 50, (LANES, 6)).astype(np.float32)
    seen[::4, :2] = 0  # caught
    return controller, genes, seen


@given(SIDES, WIRINGS, st.integers(0, 1000))
def test_votes_agree_with_double_precision(side: SideConfig, wiring: list[list[int]], seed: int):
    controller, genes, seen = random_lanes(side, wiring, seed)
    for one, view in zip(genes, seen, strict=True):
        votes, action = play(controller, one, view)
        np.testing.assert_allclose(votes, expected_votes(controller, side, one, view), atol=3e-4)
        assert action == votes.argmax()


@given(SIDES, WIRINGS, st.integers(0, 1000))
def test_sixteen_agents_in_lanes_equal_one_at_a_time_bit_for_bit(side: SideConfig, wiring: list[list[int]], seed: int):
    controller, genes, seen = random_lanes(side, wiring, seed)
    votes, actions = play(controller, genes, seen)
    alone = [play(controller, one, view) for one, view in zip(genes, seen, strict=True)]
    assert votes.tobytes() == np.array([votes for votes, _ in alone]).tobytes()
    assert actions.tolist() == [int(action) for _, action in alone]


# Actions that are drawn.


def drawn(votes: Any, memory: np.ndarray) -> np.ndarray:
    """Actions for ``votes (..., n_actions)``; ``memory (1, ...)`` goes on to its next state."""
    votes = np.ascontiguousarray(np.asarray(votes, np.float32).T)
    action = np.empty((1, *votes.shape[1:]), np.int32)
    _draw(one_network(n_actions=len(votes), choice="drawn"), votes, memory, action)
    return action[0]


@pytest.mark.parametrize("z", [0.0, -1e-7, -0.5, -1.0, -10.0, -43.9])
def test_the_exponential_is_off_by_a_few_units_in_the_last_place(z: float):
    out = np.empty(1, np.float32)
    _exponentials(np.array([z], np.float32), out)
    assert out[0] == pytest.approx(exp(np.float32(z)), rel=5e-6)


def test_far_below_the_exponential_stays_normal():
    out = np.empty(1, np.float32)
    _exponentials(np.array([-1e6], np.float32), out)
    assert SMALLEST_NORMAL < out[0] < 1e-19


def test_actions_are_drawn_in_proportion_to_e_to_the_power_of_the_votes():
    votes, memory = [log(4), log(1), log(3), log(2)], np.array([12345], np.int32)
    counts = np.bincount([int(drawn(votes, memory)) for _ in range(5_000)], minlength=4)
    np.testing.assert_allclose(counts / 5_000, [0.4, 0.1, 0.3, 0.2], atol=0.02)


def test_votes_count_by_their_differences_alone():
    for shift in (-1000.0, 0.0, 1000.0):
        memory = np.array([7], np.int32)
        actions = [int(drawn(np.array([0.0, 1.0, 2.0]) + shift, memory)) for _ in range(200)]
        if shift == -1000.0:
            expected = actions
        assert actions == expected


@pytest.mark.parametrize("far", [50, 1000])
def test_a_vote_far_above_the_others_is_always_followed(far: int):
    """However far: ``e ** 1000`` is no 32-bit float."""
    for state in (1, 2**30, 2**31 - 128):
        for action in range(5):
            assert drawn(np.eye(5)[action] * far, np.array([state], np.int32)) == action


def test_a_share_that_rounds_up_to_1_draws_the_last_action():
    """Of the last 64 states; runs that were made cannot be remade if this changes."""
    for state, action in ((2**31 - 128, 0), (2**31 - 64, 4), (2**31 - 1, 4)):
        assert drawn(np.eye(5)[0] * 50, np.array([state], np.int32)) == action


def test_the_first_and_the_last_state_draw_the_first_and_the_last_action():
    assert drawn([0.0, 0.0, 0.0], np.array([0], np.int32)) == 0
    assert drawn([0.0, 0.0, 0.0], np.array([2**31 - 1], np.int32)) == 2


@given(st.integers(0, 2**31 - 1), st.lists(st.floats(-50, 50, width=32), min_size=5, max_size=5))
def test_lanes_draw_as_one_does(state: int, votes: list[float]):
    memory = np.array([(state + lane * 99991) % 2**31 for lane in range(LANES)], np.int32)
    each = [int(drawn(votes, memory[lane : lane + 1].copy())) for lane in range(LANES)]
    np.testing.assert_array_equal(drawn([votes] * LANES, memory[None].copy()), each)
