"""Optimal teams in the environment."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.exact.solution import Solution, by_parity, solve
from esp_trainer.exact.team import OptimalTeam
from predprey_env import predprey_v0, team_view
from predprey_env.config import EnvConfig

CONFIG = EnvConfig(size=6, n_prey=1, max_cycles=5)


@pytest.fixture(scope="module")
def solution() -> Solution:
    return solve(CONFIG, CONFIG.max_cycles)


def caught(solution: Solution, n_episodes: int, predators: object | None = None, prey: object | None = None) -> float:
    """Share of episodes from random starts in which the prey is caught, optimal teams where none is given."""
    hunters, hunted = predators or OptimalTeam("predators", solution), prey or OptimalTeam("prey", solution)
    env = predprey_v0.parallel_env(**CONFIG.model_dump())
    total = 0
    for seed in range(n_episodes):
        observations, _ = env.reset(seed=seed)
        for team in (hunters, hunted):
            team.reset(seed)  # type: ignore[attr-defined]
        terminations: dict[str, bool] = {}
        while env.agents:
            actions = {**hunters.act(observations), **hunted.act(observations)}  # type: ignore[attr-defined]
            observations, _, terminations, _, _ = env.step(actions)
        total += terminations["prey_0"]
    return total / n_episodes


@pytest.mark.slow
def test_two_optimal_teams_meet_the_value(solution: Solution) -> None:
    n, env, prey = 4000, predprey_v0.parallel_env(**CONFIG.model_dump()), OptimalTeam("prey", solution)
    starts = [prey.cells({"prey_0": env.reset(seed=seed)[0]["prey_0"]}) for seed in range(n)]
    values = solution.value(np.array(starts), CONFIG.max_cycles)
    deviation = float(np.sqrt((values * (1 - values)).sum())) / n
    assert abs(caught(solution, n) - values.mean()) < 3 * deviation


class Uniform:
    """Draws every action alike."""

    def __init__(self, team: str, n_actions: int) -> None:
        self.team, self.n_actions = team, n_actions

    def reset(self, seed: int | None = None) -> None:
        self.generator = np.random.default_rng(seed)

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        agents = [agent for agent in observations if agent.startswith(self.team)]
        return {agent: int(self.generator.integers(self.n_actions)) for agent in agents}


@pytest.mark.slow
def test_nobody_does_better_against_an_optimal_team_than_the_value(solution: Solution) -> None:
    value = by_parity(solution, CONFIG.max_cycles)[0]
    assert caught(solution, 500, predators=Uniform("predator", 5)) < value - 0.3
    assert caught(solution, 500, prey=Uniform("prey", 4)) > value + 0.05


def test_a_prey_with_a_predator_above_and_one_at_each_corner_below_draws_the_three_other_ways_alike(
    solution: Solution,
) -> None:
    cells = np.array([0 * 6 + 1, 1 * 6 + 5, 5 * 6 + 5], np.int32)
    _, columns = OptimalTeam("prey", solution).strategies(cells, 5)
    assert columns == pytest.approx([1 / 3, 1 / 3, 0, 1 / 3])


def test_the_same_seed_plays_the_same(solution: Solution) -> None:
    env = predprey_v0.parallel_env(**CONFIG.model_dump())
    observations, _ = env.reset(seed=0, options={"starts": np.array([[0, 1], [1, 5], [5, 5], [0, 0]])})
    played = []
    for seed in (7, 7, 8, 9, 10):
        teams = OptimalTeam("predators", solution), OptimalTeam("prey", solution)
        for team in teams:
            team.reset(seed)
        played.append([team.act(observations) for team in teams for _ in range(3)])
    assert played[0] == played[1]
    assert any(played[0] != other for other in played[2:])


def test_it_plays_the_other_side_of_a_team_view(solution: Solution) -> None:
    env = team_view("predators", opponent=OptimalTeam("prey", solution), **CONFIG.model_dump())
    observations, _ = env.reset(seed=0)
    while env.agents:
        observations, *_ = env.step(OptimalTeam("predators", solution).act(observations))


def test_what_it_cannot_play_is_refused(solution: Solution) -> None:
    with pytest.raises(ValueError, match="the game must be solved for 9 steps, got 5"):
        OptimalTeam("prey", solution, n_steps=9)
    with pytest.raises(ValueError, match="optimal predators must be asked all 3 at once, got 1"):
        OptimalTeam("predators", solution).act({"predator_0": np.zeros(2, np.float32)})
    turns = solve(CONFIG.replace(move_order="prey_first"), 5)
    with pytest.raises(ValueError, match="optimal teams play games of simultaneous moves, got prey_first"):
        OptimalTeam("prey", turns)
