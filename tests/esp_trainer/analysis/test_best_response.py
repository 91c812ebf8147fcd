"""Fresh evolution against teams whose weakness is known."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.analysis.best_response import BestResponse, evolve_response
from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.history import History
from esp_trainer.coevolution.sides import side_controller
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import ROLES, EvolvedTeams, Role, ScriptedTeams
from predprey_env import EnvConfig

EAST, WEST, NORTH = 0, 1, 2
N = 6  # generations of fresh evolution
CONFIG = RunConfig(
    generations=2,
    env=EnvConfig(size=12, max_cycles=30, n_prey=1),
    predators=SideConfig(n_hidden=4),
    prey=SideConfig(n_hidden=4),
    esp=EspConfig(subpopulation_size=20, n_trials=60, n_episodes=4, hof_mates=2),
    champion=ChampionConfig(n_candidates=4, n_held_out=32),
)
each_role = pytest.mark.parametrize("role", ROLES)


def always(role: Role, action: int) -> np.ndarray:
    """A team whose agents do the same whatever they see: all weights are 0 but those to one action."""
    controller = side_controller(CONFIG, role)
    genomes = np.zeros((CONFIG.env.team(role).n_agents, *controller.shape), np.float32)
    genomes[..., controller.n_inputs + action] = 1
    return genomes


def run_of(predators: list[int], prey: list[int]) -> History:
    """A run whose champions did the same at every step, an action for each generation."""
    teams: dict[Role, list[int]] = {"predators": predators, "prey": prey}
    champions = {role: np.array([always(role, action) for action in actions]) for role, actions in teams.items()}
    return History(CONFIG, champions, {"caught": np.zeros(len(prey))})


TOGETHER = run_of([WEST, EAST], [NORTH, EAST])
"""In the last generation all run east, and nobody is ever caught."""
HEAD_ON = run_of([EAST, EAST], [EAST, WEST])
"""In the last generation prey in a predator's row run into it."""


@pytest.fixture(scope="module")
def evaluator() -> FusedEvaluator:
    return FusedEvaluator(CONFIG.env, threads=1)


def test_gain_is_what_the_side_that_evolved_wants_more_of():
    curve = np.zeros(1)
    assert BestResponse("predators", 9, before=0.25, after=0.75, curve=curve).gain == 0.5
    assert BestResponse("predators", 9, before=0.75, after=0.25, curve=curve).gain == -0.5
    assert BestResponse("prey", 9, before=0.75, after=0.25, curve=curve).gain == 0.5
    assert BestResponse("prey", 9, before=0.25, after=0.75, curve=curve).gain == -0.5


def test_predators_find_prey_that_only_run_east(evaluator: FusedEvaluator):
    found = evolve_response(TOGETHER, "predators", evaluator, n_generations=N, seed=1)
    assert (found.role, found.generation) == ("predators", 1)
    assert found.before == 0
    assert found.after > 0.3
    assert found.gain == found.after
    assert found.curve.shape == (N,)
    assert found.curve.max() > 0.2


def test_prey_find_predators_that_only_run_east(evaluator: FusedEvaluator):
    found = evolve_response(HEAD_ON, "prey", evaluator, n_generations=N, seed=1)
    assert found.before > 0.1  # by hand: each predator is in its row once in 12, and at an even distance half the time
    assert found.after < 0.02
    assert found.gain > 0.1


def test_which_generation_is_frozen_can_be_chosen(evaluator: FusedEvaluator):
    first = evolve_response(TOGETHER, "predators", evaluator, generation=0, n_generations=1, seed=1)
    assert first.generation == 0
    assert first.before > 0.1  # the predators of that generation run west, and its prey north
    last = evolve_response(TOGETHER, "predators", evaluator, generation=-1, n_generations=1, seed=1)
    assert last.generation == 1
    assert last.before == 0
    with pytest.raises(IndexError):
        evolve_response(TOGETHER, "predators", evaluator, generation=2)


@each_role
def test_the_best_of_the_fresh_champions_is_measured_again_on_other_starts(role: Role, evaluator: FusedEvaluator):
    found = evolve_response(HEAD_ON, role, evaluator, n_generations=N, seed=1)
    other: Role = "prey" if role == "predators" else "predators"
    frozen = HEAD_ON.team(other, 1)
    fresh = History.evolve(CONFIG.replace(seed=1, generations=N), evaluator, fixed={other: frozen})
    np.testing.assert_array_equal(found.curve, fresh.curves["caught"])
    best = found.curve.tolist().index(found.curve.max() if role == "predators" else found.curve.min())
    teams = {role: fresh.team(role, best).as_teams(1), other: frozen.as_teams(1)}
    met = cross_play(teams["predators"], teams["prey"], evaluator, n_episodes=1000, seed=1)
    assert found.after == met.caught[0, 0]


@each_role
def test_it_follows_from_its_seed(role: Role, evaluator: FusedEvaluator):
    runs = [evolve_response(HEAD_ON, role, evaluator, n_generations=2, seed=seed) for seed in (1, 1, 2)]
    numbers = [(found.before, found.after, found.curve.tobytes()) for found in runs]
    assert numbers[0] == numbers[1]
    assert numbers[0] != numbers[2]


@each_role
def test_the_frozen_team_never_changes(role: Role):
    history = run_of([WEST, EAST], [NORTH, EAST])
    other: Role = "prey" if role == "predators" else "predators"
    frozen = history.champions[other][1].copy()
    met: list[np.ndarray] = []

    class Spy(FusedEvaluator):
        def evaluate(self, batch):  # type: ignore[no-untyped-def]
            teams = getattr(batch, other)
            assert isinstance(teams, EvolvedTeams)
            met.append(teams.genomes[:, :, :, 0].copy())
            assert teams.genomes.shape[3] == 1
            return super().evaluate(batch)

    evolve_response(history, role, Spy(CONFIG.env, threads=1), n_generations=3, seed=1)
    assert len(met) > 6
    assert all((genomes == frozen).all() for genomes in met)
    np.testing.assert_array_equal(history.champions[other][1], frozen)


def test_it_is_followed_generation_by_generation(evaluator: FusedEvaluator):
    seen: list[int] = []
    evolve_response(TOGETHER, "predators", evaluator, n_generations=3, watch=lambda: seen.append(1))
    assert len(seen) == 3


def test_a_script_can_be_what_is_frozen(evaluator: FusedEvaluator):
    config = CONFIG.replace(prey=CONFIG.prey.replace(policy="run_straight"))
    champions: dict[Role, np.ndarray] = {"predators": np.array([always("predators", EAST)])}
    history = History(config, champions, {"caught": np.zeros(1)})
    found = evolve_response(history, "predators", evaluator, n_generations=N, seed=1)
    met = cross_play(
        history.team("predators", 0).as_teams(1), ScriptedTeams("run_straight"), evaluator, n_episodes=1000, seed=1
    )
    assert found.before == met.caught[0, 0]
    assert found.gain > 0.2
