"""Best responses beside a plain recursion, and what policies do in every state."""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import EspConfig, RunConfig, SideConfig
from esp_trainer.esp.team import Team, pick
from esp_trainer.exact.chances import chances, views
from esp_trainer.exact.response import best_response, exploitability
from esp_trainer.exact.solution import solve
from esp_trainer.exact.states import moves_of
from esp_trainer.types import ROLES, Role, ScriptedTeams
from predprey_env import predprey_v0
from predprey_env.config import EnvConfig
from predprey_env.policies import ScriptedTeam

SMALL = EnvConfig(size=3, n_predators=2, n_prey=1)
MEDIUM = EnvConfig(size=5, n_prey=1)


def team(role: Role, env: EnvConfig, **side: Any) -> Team:
    """A random evolved team."""
    settings = SideConfig(**{"n_hidden": 4, **side})
    config = RunConfig(env=env, predators=settings, prey=settings, esp=EspConfig(subpopulation_size=8, hof_mates=0))
    population = new_sides(config)[role].subpopulations  # type: ignore[union-attr]
    teams = population.draw(np.random.default_rng(3), 1)
    return Team(role, settings, teams.controller, pick(teams, np.array([0]))[0])


@pytest.mark.parametrize("role", ROLES)
def test_views_are_what_the_environment_shows(role: Role) -> None:
    for size in (3, 4):
        config = EnvConfig(size=size, n_predators=2, n_prey=1)
        env, seen = predprey_v0.parallel_env(**config.model_dump()), views(config, role)
        for key, cells in enumerate(product(range(size * size), repeat=2)):
            if 0 in cells:
                continue
            starts = np.array([*(divmod(cell, size) for cell in cells), (0, 0)])
            observations, _ = env.reset(seed=0, options={"starts": starts})
            own = [agent for agent in env.possible_agents if agent.startswith(role[:4])]
            for row, agent in enumerate(own):
                assert seen[key, row].tolist() == observations[agent].tolist()


def plain_response(fixed: np.ndarray, role: Role, config: EnvConfig, horizon: int) -> np.ndarray:
    """The same as :func:`best_response`, without any cleverness."""
    moves, n_cells, n = moves_of(config), config.size**2, config.n_predators
    joints = list(product(range(config.n_predator_actions), repeat=n))

    @cache
    def value(cells: tuple[int, ...], steps: int) -> float:
        if 0 in cells:
            return 1.0
        if steps == 0:
            return 0.0
        key = int(np.ravel_multi_index(cells, (n_cells,) * n))
        payoffs = np.zeros((len(joints), 4))
        for (row, joint), b in product(enumerate(joints), range(4)):
            arrows = list(zip(cells, joint, strict=True))
            caught = any(moves.caught[cell, action, b] for cell, action in arrows)
            after = tuple(int(moves.cell[cell, action, b]) for cell, action in arrows)
            payoffs[row, b] = 1.0 if caught else value(after, steps - 1)
        if role == "prey":
            return float((payoffs @ fixed[key, 0]).max())
        weights = [np.prod([fixed[key, i, action] for i, action in enumerate(joint)]) for joint in joints]
        return float((np.array(weights) @ payoffs).min())

    return np.array([value(cells, horizon) for cells in product(range(n_cells), repeat=n)])


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("kind", ["drawn", "certain"])
def test_best_responses_are_those_of_a_plain_recursion(role: Role, kind: str) -> None:
    shape = (3**4, *{"predators": (2, 5), "prey": (1, 4)}[role])
    rng = np.random.default_rng(1)
    fixed = rng.dirichlet(np.ones(shape[2]), shape[:2])
    if kind == "certain":
        fixed = np.eye(shape[2])[rng.integers(shape[2], size=shape[:2])]
    found = best_response(fixed, role, SMALL, 3)
    assert found == pytest.approx(plain_response(fixed, role, SMALL, 3), abs=1e-12)


@pytest.mark.parametrize("role", ROLES)
def test_nobody_who_is_answered_optimally_does_better_than_optimal_play(role: Role) -> None:
    solution = solve(MEDIUM, 4)
    for policy in (team(role, MEDIUM), ScriptedTeams("random")):
        found = exploitability(chances(policy, role, MEDIUM), role, solution, 4)
        assert found.loss > 0.03
        worse = [
            exploited - optimal if role == "prey" else optimal - exploited
            for optimal, exploited in zip(found.optimal_by_even, found.exploited_by_even, strict=True)
        ]
        assert min(worse) > 0


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("controller", ["split", "monolithic", "central"])
def test_an_evolved_teams_chances_are_what_it_does(role: Role, controller: str) -> None:
    if controller == "central" and role == "prey":
        pytest.skip("one prey is all of its team")
    policy = team(role, MEDIUM, controller=controller)

    class Slow:
        """Asked state by state."""

        reset, act = staticmethod(policy.reset), staticmethod(policy.act)

    small = EnvConfig(size=3, n_prey=1)
    assert (chances(policy, role, small) == chances(Slow(), role, small)).all()


@pytest.mark.parametrize("role", ROLES)
def test_a_team_that_draws_has_the_chances_that_it_draws_with(role: Role) -> None:
    policy = team(role, MEDIUM, choice="drawn", output="linear", input_scale=0.1)
    found, seen, key = chances(policy, role, MEDIUM), views(MEDIUM, role), 7_777
    assert found.sum(axis=2) == pytest.approx(np.ones(found.shape[:2]), abs=1e-6)
    counts = np.zeros(found.shape[2])
    name = {"predators": "predator_0", "prey": "prey_0"}[role]
    for seed in range(4000):
        policy.reset(seed)
        counts[policy.act({name: seen[key, 0]})[name]] += 1
    assert counts / 4000 == pytest.approx(found[key, 0], abs=0.04)


def test_scripts_do_in_every_state_what_they_do_in_the_environment() -> None:
    config = EnvConfig(size=3, n_prey=1)
    found = chances(ScriptedTeams("greedy_chase"), "predators", config)
    seen, script = views(config, "predators"), ScriptedTeam.of("greedy_chase", "predators", config)
    for key in range(0, len(seen), 37):
        actions = script.act({f"predator_{i}": seen[key, i] for i in range(3)})
        assert found[key].argmax(axis=1).tolist() == list(actions.values())
    assert (chances(ScriptedTeams("random"), "prey", config) == 0.25).all()
    with pytest.raises(ValueError, match="run_straight remembers"):
        chances(ScriptedTeams("run_straight"), "prey", config)


class Moody:
    """Does something else each time."""

    def reset(self, seed: int | None = None) -> None:
        self.asked = getattr(self, "asked", 0)

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        self.asked += 1
        return dict.fromkeys(observations, self.asked % 4)


class Frank(Moody):
    """And says so."""

    def chances(self, observations: dict[str, np.ndarray]) -> dict[str, list[float]]:
        return dict.fromkeys(observations, [0.25] * 4)


def test_a_policy_that_is_not_of_one_mind_must_say_its_chances() -> None:
    config = EnvConfig(size=3, n_prey=1)
    with pytest.raises(ValueError, match="the policy does not always do the same in a position"):
        chances(Moody(), "prey", config)
    assert (chances(Frank(), "prey", config) == 0.25).all()


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        ([0.5, 0.5], "chances must be 4 numbers for each agent"),
        ([2, -1, 0, 0], "chances must be at least 0 and add up to 1"),
        ([1, 1, 1, 1], "chances must be at least 0 and add up to 1"),
        ([float("nan")] * 4, "chances must be at least 0 and add up to 1"),
        ("east", "chances must be 4 numbers for each agent, got"),
    ],
)
def test_chances_that_are_none_are_refused(answer: Any, says: str) -> None:
    class Odd(Moody):
        def chances(self, observations: dict[str, np.ndarray]) -> dict[str, Any]:
            return dict.fromkeys(observations, answer)

    with pytest.raises(ValueError, match=says):
        chances(Odd(), "prey", EnvConfig(size=3, n_prey=1))


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (None, "the policy must answer for prey_0, got None"),
        ({}, "the policy must answer for prey_0, got {}"),
        ({"prey_0": 0.5}, "actions must be whole numbers, got"),
        ({"prey_0": 9}, r"actions must lie in \[0, 4\), got 9 to 9"),
    ],
)
def test_actions_that_are_none_are_refused(answer: Any, says: str) -> None:
    class Odd(Moody):
        def act(self, observations: dict[str, np.ndarray]) -> Any:
            return answer

    with pytest.raises(ValueError, match=says):
        chances(Odd(), "prey", EnvConfig(size=3, n_prey=1))
