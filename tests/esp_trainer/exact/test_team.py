"""Optimal teams in the environment."""

from __future__ import annotations

import copy
from functools import cache
from typing import Any

import numpy as np
import pytest

from esp_trainer.exact.parity import by_parity
from esp_trainer.exact.solution import Solution, solve
from esp_trainer.exact.team import OptimalTeam
from predprey_env import predprey_v0, team_view, vector_env
from predprey_env.config import EnvConfig
from predprey_env.policies import Policy, ScriptedTeam

CONFIG = EnvConfig(size=6, n_prey=1, max_cycles=5)
TWO_PREY = EnvConfig(size=4, n_prey=2, max_cycles=4)
IN_TURNS = EnvConfig(size=4, n_predators=2, n_prey=2, max_cycles=6, move_order="prey_first")


@cache
def solved(config: EnvConfig) -> Solution:
    return solve(config, config.max_cycles)


def caught(config: EnvConfig, n_episodes: int, predators: Policy | None = None, prey: Policy | None = None) -> float:
    """Prey caught in an episode from random starts, by and of optimal teams where none is given."""
    teams = predators or OptimalTeam("predators", solved(config)), prey or OptimalTeam("prey", solved(config))
    env, total = predprey_v0.parallel_env(**config.model_dump()), 0
    for seed in range(n_episodes):
        observations, infos = env.reset(seed=seed)
        for team in teams:
            team.reset(seed)
        while env.agents:
            in_turn = {agent: view for agent, view in observations.items() if infos[agent]["in_turn"]}
            actions = {agent: action for team in teams for agent, action in team.act(in_turn).items()}
            observations, _, _, _, infos = env.step(actions)
        total += next(iter(infos.values()))["n_captured"]
    return total / n_episodes


def values(config: EnvConfig, n_episodes: int) -> np.ndarray:
    """Of the starts that these episodes have."""
    env, n, size, found = predprey_v0.parallel_env(**config.model_dump()), config.n_agents, config.size, []
    for seed in range(n_episodes):
        env.reset(seed=seed)
        found.append(env.state()[:n].astype(int) * size + env.state()[n : 2 * n].astype(int))
    return solved(config).value(np.array(found), config.max_cycles)


@pytest.mark.slow
@pytest.mark.parametrize(("config", "n"), [(CONFIG, 4000), (TWO_PREY, 2000), (IN_TURNS, 500)])
def test_two_optimal_teams_meet_the_value(config: EnvConfig, n: int) -> None:
    expected = values(config, n)
    # Of numbers between 0 and n_prey with these means no others vary more.
    deviation = np.sqrt((expected * (config.n_prey - expected)).sum()) / n
    assert abs(caught(config, n) - expected.mean()) <= 3 * deviation + 1e-9


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
@pytest.mark.parametrize("config", [CONFIG, TWO_PREY])
def test_nobody_does_better_against_an_optimal_team_than_the_value(config: EnvConfig) -> None:
    value = values(config, 500).mean()
    assert caught(config, 500, predators=Uniform("predator", 5)) < value - 0.3
    assert caught(config, 500, prey=Uniform("prey", 4)) > value + 0.05


def test_a_prey_with_a_predator_above_and_one_at_each_corner_below_draws_the_three_other_ways_alike() -> None:
    cells = np.array([0 * 6 + 1, 1 * 6 + 5, 5 * 6 + 5, 0], np.int32)
    _, columns = OptimalTeam("prey", solved(CONFIG)).strategies(cells, 5)
    assert columns == pytest.approx([1 / 3, 1 / 3, 0, 1 / 3])


@pytest.mark.parametrize("config", [CONFIG, TWO_PREY, IN_TURNS])
def test_both_sides_read_the_same_position_from_what_they_see(config: EnvConfig) -> None:
    env = predprey_v0.parallel_env(**config.model_dump())
    teams = OptimalTeam("predators", solved(config)), OptimalTeam("prey", solved(config))
    rng, compared = np.random.default_rng(0), 0
    for seed in range(30):
        observations, _ = env.reset(seed=seed)
        while env.agents:
            read = []
            for team, names in zip(teams, ("predator_", "prey_"), strict=True):
                own = [view for agent, view in observations.items() if agent.startswith(names)]
                read.append(team.position(dict(enumerate(own))))
            state, n, size = env.state().astype(int), config.n_agents, config.size
            free = np.flatnonzero(state[2 * n : -1]).tolist()
            rows = [*range(config.n_predators), *(config.n_predators + each for each in free)]
            for cells, prey in read if free else ():
                assert prey == free
                x, y = np.divmod(np.asarray(cells), size)
                apart = (x - state[:n][rows]) % size, (y - state[n : 2 * n][rows]) % size
                assert all(len(set(each.tolist())) <= 1 for each in apart)  # the same but for the torus moved
                compared += 1
            actions = {agent: int(rng.integers(4)) for agent in env.agents}
            observations, *_ = env.step(actions)
    assert compared > 200


def test_the_same_seed_plays_the_same() -> None:
    env = predprey_v0.parallel_env(**CONFIG.model_dump())
    observations, _ = env.reset(seed=0, options={"starts": np.array([[0, 1], [1, 5], [5, 5], [0, 0]])})
    played = []
    for seed in (7, 7, 8, 9, 10):
        teams = OptimalTeam("predators", solved(CONFIG)), OptimalTeam("prey", solved(CONFIG))
        for team in teams:
            team.reset(seed)
        played.append([team.act(observations) for team in teams for _ in range(3)])
    assert played[0] == played[1]
    assert any(played[0] != other for other in played[2:])


@pytest.mark.parametrize("config", [CONFIG, TWO_PREY, IN_TURNS])
@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_it_plays_the_other_side_of_a_team_view(config: EnvConfig, captured_prey: Any) -> None:
    solution, config = solved(config), config.replace(captured_prey=captured_prey)
    for team, opponent in (("predators", "prey"), ("prey", "predators")):
        env = team_view(team, opponent=OptimalTeam(opponent, solution), **config.model_dump())  # type: ignore[arg-type]
        for seed in range(5):
            observations, _ = env.reset(seed=seed)
            own = OptimalTeam(team, solution)  # type: ignore[arg-type]
            while env.agents:
                observations, *_ = env.step(own.act(observations))


@pytest.mark.parametrize("config", [CONFIG, TWO_PREY, IN_TURNS])
def test_it_plays_in_a_vector_env_as_in_team_views(config: EnvConfig) -> None:
    script = ScriptedTeam.of("greedy_chase", "predators", config)
    worlds = vector_env(4, "predators", OptimalTeam("prey", solved(config)), "Disabled", **config.model_dump())
    views = [
        team_view("predators", opponent=OptimalTeam("prey", solved(config)), **config.model_dump()) for _ in range(4)
    ]
    seen, _ = worlds.reset(seed=3)
    compared = 0
    single = [view.reset(seed=3 + world)[0] for world, view in enumerate(views)]
    for _ in range(config.max_cycles):
        rows = [view.get(f"predator_{i}") for view in single for i in range(config.n_predators)]
        n = config.n_predators
        actions = [
            action
            for world in range(4)
            for action in script.act({f"predator_{i}": seen[world * n + i] for i in range(n)}).values()
        ]
        for row, other in zip(seen, rows, strict=True):
            assert other is None or (row == other).all()
        compared += 1
        going = [bool(view.agents) for view in views]
        if not all(going):
            break
        seen, *_ = worlds.step(np.array(actions))
        single = [
            view.step({f"predator_{i}": actions[world * n + i] for i in range(n)})[0]
            for world, view in enumerate(views)
        ]
    assert compared > 2


def test_worlds_share_a_solution() -> None:
    team = OptimalTeam("prey", solved(CONFIG))
    other = copy.deepcopy(team)
    assert other.solution is team.solution
    assert other is not team


def test_in_turns_prey_know_what_predators_will_answer() -> None:
    """Predators west, north and south of a prey: it goes east, the only way on which it is not caught at once."""
    config = EnvConfig(size=6, n_prey=1, max_cycles=1, move_order="prey_first")
    team = OptimalTeam("prey", solved(config))
    views = {"prey_0": np.array([-1, 0, 0, 1, 0, -1], np.float32)}
    assert team.act(views) == {"prey_0": 0}
    hunters = OptimalTeam("predators", solved(config))
    for takes in (0, 1, 2, 3):  # one of them is beside it: it takes it, wherever the others are
        offset = [(1, 0), (-1, 0), (0, 1), (0, -1)][takes]
        seen = {f"predator_{i}": np.array(offset if i == 1 else (2, 2), np.float32) for i in range(3)}
        assert hunters.act(seen)["predator_1"] == takes


def test_what_it_cannot_play_is_refused() -> None:
    with pytest.raises(ValueError, match="the game must be solved for 9 steps, got 5"):
        OptimalTeam("prey", solved(CONFIG), n_steps=9)
    with pytest.raises(ValueError, match="optimal predators must be asked all 3 at once, got 1"):
        OptimalTeam("predators", solved(CONFIG)).act({"predator_0": np.zeros(2, np.float32)})


def test_two_optimal_teams_are_as_good_as_the_share_says() -> None:
    mean, _ = by_parity(solved(TWO_PREY), TWO_PREY.max_cycles)
    assert values(TWO_PREY, 400).mean() / 2 == pytest.approx(mean, abs=0.03)
