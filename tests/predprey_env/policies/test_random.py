"""The script that chooses at random: reproducible, uniform, and independent between agents, steps and seeds."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from predprey_env.agents import PREFIXES
from predprey_env.config import TEAMS, EnvConfig, TeamName
from predprey_env.policies import ScriptedTeam
from predprey_env.policies.chance import next_state, pick
from predprey_env.policies.protocol import first_memory

VIEW = np.ones(4, np.float32)
N_STEPS = 10_000
# What a chi-square of so many degrees of freedom passes once in a thousand times.
BOUNDS = {3: 16.3, 4: 18.5, 15: 37.7, 24: 51.2}


def walk(team: TeamName, seed: int, n_steps: int, n_agents: int = 2, n_actions: int | None = None) -> np.ndarray:
    """What the agents of a team do, ``(n_steps, n_agents)``."""
    policy, views = ScriptedTeam("random", team, n_actions), {f"{PREFIXES[team]}{i}": VIEW for i in range(n_agents)}
    policy.reset(seed)
    return np.array([list(policy.act(views).values()) for _ in range(n_steps)])


def chi_square(numbers: np.ndarray, n: int) -> float:
    counts, expected = np.bincount(numbers, minlength=n), len(numbers) / n
    assert len(counts) == n
    return float(((counts - expected) ** 2 / expected).sum())


@pytest.mark.parametrize("team", TEAMS)
def test_a_walk_follows_from_the_seed(team: TeamName) -> None:
    assert walk(team, 3, 50).tolist() == walk(team, 3, 50).tolist()
    assert len({walk(team, seed, 50).tobytes() for seed in range(50)}) == 50


def test_agents_of_a_team_walk_differently() -> None:
    steps = walk("predators", 3, 50, n_agents=12)
    assert len({tuple(column) for column in steps.T.tolist()}) == 12


def test_a_walk_is_that_of_its_generator() -> None:
    steps = walk("predators", 77, 3)
    for agent in range(2):
        state = first_memory(77, False, agent, 0)
        for step in range(3):
            assert steps[step, agent] == pick(state, 5)
            state = next_state(state)


@pytest.mark.parametrize(("team", "n_actions"), [("predators", 5), ("predators", 4), ("prey", 4)])
def test_actions_are_equally_frequent(team: TeamName, n_actions: int) -> None:
    for seed in (1, 2):
        for actions in walk(team, seed, N_STEPS, n_actions=n_actions).T:
            assert chi_square(actions, n_actions) < BOUNDS[n_actions - 1]


@pytest.mark.parametrize(("team", "n"), [("predators", 5), ("prey", 4)])
def test_an_action_says_nothing_of_the_next(team: TeamName, n: int) -> None:
    for actions in walk(team, 1, N_STEPS).T:
        pairs = np.array([a * n + b for a, b in pairwise(actions.tolist())])
        assert chi_square(pairs, n * n) < BOUNDS[n * n - 1]


@pytest.mark.parametrize(("team", "n"), [("predators", 5), ("prey", 4)])
def test_an_agent_says_nothing_of_another(team: TeamName, n: int) -> None:
    steps = walk(team, 1, N_STEPS, n_agents=3)
    for first, second in ((0, 1), (0, 2), (1, 2)):
        assert chi_square(steps[:, first] * n + steps[:, second], n * n) < BOUNDS[n * n - 1]


def test_a_seed_says_nothing_of_the_next() -> None:
    """First actions of episodes whose seeds are counted up, as a vector environment's user counts worlds."""
    first = np.array([walk("prey", seed, 1)[0] for seed in range(4000)])
    assert chi_square(first[:, 0], 4) < BOUNDS[3]
    assert chi_square(first[:-1, 0] * 4 + first[1:, 0], 16) < BOUNDS[15]
    assert chi_square(first[:, 0] * 4 + first[:, 1], 16) < BOUNDS[15]


def test_what_it_sees_does_not_matter() -> None:
    policy, other = ScriptedTeam("random", "prey"), ScriptedTeam("random", "prey")
    policy.reset(5)
    other.reset(5)
    for step in range(20):
        view = np.full(6, step, np.float32)
        assert policy.act({"prey_0": view}) == other.act({"prey_0": VIEW})


def test_without_a_seed_no_two_episodes_are_alike() -> None:
    policy, walks = ScriptedTeam("random", "predators"), []
    for _ in range(2):
        policy.reset()
        walks.append([policy.act({"predator_0": VIEW})["predator_0"] for _ in range(60)])
    assert walks[0] != walks[1]


def test_an_agent_walks_alike_whoever_else_is_there() -> None:
    """Prey that leave when caught must not change what their team-mates do."""
    together, alone = ScriptedTeam("random", "prey"), ScriptedTeam("random", "prey")
    together.reset(9)
    alone.reset(9)
    for _ in range(20):
        both = together.act({"prey_0": VIEW, "prey_1": VIEW})
        assert alone.act({"prey_1": VIEW})["prey_1"] == both["prey_1"]


def test_predators_that_may_not_idle_never_do() -> None:
    n_actions = EnvConfig(predator_idle=False).n_predator_actions
    assert set(walk("predators", 0, 500, n_actions=n_actions).ravel().tolist()) == {0, 1, 2, 3}


def test_the_two_teams_of_an_episode_walk_apart() -> None:
    """They are reset with the same seed, and their agents have the same numbers."""
    seen = np.array([3, 4], np.float32)
    table = np.zeros((4, 4), int)
    for seed in range(400):
        teams = [ScriptedTeam("random", team, 4) for team in TEAMS]
        for team in teams:
            team.reset(seed)
        for _ in range(5):
            both = [team.act({f"{PREFIXES[team.team]}0": seen})[f"{PREFIXES[team.team]}0"] for team in teams]
            table[both[0], both[1]] += 1
    expected = table.sum() / 16
    assert ((table - expected) ** 2 / expected).sum() < 40  # chi-square, 15 degrees of freedom: 1 in 2,000
