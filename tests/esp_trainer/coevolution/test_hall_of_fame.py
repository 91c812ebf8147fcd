"""Past champions: in order, copied, unchanging, and never more than there is room for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.coevolution.hall_of_fame import HallOfFame, kept_generations

SHAPE = (2, 1, 3, 4)
ROOM = 100


def champion(number: int) -> np.ndarray:
    return np.full(SHAPE, number, np.float32)


def empty() -> HallOfFame:
    return HallOfFame(np.empty((0, *SHAPE), np.float32), ROOM)


def test_an_empty_hall_has_no_champions():
    fame = empty()
    assert len(fame) == 0
    assert fame.champions.shape == (0, *SHAPE)


@given(st.integers(0, 5), st.integers(1, 70))
def test_champions_stand_in_order_of_generation(n_before: int, n_added: int):
    before = np.array([champion(k) for k in range(n_before)], np.float32).reshape(-1, *SHAPE)
    fame = HallOfFame(before, ROOM, n_before)
    for number in range(n_before, n_before + n_added):
        fame = fame.with_champion(champion(number))
        assert len(fame) == number + 1
    assert fame.champions.shape == (n_before + n_added, *SHAPE)
    assert fame.champions.dtype == np.float32
    assert (fame.champions == np.arange(n_before + n_added)[:, None, None, None, None]).all()


def test_what_comes_in_is_copied():
    first, later = np.array([champion(1)]), champion(2)
    fame = HallOfFame(first, ROOM, 1)
    first[:] = 77
    fame = fame.with_champion(later)
    later[:] = 77
    assert fame.champions[:, 0, 0, 0, 0].tolist() == [1, 2]


def test_champions_cannot_be_written_to():
    fame = empty()
    fame = fame.with_champion(champion(1))
    with pytest.raises(ValueError, match="read-only"):
        fame.champions[0] = 5
    fame = fame.with_champion(champion(2))
    assert fame.champions[:, 0, 0, 0, 0].tolist() == [1, 2]


def test_a_hall_stays_as_it_is_when_another_champion_comes():
    before = fame = empty().with_champion(champion(1))
    for number in range(2, 60):
        fame = fame.with_champion(champion(number))
    assert before.done == 1
    assert before.champions.shape == (1, *SHAPE)
    assert (before.champions == 1).all()


@pytest.mark.parametrize(
    ("done", "kept"),
    [
        (0, []),
        (1, [0]),
        (4, [0, 1, 2, 3]),
        (5, [0, 2, 4]),
        (6, [0, 2, 4, 5]),
        (7, [0, 2, 4, 6]),
        (8, [0, 4, 7]),
        (9, [0, 4, 8]),
        (13, [0, 4, 8, 12]),
        (14, [0, 8, 13]),
        (1000, [0, 512, 999]),
    ],
)
def test_a_hall_of_four_keeps_every_second_fourth_eighth_and_the_last(done: int, kept: list[int]):
    assert kept_generations(done, 4).tolist() == kept


@given(st.integers(2, 40), st.integers(0, 300))
def test_a_hall_that_is_full_keeps_what_it_had_or_less_and_the_newest(size: int, done: int):
    before, after = (set(kept_generations(n, size).tolist()) for n in (done, done + 1))
    assert after <= before | {done}
    assert done in after
    assert size / 2 < len(after) <= size or len(after) == done + 1


@given(st.integers(2, 12), st.integers(0, 60))
def test_champions_are_those_of_the_generations_that_are_kept(size: int, done: int):
    fame = HallOfFame(np.empty((0, *SHAPE), np.float32), size)
    for number in range(done):
        fame = fame.with_champion(champion(number))
    assert fame.champions[:, 0, 0, 0, 0].tolist() == fame.generations.tolist() == kept_generations(done, size).tolist()
    again = HallOfFame(fame.champions, size, done)
    assert (again.with_champion(champion(done)).champions == fame.with_champion(champion(done)).champions).all()


def test_a_hall_holds_no_more_champions_than_its_size():
    fame = HallOfFame(np.empty((0, *SHAPE), np.float32), 20)
    for number in range(10_000):
        fame = fame.with_champion(champion(number))
    assert len(fame.champions) <= 20
    assert fame.champions.base is None  # and no other memory


def test_champions_of_another_number_of_generations_are_refused():
    with pytest.raises(ValueError, match="3 champions are kept of 5 generations, got 5"):
        HallOfFame(np.zeros((5, *SHAPE), np.float32), 4, 5)


# -- what is remembered of those who were met ------------------------------------------------------------------------


def hall(n: int) -> HallOfFame:
    return HallOfFame(np.array([champion(k) for k in range(n)], np.float32).reshape(-1, *SHAPE), ROOM, n)


def test_results_are_added_to_nine_tenths_of_the_earlier_ones():
    fame = hall(3).with_results(np.array([[0, 2], [2, 2]]), np.array([[1.0, 0.5], [0.0, 1.0]]))
    assert fame.met.tolist() == [[1.0, 1.0], [0.0, 0.0], [1.5, 3.0]]
    again = fame.with_results(np.array([1]), np.array([1.0]))
    assert again.met == pytest.approx(np.array([[0.9, 0.9], [1.0, 1.0], [1.35, 2.7]]))
    assert fame.met.tolist() == [[1.0, 1.0], [0.0, 0.0], [1.5, 3.0]]


def test_a_rate_of_winning_begins_at_one_half():
    assert hall(2).wins.tolist() == [0.5, 0.5]
    fame = hall(2).with_results(np.array([0, 0, 0]), np.ones(3))
    assert fame.wins.tolist() == [3.5 / 4, 0.5]


def test_a_new_champion_was_never_met_and_those_that_stay_keep_their_results():
    met = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]])
    fame = HallOfFame(hall(4).champions, 4, 4, met).with_champion(champion(4))
    assert fame.generations.tolist() == [0, 2, 4]
    assert fame.met.tolist() == [[1.0, 2.0], [5.0, 6.0], [0.0, 0.0]]


# -- guests, the champions of other runs -----------------------------------------------------------------------------


def with_guests(n: int, size: int = ROOM, met: np.ndarray | None = None) -> HallOfFame:
    """Guests 70 and 71, and then champions 0, 1, ..."""
    return HallOfFame(hall(n).champions, size, n, met, np.array([champion(70), champion(71)]))


def test_guests_come_before_the_champions_and_count_as_generation_0():
    fame = with_guests(3)
    assert len(fame) == 5
    assert fame.members(np.array([0, 1, 3, 4]))[:, 0, 0, 0, 0].tolist() == [70, 71, 1, 2]
    assert fame.members(np.array([1]))[:, 0, 0, 0, 0].tolist() == [71]
    assert fame.members(np.array([2, 4]))[:, 0, 0, 0, 0].tolist() == [0, 2]
    assert fame.generations.tolist() == [0, 0, 0, 1, 2]
    assert fame.champions[:, 0, 0, 0, 0].tolist() == [0, 1, 2]


def test_guests_are_members_before_the_first_champion():
    assert len(with_guests(0)) == 2
    assert with_guests(0).members(np.array([0, 1]))[:, 0, 0, 0, 0].tolist() == [70, 71]
    assert with_guests(0).done == 0


def test_guests_stay_with_their_results_while_champions_go():
    met = np.array([[8.0, 9.0], [6.0, 7.0], [1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [7.0, 8.0]])
    fame = with_guests(4, 4, met)
    for number in range(4, 9):
        fame = fame.with_champion(champion(number))
        assert fame.members(np.array([0, 1]))[:, 0, 0, 0, 0].tolist() == [70, 71]
        assert fame.met[:2].tolist() == [[8.0, 9.0], [6.0, 7.0]]
    assert fame.generations.tolist() == [0, 0, 0, 4, 8]
    assert fame.champions[:, 0, 0, 0, 0].tolist() == [0, 4, 8]
    assert fame.met[2:].tolist() == [[1.0, 2.0], [0.0, 0.0], [0.0, 0.0]]


def test_results_of_guests_are_remembered_as_those_of_champions():
    fame = with_guests(1).with_results(np.array([0, 0, 2]), np.array([1.0, 0.5, 0.0]))
    assert fame.met.tolist() == [[1.5, 2.0], [0.0, 0.0], [0.0, 1.0]]
    fame = fame.with_results(np.array([1]), np.array([1.0]))
    assert fame.met == pytest.approx(np.array([[1.35, 1.8], [1.0, 1.0], [0.0, 0.9]]))
    assert fame.wins == pytest.approx([1.85 / 2.8, 1.5 / 2.0, 0.5 / 1.9])


def test_all_halls_share_the_guests():
    """A copy for each generation would cost as much as all of them."""
    before = with_guests(1)
    after = before.with_champion(champion(1)).with_results(np.array([0]), np.array([1.0]))
    assert after.guests is before.guests


def test_guests_of_another_shape_are_refused():
    with pytest.raises(ValueError, match=r"^a guest must have shape \(2, 1, 3, 4\), got \(2, 1, 3, 5\)$"):
        HallOfFame(hall(2).champions, ROOM, 2, guests=np.zeros((6, 2, 1, 3, 5), np.float32))
