"""Two teams against each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.coevolution.sides import side_config, side_controller
from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.match import match
from esp_trainer.seeding import stream
from esp_trainer.types import Role, ScriptedTeams, TrialBatch
from predprey_env import EnvConfig

ENV = EnvConfig(size=8, max_cycles=25)
CHASE, FLEE = ScriptedTeams("greedy_chase"), ScriptedTeams("flee_nearest")


def random_team(role: Role, env: EnvConfig = ENV, seed: int = 0, **side: Any) -> Team:
    config = RunConfig(env=env, predators=SideConfig(**side), prey=SideConfig(**side))
    controller = side_controller(config, role)
    n_agents = env.n_predators if role == "predators" else env.n_prey
    genomes = np.random.default_rng(seed).uniform(-6, 6, (n_agents, *controller.shape)).astype(np.float32)
    return Team(role, side_config(config, role), controller, genomes)


def test_a_match_is_played_from_held_out_starts_of_its_seed():
    predators, prey = random_team("predators"), random_team("prey", seed=1)
    captures = match(predators, prey, ENV, 64, seed=5)
    evaluator = FusedEvaluator(ENV)
    starts = evaluator.starts.held_out(stream(5, "match"), 64)
    result = evaluator.evaluate(TrialBatch(predators.as_teams(64), prey.as_teams(64), starts))
    assert captures.episodes == 64
    assert captures.caught.rate == result.captured.mean()
    assert captures.predator_fitness == result.fitness[..., :3].mean()
    assert captures.prey_fitness == result.fitness[..., 3:].mean()
    assert captures.steps == result.steps.mean()


def test_a_match_follows_from_its_seed():
    teams = random_team("predators"), random_team("prey", seed=1)
    assert match(*teams, ENV, 64, seed=5) == match(*teams, ENV, 64, seed=5)
    assert match(*teams, ENV, 64, seed=5) != match(*teams, ENV, 64, seed=6)


def test_scripts_can_play_either_side():
    for predators, prey in ((CHASE, FLEE), (random_team("predators"), FLEE), (CHASE, random_team("prey"))):
        captures = match(predators, prey, ENV, 40)
        assert captures.episodes == 40
        assert captures.predator_fitness > 0


def test_moving_in_turns_a_greedy_chase_catches_far_more():
    """Design, section 3: the order of moves matters a lot to scripted results."""
    at_once = match(CHASE, FLEE, EnvConfig(n_prey=1), 400).caught
    in_turns = match(CHASE, FLEE, EnvConfig(n_prey=1, move_order="prey_first"), 400).caught
    assert in_turns.low > at_once.high


def test_captures_are_told_apart_by_parity():
    captures = match(random_team("predators"), random_team("prey", seed=1), ENV, 80)
    assert len(captures.caught_by_even) == 4
    assert all(rate is not None for rate in captures.caught_by_even)


def test_captures_on_an_odd_torus_are_counted_too():
    env = EnvConfig(size=7, max_cycles=25)
    captures = match(random_team("predators", env), random_team("prey", env), env, 40)
    assert captures.episodes == 40


@pytest.mark.parametrize(
    ("team", "role", "line"),
    [
        (random_team("prey"), "predators", "expected predators, got a team of prey"),
        (random_team("predators"), "prey", "expected prey, got a team of predators"),
        (
            random_team("predators", ENV.replace(n_predators=2)),
            "predators",
            "this world has 3 predators, got a team of 2",
        ),
        (random_team("prey", ENV.replace(n_prey=1)), "prey", "this world has 2 prey, got a team of 1"),
        (
            random_team("predators", ENV.replace(n_prey=1)),
            "predators",
            "this world has 2 prey, got predators evolved against 1",
        ),
        (
            random_team("prey", ENV.replace(n_predators=4), controller="monolithic"),
            "prey",
            "this world has 3 predators, got prey evolved against 4",
        ),
        (
            random_team("predators", ENV.replace(predator_idle=False)),
            "predators",
            "predators have 5 actions in this world, got a team with 4",
        ),
    ],
)
def test_a_team_that_does_not_fit_is_refused_with_one_line(team: Team, role: Role, line: str):
    with pytest.raises(ValueError, match=f"^{line}$"):
        team.check_fits(role, ENV)
    entered = (team, FLEE) if role == "predators" else (CHASE, team)
    with pytest.raises(ValueError, match=f"^{line}$"):
        match(*entered, ENV, 4)


@pytest.mark.parametrize("controller", ["split", "monolithic"])
def test_a_team_that_fits_passes(controller: str):
    random_team("predators", controller=controller).check_fits("predators", ENV)
    random_team("prey", controller=controller).check_fits("prey", ENV)
    random_team("prey", controller=controller).check_fits("prey", ENV.replace(size=50, max_cycles=9))
