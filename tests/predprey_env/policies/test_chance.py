"""The random numbers of compiled code: in range, spread out, and the same for one world as for sixteen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit

from predprey_env.jit.compilation import entry_point
from predprey_env.jit.lanes import LANES, lane_zeros, load, store
from predprey_env.policies.chance import next_state, pick, scramble

TOP = 2**31
SEEDS = [0, 1, 2, 7, 2**15, 2**30, TOP - 1, *np.random.default_rng(0).integers(0, TOP, 50).tolist()]


@entry_point
def _walk(states: Any, n_actions: int, actions: Any) -> None:
    """As many choices as there are rows to write them to."""
    for i in range(len(actions)):
        state = load(states, 0)
        store(actions, i, pick(state, n_actions))
        store(states, 0, next_state(state))


def scrambled(seeds: list[int], agent: int) -> np.ndarray:
    return np.array([scramble(seed, agent) for seed in seeds])


# -- the first state ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("agent", [0, 1, 2, 15, 1000])
def test_every_seed_and_agent_starts_from_a_31_bit_number(agent: int) -> None:
    states = scrambled(SEEDS, agent)
    assert states.min() >= 0
    assert states.max() < TOP
    assert states.tolist() == [scramble.py_func(seed, agent) for seed in SEEDS]  # in integers of any size


def test_no_two_seeds_start_an_agent_alike() -> None:
    seeds = [*range(5000), *range(TOP - 5000, TOP)]
    for agent in (0, 3):
        assert len(set(scrambled(seeds, agent).tolist())) == len(seeds)


def test_no_two_agents_start_alike() -> None:
    for seed in SEEDS:
        assert len({scramble(seed, agent) for agent in range(100)}) == 100


def test_neighbouring_seeds_and_agents_share_no_pattern() -> None:
    """Half of the bits differ, as they do between any two random numbers."""
    seeds = range(2000)
    for states, others in [
        (scrambled(seeds, 0), scrambled(range(1, 2001), 0)),
        (scrambled(seeds, 0), scrambled(seeds, 1)),
    ]:
        assert np.bitwise_count(states ^ others).mean() == pytest.approx(15.5, abs=0.4)


# -- the next state -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("state", "after"),
    [
        (0, 1_013_904_223),
        (1, 1_013_904_223 + 1_664_525),
        (1000, 1_013_904_223 + 1_664_525_000 - TOP),
        (TOP - 1, 1_013_904_223 - 1_664_525),
    ],
)
def test_a_state_advances_as_a_linear_congruential_generator_does(state: int, after: int) -> None:
    assert next_state(state) == after


def test_a_walk_does_not_come_round_soon() -> None:
    state, seen = scramble(0, 0), set()
    for _ in range(100_000):
        seen.add(state)
        state = next_state(state)
    assert len(seen) == 100_000


# -- a choice -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("n", "first_states"),
    [
        (2, [0, 2**30]),
        (4, [0, 2**29, 2 * 2**29, 3 * 2**29]),
        (5, [0, 429_496_729, 858_993_458, 1_288_490_187, 1_717_986_916]),
    ],
)
def test_a_choice_goes_by_the_high_bits(n: int, first_states: list[int]) -> None:
    ends = [first - 1 for first in [*first_states[1:], TOP]]
    assert [pick(state, n) for state in first_states] == list(range(n))
    assert [pick(state, n) for state in ends] == list(range(n))


# -- one world and sixteen ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("n_actions", [4, 5])
def test_each_lane_walks_as_a_number_does(n_actions: int) -> None:
    states = lane_zeros(np.int32, 1)
    states[0] = scrambled(SEEDS[:LANES], 2)
    states[0, -1] = TOP - 1
    alone = states[0].copy()
    actions = lane_zeros(np.int32, 300)
    _walk(states, n_actions, actions)
    for lane in range(LANES):
        walk, state = np.zeros(300, np.int32), alone[lane : lane + 1]
        _walk(state, n_actions, walk)
        assert actions[:, lane].tolist() == walk.tolist()
        assert states[0, lane] == state[0]
    assert states.min() >= 0
    assert np.unique(actions).tolist() == list(range(n_actions))


def test_a_number_of_32_bits_advances_as_one_of_64_does() -> None:
    @njit
    def advanced(states: Any) -> Any:
        return next_state(states[0])

    for state in (0, 1, 2**30, TOP - 1):
        assert advanced(np.array([state], np.int32)) == advanced(np.array([state], np.int64)) == next_state(state)
