"""Whom teams meet in trials of their own."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

import numpy as np
import pytest

from esp_trainer.coevolution.hall_of_fame import HallOfFame
from esp_trainer.coevolution.opponents import OPPONENTS
from esp_trainer.config import EspConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.types import EvolvedTeams

CONTROLLER = make_controller(SideConfig(n_hidden=3), np.array([[0, 1], [2, 3]]), 4)
SIZE = 7
N_TRIALS = 2000
SHAPE = (2, 2, 3, 6)  # agents, networks, hidden neurons, genes


def side() -> Subpopulations:
    """Subpopulations whose genes are the numbers 0 to 6 of their neurons."""
    genomes = np.broadcast_to(np.arange(SIZE, dtype=np.float32)[:, None], (*SHAPE[:3], SIZE, 6)).copy()
    return Subpopulations(EspConfig(subpopulation_size=SIZE, hof_mates=0), CONTROLLER, genomes)


def fame(n: int = 4) -> HallOfFame:
    """Champions whose genes are 100, 101, ..."""
    hall = HallOfFame(np.empty((0, *SHAPE), np.float32), SIZE)
    for number in range(n):
        hall = hall.with_champion(np.full(SHAPE, 100 + number, np.float32))
    return hall


def opponents(pairing: str, seed: int = 0, population: Subpopulations | None = None) -> EvolvedTeams:
    return OPPONENTS[pairing](population or side(), fame(), N_TRIALS, np.random.default_rng(seed))


Members = Callable[[EvolvedTeams], np.ndarray]


def test_there_are_opponents_for_every_pairing_but_cosampling():
    assert {*OPPONENTS, "cosample"} == set(get_args(EspConfig.model_fields["pairing"].annotation))


def test_the_previous_champion_is_the_last_one_in_every_trial(members: Members):
    teams = members(opponents("previous_champion"))
    assert teams.shape == (N_TRIALS, *SHAPE)
    assert (teams == 103).all()


def test_the_hall_of_fame_sends_a_whole_champion_drawn_uniformly(members: Members):
    teams = members(opponents("hall_of_fame")).reshape(N_TRIALS, -1)
    assert (teams == teams[:, :1]).all()
    counts = np.bincount(teams[:, 0].astype(int) - 100, minlength=4)
    assert len(counts) == 4
    assert (abs(counts / N_TRIALS - 0.25) < 0.05).all()


def test_mixed_opponents_are_champions_and_drawn_teams_half_and_half(members: Members):
    teams = members(opponents("mixed")).reshape(N_TRIALS, -1)
    famous = (teams >= 100).all(axis=1)
    drawn = (teams < SIZE).all(axis=1)
    assert (famous | drawn).all()
    assert abs(famous.mean() - 0.5) < 0.05
    assert (teams[famous] == teams[famous][:, :1]).all()
    assert len(np.unique(teams[famous])) == 4
    for subpopulation in teams[drawn].T:
        assert (abs(np.bincount(subpopulation.astype(int), minlength=SIZE) / drawn.sum() - 1 / SIZE) < 0.05).all()
    assert (teams[drawn] != teams[drawn][:, :1]).any()


@pytest.mark.parametrize("pairing", OPPONENTS)
def test_opponents_follow_from_their_generator(pairing: str, members: Members):
    one, same, other = (members(opponents(pairing, seed)) for seed in (0, 0, 1))
    assert np.array_equal(one, same)
    assert np.array_equal(one, other) == (pairing == "previous_champion")


@pytest.mark.parametrize("pairing", OPPONENTS)
def test_drawing_opponents_leaves_the_side_ready_to_be_asked(pairing: str):
    population = side()
    before = population.genomes.copy()
    opponents(pairing, population=population)
    assert np.array_equal(population.genomes, before)
    population.ask(np.random.default_rng(0))


@pytest.mark.parametrize("pairing", OPPONENTS)
def test_a_single_champion_is_enough(pairing: str, members: Members):
    teams = OPPONENTS[pairing](side(), fame(1), 50, np.random.default_rng(0))
    assert np.isin(members(teams), [100, *range(SIZE)]).all()
    assert (members(teams) == 100).any()
