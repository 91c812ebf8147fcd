"""What every kind of controller computes from its gene strings, by hand and against double precision."""

from __future__ import annotations

from itertools import combinations
from math import exp
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.esp.network import Networks
from esp_trainer.esp.network import play as play_networks
from esp_trainer.networks.controller import Controller
from predprey_env.jit.compilation import entry_point
from predprey_env.jit.lanes import LANES, store

KINDS = ["split", "monolithic", "combiner", "double", "pairs", "central"]
HALVES = [0.0, 0.0]  # input weights with which a hidden neuron is at 1/2, whatever it sees


@entry_point
def _play(networks: Any, agent: int, seen: Any, action: Any) -> None:
    store(action, 0, play_networks(networks, agent, seen, action, 0))


def play(controller: Controller, genomes: Any, agent: int, seen: Any) -> tuple[np.ndarray, np.ndarray]:
    """Votes and action of an agent of a team ``(n_genomes, *controller.shape)``, or of ``LANES`` teams, which come
    first: ``seen (..., n)`` is what the agent sees, or, to a central controller, what all see.
    """
    seen = np.asarray(seen, np.float32)
    genomes = np.asarray(genomes, np.float32).reshape(*seen.shape[:-1], -1)
    lanes = seen.shape[:-1]
    inputs = np.full((max(controller.fan_in) + 1, *lanes), np.nan, np.float32)
    votes = np.full((controller.n_votes, *lanes), np.nan, np.float32)
    action = np.empty((1, *lanes), np.int32)
    networks = Networks(controller, np.ascontiguousarray(genomes.T), inputs, votes)
    _play(networks, agent, np.ascontiguousarray(seen.T), action)
    return votes[: controller.n_actions].T, action[0]


def made(side: SideConfig, n_opponents: int, n_agents: int, n_actions: int) -> Controller:
    return make_controller(side, wiring_for(side, n_opponents, n_agents), n_actions, n_agents)


def filled_up(controller: Controller, *networks: list[float]) -> np.ndarray:
    """A genome whose networks have a single hidden neuron each; what no network reads is NaN."""
    genome = np.full(controller.shape, np.nan)
    for network, genes in enumerate(networks):
        genome[network, 0, : len(genes)] = genes
    return genome


def logistic(z: Any) -> Any:
    return 1 / (1 + np.exp(-np.clip(z, -700, 700)))


# -- the combiner, by hand ---------------------------------------------------------------------------------------------


def combiner(n_opponents: int = 2, n_actions: int = 2, **settings: Any) -> Controller:
    side = SideConfig(**{"controller": "combiner", "n_hidden": 1, "output": "linear", **settings})
    return made(side, n_opponents, 1, n_actions)


def test_the_combiner_reads_the_others_outputs_and_decides_alone():
    """The split networks say (1, 0) and (0, 2), of which the sum would choose 1."""
    controller = combiner()
    genome = filled_up(controller, [*HALVES, 2, 0], [*HALVES, 0, 4], [1, 50, 70, -0.5, 3, -8])
    votes, action = play(controller, genome, 0, [1, 2, 3, 4])
    assert votes.tolist() == [1.5, -4.0]  # it is at the logistic of 1 - 1
    assert action == 0


def test_the_combiner_reads_outputs_network_by_network_and_action_by_action():
    controller = combiner(3)
    says = [[*HALVES, 2 * a, 2 * b] for a, b in ((0.1, 0.2), (0.3, 0.4), (0.5, 0.6))]
    for read, value in enumerate((0.1, 0.2, 0.3, 0.4, 0.5, 0.6)):
        votes, _ = play(controller, filled_up(controller, *says, [*(10 * np.eye(6)[read]), 1, 0]), 0, np.ones(6))
        np.testing.assert_allclose(votes, [1 / (1 + exp(-10 * value)), 0], atol=2e-6)


def test_the_combiner_reads_squashed_outputs_and_squashes_its_own():
    controller = combiner(1, output="logistic")
    genome = filled_up(controller, [*HALVES, 4, 0], [1, 0, 6, -6])
    votes, _ = play(controller, genome, 0, [7, 9])
    z = 6 * logistic(logistic(2))
    np.testing.assert_allclose(votes, [logistic(z), logistic(-z)], atol=1e-6)


def test_the_combiner_has_a_bias_of_its_own_and_is_not_scaled():
    controller = combiner(1, bias=True, input_scale=0.5)
    genome = filled_up(controller, [2, 0, -3, 4, 0], [1, 0, 5, 1, 0])
    votes, _ = play(controller, genome, 0, [3, 9])
    np.testing.assert_allclose(votes, [logistic(2 + 5), 0], atol=2e-6)  # the network is at the logistic of 3 - 3


def test_to_the_combiner_a_silent_network_says_zero_and_it_is_silent_if_all_are():
    controller = combiner(captured_vote="skip")
    genome = filled_up(controller, [*HALVES, 2, 2], [*HALVES, 4, 4], [0, 1, 0, 1, 1, 3])
    for seen, said in (([1, 2, 3, 4], 1 + 2), ([0, 0, 3, 4], 2), ([1, 2, 0, 0], 1)):
        votes, _ = play(controller, genome, 0, seen)
        np.testing.assert_allclose(votes, [logistic(said), 3 * logistic(said)], atol=2e-6)
    votes, action = play(controller, genome, 0, [0, 0, 0, 0])
    assert votes.tolist() == [0.0, 0.0]
    assert action == 0


def test_a_combiner_hears_a_network_whose_first_output_alone_is_zero():
    """Silence is that all outputs are zero."""
    controller = combiner(1, captured_vote="skip")
    votes, _ = play(controller, filled_up(controller, [*HALVES, 0, 2], [*HALVES, 4, 6]), 0, [1, 1])
    assert votes.tolist() == [2.0, 3.0]


# -- the others, by hand -----------------------------------------------------------------------------------------------


def test_two_networks_for_each_opponent_have_two_votes_on_it():
    side = SideConfig(controller="double", n_hidden=1, output="linear")
    controller = made(side, 2, 1, 3)
    east = [[1000.0, 0, *2 * np.eye(3)[action]] for action in (0, 1, 2, 2)]  # 2 if the opponent is east, else 0
    for seen, expected in (([9, 0, -9, 0], [2, 0, 2]), ([-9, 0, 9, 0], [0, 2, 2]), ([9, 0, 9, 0], [2, 2, 4])):
        np.testing.assert_allclose(play(controller, filled_up(controller, *east), 0, seen)[0], expected, atol=1e-6)


def test_a_network_for_each_pair_weighs_two_opponents_together():
    side = SideConfig(controller="pairs", n_hidden=1, output="linear")
    controller = made(side, 3, 1, 3)
    sums = [[1.0, 0, 1.0, 0, *np.eye(3)[action]] for action in range(3)]
    votes, action = play(controller, filled_up(controller, *sums), 0, [1, 99, 2, 99, -4, 99])
    np.testing.assert_allclose(votes, [logistic(1 + 2), logistic(1 - 4), logistic(2 - 4)], atol=1e-6)
    assert action == 0


def test_the_central_network_has_output_weights_for_each_agent():
    side = SideConfig(controller="central", n_hidden=1, output="linear")
    controller = made(side, 1, 2, 3)
    genome = filled_up(controller, [0.25, 0, 0, -0.5, 2, 4, 6, 20, 60, 40])
    for agent, votes, action in ((0, [1, 2, 3], 2), (1, [10, 30, 20], 1)):  # 0.25 * 4 - 0.5 * 2 = 0
        shown, chosen = play(controller, genome, agent, [4, 9, 9, 2])
        assert shown.tolist() == votes
        assert chosen == action


def test_a_central_controller_is_silent_only_if_nobody_sees_anything():
    side = SideConfig(controller="central", n_hidden=1, output="linear", captured_vote="skip")
    controller = made(side, 1, 2, 2)
    genome = filled_up(controller, [0, 0, 0, 0, 2, 4, 6, 8])
    assert play(controller, genome, 0, [0, 0, 0, 1])[0].tolist() == [1, 2]
    assert play(controller, genome, 1, [1, 0, 0, 0])[0].tolist() == [3, 4]
    assert play(controller, genome, 1, [0, 0, 0, 0])[0].tolist() == [0, 0]


# -- any controller ----------------------------------------------------------------------------------------------------


def outputs(side: SideConfig, neurons: np.ndarray, inputs: np.ndarray, n_actions: int, agent: int = 0) -> np.ndarray:
    """One network's outputs in double precision: of the output weights those of an ``agent`` are used."""
    read = np.append(inputs, 1.0) if side.bias else inputs
    weights = neurons[:, len(read) :][:, agent * n_actions : (agent + 1) * n_actions]
    said = logistic(neurons[:, : len(read)] @ read) @ weights
    if side.output == "logistic":
        said = logistic(said)
    silent = side.captured_vote == "skip" and not inputs.any()
    return np.zeros(n_actions) if silent else said


def expected_votes(side: SideConfig, genomes: np.ndarray, views: np.ndarray, agent: int, n_actions: int) -> np.ndarray:
    """What an agent's controller makes of ``views (n_agents, n_opponents, 2)``, by the definition of each kind."""
    genomes, views = genomes.astype(float), views * np.float64(np.float32(side.input_scale))
    own, n_opponents = views[agent], views.shape[1]
    if side.controller == "central":
        return outputs(side, genomes[0, 0], views.ravel(), n_actions, agent)
    each = [[opponent] for opponent in range(n_opponents)]
    everybody = list(range(n_opponents))
    seen_by_network = {
        "split": each,
        "combiner": each,
        "double": each + each,
        "pairs": [list(pair) for pair in combinations(everybody, 2)] or [everybody],
        "monolithic": [everybody],
    }[side.controller]
    said = [
        outputs(side, genomes[agent, network], own[seen].ravel(), n_actions)
        for network, seen in enumerate(seen_by_network)
    ]
    if side.controller == "combiner":
        return outputs(side, genomes[agent, -1], np.concatenate(said), n_actions)
    return np.sum(said, axis=0)


SIDES = st.builds(
    SideConfig,
    controller=st.sampled_from(KINDS),
    n_hidden=st.integers(1, 12),
    bias=st.booleans(),
    output=st.sampled_from(["linear", "logistic"]),
    input_scale=st.sampled_from([1.0, 0.5, 0.02]),
    captured_vote=st.sampled_from(["zero", "skip"]),
)
TEAMS = {"n_opponents": st.integers(1, 4), "n_agents": st.integers(1, 3), "seed": st.integers(0, 1000)}
N_ACTIONS = 5


def random_teams(controller: Controller, n_opponents: int, n_agents: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """The genomes of ``LANES`` teams, all genes drawn, and their views ``(LANES, n_agents, n_opponents, 2)``."""
    generator = np.random.default_rng(seed)
    shape = (LANES, n_agents // controller.n_together, *controller.shape)
    genomes = generator.uniform(-6, 6, shape).astype(np.float32)
    views = generator.integers(-50, 50, (LANES, n_agents, n_opponents, 2)).astype(np.float32)
    views[::4, :, 0] = 0  # caught
    views[8::4] = 0
    return genomes, views


def shown(controller: Controller, views: np.ndarray, agent: int) -> np.ndarray:
    """What the forward pass is given, ``(..., n)``, of ``views (..., n_agents, n_opponents, 2)``."""
    seen = views if controller.n_together > 1 else views[..., agent : agent + 1, :, :]
    return seen.reshape(*views.shape[:-3], -1)


@pytest.mark.parametrize("kind", KINDS)
@given(side=SIDES, **TEAMS)
def test_every_agents_votes_agree_with_double_precision(
    kind: str, side: SideConfig, n_opponents: int, n_agents: int, seed: int
):
    side = side.replace(controller=kind)
    controller = made(side, n_opponents, n_agents, N_ACTIONS)
    for team, views in zip(*random_teams(controller, n_opponents, n_agents, seed), strict=True):
        for agent in range(n_agents):
            votes, action = play(controller, team, agent, shown(controller, views, agent))
            np.testing.assert_allclose(votes, expected_votes(side, team, views, agent, N_ACTIONS), atol=3e-4)
            assert action == votes.argmax()


@given(side=SIDES, **TEAMS)
def test_sixteen_teams_in_lanes_equal_one_at_a_time_bit_for_bit(
    side: SideConfig, n_opponents: int, n_agents: int, seed: int
):
    controller = made(side, n_opponents, n_agents, N_ACTIONS)
    genomes, views = random_teams(controller, n_opponents, n_agents, seed)
    for agent in range(n_agents):
        seen = shown(controller, views, agent)
        votes, actions = play(controller, genomes, agent, seen)
        alone = [play(controller, team, agent, view) for team, view in zip(genomes, seen, strict=True)]
        assert votes.tobytes() == np.array([votes for votes, _ in alone]).tobytes()
        assert actions.tolist() == [int(action) for _, action in alone]


@given(side=SIDES, **TEAMS)
def test_genes_that_a_network_does_not_use_do_not_matter(side: SideConfig, n_opponents: int, n_agents: int, seed: int):
    controller = made(side, n_opponents, n_agents, N_ACTIONS)
    genomes, views = random_teams(controller, n_opponents, n_agents, seed)
    used = np.arange(controller.n_genes) < np.array(controller.used_genes)[:, None, None]
    spoiled = np.where(used, genomes[0], np.nan).astype(np.float32)
    for agent in range(n_agents):
        seen = shown(controller, views[0], agent)
        votes, _ = play(controller, genomes[0], agent, seen)
        assert np.isfinite(votes).all()
        assert play(controller, spoiled, agent, seen)[0].tobytes() == votes.tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_every_gene_that_a_network_uses_matters_to_someone(kind: str):
    side = SideConfig(controller=kind, n_hidden=2, bias=True, output="linear", input_scale=0.02)
    controller = made(side, 3, 2, N_ACTIONS)
    genomes, views = random_teams(controller, 3, 2, 5)
    team, views = genomes[1] / 6, views[1]

    def all_votes(genes: np.ndarray) -> np.ndarray:
        return np.array([play(controller, genes, agent, shown(controller, views, agent))[0] for agent in range(2)])

    before = all_votes(team)
    for place in np.ndindex(team.shape):
        changed = team.copy()
        changed[place] += 0.5
        used = place[-1] < controller.used_genes[place[1]]
        assert np.array_equal(all_votes(changed), before) != used, place
