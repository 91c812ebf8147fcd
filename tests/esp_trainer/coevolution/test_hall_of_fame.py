"""Past champions: in order, copied, unchanging."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.coevolution.hall_of_fame import HallOfFame

SHAPE = (2, 1, 3, 4)


def champion(number: int) -> np.ndarray:
    return np.full(SHAPE, number, np.float32)


def empty() -> HallOfFame:
    return HallOfFame(np.empty((0, *SHAPE), np.float32))


def test_an_empty_hall_has_no_champions():
    fame = empty()
    assert len(fame) == 0
    assert fame.champions.shape == (0, *SHAPE)


@given(st.integers(0, 5), st.integers(1, 70))
def test_champions_stand_in_order_of_generation(n_before: int, n_added: int):
    fame = HallOfFame(np.array([champion(k) for k in range(n_before)], np.float32).reshape(-1, *SHAPE))
    for number in range(n_before, n_before + n_added):
        fame.add(champion(number))
        assert len(fame) == number + 1
    assert fame.champions.shape == (n_before + n_added, *SHAPE)
    assert fame.champions.dtype == np.float32
    assert (fame.champions == np.arange(n_before + n_added)[:, None, None, None, None]).all()


def test_what_comes_in_is_copied():
    first, later = np.array([champion(1)]), champion(2)
    fame = HallOfFame(first)
    first[:] = 77
    fame.add(later)
    later[:] = 77
    assert fame.champions[:, 0, 0, 0, 0].tolist() == [1, 2]


def test_champions_cannot_be_written_to():
    fame = empty()
    fame.add(champion(1))
    with pytest.raises(ValueError, match="read-only"):
        fame.champions[0] = 5
    fame.add(champion(2))
    assert fame.champions[:, 0, 0, 0, 0].tolist() == [1, 2]


def test_champions_handed_out_before_do_not_change_when_more_come():
    fame = empty()
    fame.add(champion(1))
    before = fame.champions
    for number in range(2, 60):
        fame.add(champion(number))
    assert before.shape == (1, *SHAPE)
    assert (before == 1).all()
