"""Which past champions a generation meets, and how often each choice draws whom."""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

import numpy as np
import pytest

from esp_trainer.coevolution.hall_of_fame import HallOfFame
from esp_trainer.coevolution.opponents import CHOICES, past_teams
from esp_trainer.config import EspConfig, SideConfig
from esp_trainer.esp.controller import make_controller

if TYPE_CHECKING:
    from collections.abc import Callable

    from esp_trainer.types import EvolvedTeams

    Members = Callable[[EvolvedTeams], np.ndarray]

CONTROLLER = make_controller(SideConfig(n_hidden=3), np.array([[0, 1], [2, 3]]), n_actions=4)
SHAPE = (2, 2, 3, 6)  # agents, networks, hidden neurons, genes
N_DRAWN = 40_000


def champions(first: int, n: int) -> np.ndarray:
    """Teams whose genes are ``first``, ``first + 1``, ..."""
    genes = np.arange(first, first + n, dtype=np.float32)
    return np.broadcast_to(genes[:, None, None, None, None], (n, *SHAPE))


def fame(n: int = 4, met: np.ndarray | None = None, n_guests: int = 0) -> HallOfFame:
    """Champions whose genes are 100, 101, ..., and guests whose genes are 900, 901, ..."""
    return HallOfFame(champions(100, n), 100, n, met, champions(900, n_guests))


def frequencies(choice: str, among: HallOfFame, seed: int = 0) -> np.ndarray:
    drawn = CHOICES[choice](among, (N_DRAWN // 4, 4), np.random.default_rng(seed))
    assert drawn.shape == (N_DRAWN // 4, 4)
    return np.bincount(drawn.ravel(), minlength=len(among)) / N_DRAWN


def wins(*rates: float) -> np.ndarray:
    """What is remembered of champions that won so often in so many episodes that the prior does not matter."""
    return np.array([[rate * 1e9, 1e9] for rate in rates])


def test_every_choice_has_a_name_in_the_config():
    assert set(CHOICES) == set(get_args(EspConfig.model_fields["past_choice"].annotation))


@pytest.mark.parametrize(
    ("choice", "met", "expected"),
    [
        ("uniform", None, [1 / 4, 1 / 4, 1 / 4, 1 / 4]),
        ("recent", None, [1 / 10, 2 / 10, 3 / 10, 4 / 10]),
        ("latest", None, [0, 0, 0, 1]),
        # Half way between the rates 0.1, 0.2, 0.5 and 1 are 0.15, 0.35 and 0.75.
        ("spread", wins(0.2, 1.0, 0.1, 0.5), [0.2, 0.25, 0.15, 0.4]),
        ("contested", wins(0.5, 0.2, 0.9, 0.5), np.array([0.25, 0.16, 0.09, 0.25]) / 0.75),
        ("contested", wins(0.0, 1.0, 0.5, 0.0), np.array([0.02, 0.02, 0.25, 0.02]) / 0.31),
        ("hard", wins(0.5, 0.2, 1.0, 0.0), np.array([0.25, 0.04, 1.0, 0.0001]) / 1.2901),
        ("hard", wins(0.0, 0.0, 0.0, 0.001), [1 / 4, 1 / 4, 1 / 4, 1 / 4]),  # all are met now and then
        ("contested", None, [1 / 4, 1 / 4, 1 / 4, 1 / 4]),  # of whom nothing is known
    ],
)
def test_champions_are_drawn_as_often_as_the_choice_says(choice: str, met: np.ndarray | None, expected: np.ndarray):
    assert frequencies(choice, fame(met=met)) == pytest.approx(expected, abs=0.01)


def test_recent_counts_generations_and_not_places():
    """Of 7 generations a hall of 4 keeps 0, 2, 4 and 6."""
    hall = HallOfFame(fame().champions, 4, 7)
    assert frequencies("recent", hall) == pytest.approx(np.array([1, 3, 5, 7]) / 16, abs=0.01)


@pytest.mark.parametrize("choice", CHOICES)
def test_choices_follow_from_their_generator(choice: str):
    hall = fame(30, wins(*np.linspace(0.01, 0.99, 30)))
    one, same, other = (CHOICES[choice](hall, (50, 3), np.random.default_rng(seed)) for seed in (0, 0, 1))
    assert np.array_equal(one, same)
    assert np.array_equal(one, other) == (choice == "latest")


@pytest.mark.parametrize("choice", CHOICES)
def test_a_single_champion_is_enough(choice: str):
    assert (CHOICES[choice](fame(1), (50,), np.random.default_rng(0)) == 0).all()


def test_past_teams_are_the_whole_champions_in_their_places(members: Members):
    teams = past_teams(CONTROLLER, fame(), np.array([3, 0, 3, 1]))
    assert teams.genomes.shape[3] == 3  # those that are met, once each
    assert (members(teams).reshape(4, -1) == np.array([[103], [100], [103], [101]])).all()


@pytest.mark.parametrize(
    ("choice", "met", "expected"),
    [
        ("uniform", None, [1 / 5, 1 / 5, 1 / 5, 1 / 5, 1 / 5]),
        ("recent", None, [1 / 8, 1 / 8, 1 / 8, 2 / 8, 3 / 8]),  # guests are as old as generation 0
        ("latest", None, [0, 0, 0, 0, 1]),
        # Half way between the rates 0.1, 0.2, 0.5, 0.7 and 1 are 0.15, 0.35, 0.6 and 0.85.
        ("spread", wins(0.2, 1.0, 0.1, 0.5, 0.7), [0.2, 0.15, 0.15, 0.25, 0.25]),
        ("contested", wins(0.5, 0.2, 0.9, 0.5, 0.0), np.array([0.25, 0.16, 0.09, 0.25, 0.02]) / 0.77),
    ],
)
def test_two_guests_and_three_champions_are_drawn_as_often_as_the_choice_says(
    choice: str, met: np.ndarray | None, expected: np.ndarray
):
    assert frequencies(choice, fame(3, met, n_guests=2)) == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(
    ("choice", "expected"),
    [
        *(("uniform", [1 / 2, 1 / 2]), ("recent", [1 / 2, 1 / 2]), ("latest", [0, 1])),
        *(("spread", [1 / 2, 1 / 2]), ("contested", [1 / 2, 1 / 2])),
    ],
)
def test_before_the_first_champion_guests_are_drawn(choice: str, expected: list[float]):
    assert frequencies(choice, fame(0, n_guests=2)) == pytest.approx(expected, abs=0.01)


def test_past_teams_are_guests_too(members: Members):
    teams = past_teams(CONTROLLER, fame(n_guests=2), np.array([5, 1, 5, 2, 0]))
    assert teams.genomes.shape[3] == 4
    assert (members(teams).reshape(5, -1) == np.array([[103], [901], [103], [100], [900]])).all()
