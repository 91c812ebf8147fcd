"""A team as a policy, and the ways to lay teams out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.team import Team, as_candidates, gather_genomes
from esp_trainer.teams.zoo import load_team, load_zoo
from esp_trainer.types import EvolvedTeams

SIDE = SideConfig(n_hidden=1, output="linear")
HALVES = [0.0, 0.0]  # input weights with which the hidden neuron is at 1/2, whatever it sees


def team(genomes: Any, wiring: Any = ((0, 1),), n_actions: int = 4, role: Any = "predators") -> Team:
    controller = make_controller(SIDE, np.array(wiring), n_actions)
    return Team(role, SIDE, controller, np.asarray(genomes, np.float32))


def who_always_chooses(*actions: int) -> Team:
    """A team whose agents vote for one action each."""
    return team([[[[*HALVES, *np.eye(4)[action]]]] for action in actions])


def test_a_team_is_shown_in_a_line():
    assert repr(who_always_chooses(3, 1)) == str(who_always_chooses(3, 1)) == "<Team: 2 predators, split networks>"
    champion = load_team("paper-3v2/prey/seed-500-late")
    generation = champion.provenance["generation"]
    assert repr(champion) == f"<Team: 2 prey, split networks, preset paper-3v2, seed 500, generation {generation}>"
    assert repr(champion.as_teams(7)) == "<EvolvedTeams: 7 trials>"
    assert repr(load_zoo("3v2")).count("\n") == 0


def test_each_agent_acts_by_its_own_networks():
    view = np.ones(2, np.float32)
    actions = who_always_chooses(3, 1, 2).act({"predator_0": view, "predator_1": view, "predator_2": view})
    assert actions == {"predator_0": 3, "predator_1": 1, "predator_2": 2}
    assert all(type(action) is int for action in actions.values())


def test_an_agents_networks_are_found_by_the_number_at_the_end_of_its_name():
    view = np.ones(2, np.float32)
    assert who_always_chooses(3, 1, 2).act({"adversary_2": view, "red_adversary_1": view}) == {
        "adversary_2": 2,
        "red_adversary_1": 1,
    }


def test_only_agents_with_an_observation_act():
    assert who_always_chooses(3, 1).act({}) == {}
    assert who_always_chooses(3, 1).act({"predator_1": np.ones(2, np.float32)}) == {"predator_1": 1}


def test_a_team_takes_its_own_from_what_everybody_sees():
    view = np.ones(2, np.float32)
    everybody = dict.fromkeys(["predator_0", "predator_1", "prey_0", "prey_1", "prey_2"], view)
    genomes = who_always_chooses(3, 1).genomes
    assert team(genomes).act(everybody) == {"predator_0": 3, "predator_1": 1}
    everybody["prey_2"] = everybody.pop("predator_1")
    assert team(np.concatenate([genomes, genomes]), role="prey").act(everybody) == {
        "prey_0": 3,
        "prey_1": 1,
        "prey_2": 3,
    }


def test_agents_act_on_what_they_see():
    """One hidden neuron wakes when the opponent is east and votes east, the other when it is west and votes west."""
    side = SIDE.replace(n_hidden=2)
    genomes = np.array([[[[5.0, 0, 1, 0, 0, 0], [-5.0, 0, 0, 1, 0, 0]]]], np.float32)
    chaser = Team("predators", side, make_controller(side, np.array([[0, 1]]), 4), genomes)
    for dx, action in ((9.0, 0), (-9.0, 1)):
        assert chaser.act({"predator_0": np.array([dx, 0.0], np.float32)}) == {"predator_0": action}


def test_the_networks_of_an_agent_vote_together():
    split = team([[[[*HALVES, 2.0, 0.0, 1.0, 0.0]], [[*HALVES, 0.0, 3.0, 1.0, 0.0]]]], wiring=[[0, 1], [2, 3]])
    assert split.act({"predator_0": np.ones(4, np.float32)}) == {"predator_0": 1}


def test_observations_of_any_layout_and_precision_are_read():
    chooser = team([[[[5.0, 0.0, 1.0, 0.0, 0.0, 0.0]]]])
    views = [np.array([9.0, 0.0]), np.array([9, 0]), np.array([9.0, 7.0, 0.0, 7.0], np.float32)[::2]]
    assert [chooser.act({"predator_0": view}) for view in views] == [{"predator_0": 0}] * 3


def test_a_view_longer_than_the_networks_read_is_fine():
    assert who_always_chooses(2).act({"predator_0": np.ones(12, np.float32)}) == {"predator_0": 2}


def test_a_view_too_short_for_the_networks_is_refused():
    with pytest.raises(ValueError, match="predator_0 must observe at least 4 numbers for this team, got 2"):
        team(np.zeros((1, 2, 1, 6)), wiring=[[0, 1], [2, 3]]).act({"predator_0": np.ones(2, np.float32)})


def test_a_team_that_knows_what_it_was_evolved_on_refuses_any_other_view():
    evolved = who_always_chooses(3)
    evolved = Team("predators", SIDE, evolved.controller, evolved.genomes, n_seen=4)
    assert evolved.act({"predator_0": np.ones(4, np.float32)}) == {"predator_0": 3}
    for length in (1, 2, 3, 5):
        with pytest.raises(ValueError, match=f"predator_0 must observe 4 numbers for this team, got {length}"):
            evolved.act({"predator_0": np.ones(length, np.float32)})


def test_an_agent_beyond_the_team_is_refused():
    with pytest.raises(ValueError, match="predator_2 is not in this team of 2 predators"):
        who_always_chooses(0, 1).act({"predator_2": np.ones(2, np.float32)})


@pytest.mark.parametrize("name", ["predator", "predator_", "predator_x"])
def test_an_agent_without_a_number_is_refused_by_name(name: str):
    with pytest.raises(ValueError, match=f"{name} .*number"):
        who_always_chooses(0, 1).act({name: np.ones(2, np.float32)})


def test_acting_and_resetting_change_nothing():
    chooser = who_always_chooses(3, 1)
    before = chooser.genomes.copy()
    first = chooser.act({"predator_0": np.ones(2, np.float32)})
    chooser.reset(7)
    assert chooser.act({"predator_0": np.ones(2, np.float32)}) == first
    assert np.array_equal(chooser.genomes, before)


def test_read_only_genomes_play():
    genomes = who_always_chooses(3, 1).genomes
    genomes.flags.writeable = False
    assert team(genomes).act({"predator_1": np.ones(2, np.float32)}) == {"predator_1": 1}


@pytest.mark.parametrize("shape", [(1, 1, 6), (1, 2, 1, 6), (1, 1, 2, 6), (1, 1, 1, 7)])
def test_genomes_of_another_shape_are_refused(shape: tuple[int, ...]):
    with pytest.raises(
        ValueError, match=r"genomes of feedforward networks must have shape \(agents, \*\(1, 1, 6\)\), got"
    ):
        team(np.zeros(shape))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_genomes_that_are_not_finite_are_refused(value: float):
    genomes = np.zeros((1, 1, 1, 6))
    genomes[0, 0, 0, 2] = value
    with pytest.raises(ValueError, match="genomes must be finite, got NaN or infinity"):
        team(genomes)


# -- layouts -----------------------------------------------------------------------------------------------------------


def test_a_team_can_play_every_trial_of_a_batch():
    one = who_always_chooses(3, 1)
    teams = one.as_teams(5)
    assert teams.indices.shape == (5, 2, 1, 1)
    assert (gather_genomes(teams, np.arange(5)) == one.genomes).all()


def labelled_teams() -> EvolvedTeams:
    """Candidates whose genes are the digits agent, network, hidden neuron, candidate of their place."""
    controller = make_controller(SIDE.replace(n_hidden=3), np.array([[0, 1], [2, 3]]), 4)
    agent, network, hidden, candidate = np.indices((2, 2, 3, 7))
    labels = 1000 * agent + 100 * network + 10 * hidden + candidate
    genomes = np.repeat(labels[..., None], 6, axis=-1).astype(np.float32)
    return EvolvedTeams(controller, genomes, np.random.default_rng(0).integers(0, 7, (9, 2, 2, 3)))


def test_pick_gives_each_place_the_candidate_that_its_trial_chose():
    teams = labelled_teams()
    picked = gather_genomes(teams, np.array([4, 0, 4]))
    assert picked.shape == (3, 2, 2, 3, 6)
    for row, trial in enumerate([4, 0, 4]):
        for agent, network, hidden in np.ndindex(2, 2, 3):
            label = 1000 * agent + 100 * network + 10 * hidden + teams.indices[trial, agent, network, hidden]
            assert (picked[row, agent, network, hidden] == label).all()


def test_picked_genomes_are_copies():
    teams = labelled_teams()
    picked = gather_genomes(teams, np.array([0]))
    before = picked.copy()
    teams.genomes[:] = -1
    assert np.array_equal(picked, before)


def test_whole_teams_laid_out_as_candidates_are_picked_back():
    teams = labelled_teams()
    picked = gather_genomes(teams, np.arange(9))
    candidates = as_candidates(picked)
    assert candidates.shape == (2, 2, 3, 9, 6)
    assert candidates.flags.c_contiguous
    indices = np.broadcast_to(np.arange(9)[:, None, None, None], (9, 2, 2, 3))
    assert np.array_equal(gather_genomes(EvolvedTeams(teams.controller, candidates, indices), np.arange(9)), picked)
