"""Best responses beside a plain recursion, and what policies do in every state."""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any, TypeAlias

import numpy as np
import pytest

from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import EspConfig, RunConfig, SideConfig
from esp_trainer.esp.team import Team, gather_genomes
from esp_trainer.exact.chances import chances, survivors, views
from esp_trainer.exact.response import best_response, exploitability, exploitability_of
from esp_trainer.exact.solution import solve
from esp_trainer.types import ROLES, PolicyError, Role, ScriptedTeams
from predprey_env import predprey_v0
from predprey_env.config import EnvConfig
from predprey_env.policies import ScriptedTeam

Cells: TypeAlias = tuple[int, ...]
Free: TypeAlias = tuple[tuple[int, int], ...]
"""The prey that are free, and their cells."""

MEDIUM = EnvConfig(size=5, n_prey=1)


def team(role: Role, env: EnvConfig, **side: Any) -> Team:
    """A random evolved team."""
    settings = SideConfig(**{"n_hidden": 4, **side})
    config = RunConfig(env=env, predators=settings, prey=settings, esp=EspConfig(subpopulation_size=8, hof_mates=0))
    population = new_sides(config)[role].algorithm  # type: ignore[union-attr]
    teams = population.draw(np.random.default_rng(3), 1)
    return Team(role, settings, teams.controller, gather_genomes(teams, np.array([0]))[0])


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("n_prey", [1, 2])
def test_views_are_what_the_environment_shows(role: Role, n_prey: int) -> None:
    for size in (3, 4):
        config = EnvConfig(size=size, n_predators=2, n_prey=n_prey)
        env, seen = predprey_v0.parallel_env(**config.model_dump()), views(config, role)
        keys = survivors(config)[-1].keys
        for state, cells in zip(seen[keys], product(range(size * size), repeat=1 + n_prey), strict=True):
            if {0, *cells[2:]} & set(cells[:2]):
                continue
            starts = np.array([divmod(cell, size) for cell in (*cells[:2], 0, *cells[2:])])
            observations, _ = env.reset(seed=0, options={"starts": starts})
            own = [agent for agent in env.possible_agents if agent.startswith(role[:4])]
            assert state.tolist() == [observations[agent].tolist() for agent in own]


def test_caught_prey_are_seen_as_the_environment_shows_them() -> None:
    config = EnvConfig(size=4, n_predators=1)
    env = predprey_v0.parallel_env(**config.model_dump())
    env.reset(seed=0, options={"starts": np.array([[0, 0], [0, 2], [2, 1]])})
    observations, *_ = env.step({"predator_0": 2, "prey_0": 3, "prey_1": 0})  # both at (0, 1); the other at (3, 1)
    first, second, _ = survivors(config)
    assert (first.prey, second.prey) == ((0,), (1,))
    key = 1 * 4 + 0  # the predator is one to the east of the prey that is free
    for role, agents in (("predators", ["predator_0"]), ("prey", ["prey_0", "prey_1"])):
        shown = [observations[agent].tolist() for agent in agents]
        assert views(config, role)[second.keys][key].tolist() == shown  # type: ignore[arg-type]
    assert observations["predator_0"].tolist() == [0, 0, -1, 0]


WAYS = ((1, 0), (-1, 0), (0, 1), (0, -1), (0, 0))


class PlainResponse:
    """The same as :func:`best_response`, without any cleverness."""

    def __init__(self, fixed: np.ndarray, role: Role, config: EnvConfig) -> None:
        self.fixed, self.role, self.config = fixed, role, config
        self.in_turns = config.move_order == "prey_first"
        self.joints = list(product(range(config.n_predator_actions), repeat=config.n_predators))
        self.begins = {game.prey: game.keys.start for game in survivors(config)}
        self.value, self.chance = cache(self._value), cache(self._chance)

    def __call__(self, horizon: int) -> list[float]:
        """For the states in which all prey are free."""
        n, cells = self.config.n_predators, range(self.config.size**2)
        starts = product(cells, repeat=self.config.n_agents - 1)
        return [
            self.value(start[:n], ((0, 0), *enumerate(start[n:], 1)), horizon)
            for start in starts
            if not set(start[:n]) & {0, *start[n:]}
        ]

    def _value(self, predators: Cells, prey: Free, steps: int) -> float:
        if steps == 0 or not prey:
            return 0.0
        table: dict[Cells, dict[Cells, float]] = {}
        for flights in product(range(4), repeat=len(prey)):
            fled = tuple((who, self._go(cell, action)) for (who, cell), action in zip(prey, flights, strict=True))
            if self.in_turns:
                fled = _free_of(predators, fled)
            for joint in self.joints:
                hunters = tuple(map(self._go, predators, joint))
                left = _free_of(hunters, fled)
                worth = len(prey) - len(left) + self.value(hunters, left, steps - 1)
                if self.role == "prey":
                    table.setdefault(joint, {})[flights] = self.chance(predators, prey, flights) * worth
                else:
                    shown = fled if self.in_turns else prey
                    table.setdefault(flights, {})[joint] = self.chance(predators, shown, joint) * worth
        if self.role == "predators":
            return min(sum(row.values()) for row in table.values())
        if self.in_turns:  # the predators answer each flight
            return sum(max(row[flights] for row in table.values()) for flights in table[self.joints[0]])
        return max(sum(row.values()) for row in table.values())

    def _go(self, cell: int, action: int) -> int:
        (x, y), (east, north), size = divmod(cell, self.config.size), WAYS[action], self.config.size
        return (x + east) % size * size + (y + north) % size

    def _chance(self, predators: Cells, prey: Free, joint: Cells) -> float:
        """Of what the fixed side does where everybody is there."""
        if not prey:  # caught before the predators' turn: all the same
            return 1 / len(self.joints)
        size, (x, y) = self.config.size, divmod(prey[0][1], self.config.size)
        seen = [(c // size - x) % size * size + (c - y) % size for c in (*predators, *(c for _, c in prey[1:]))]
        key = self.begins[tuple(who for who, _ in prey)] + int(np.ravel_multi_index(seen, (size * size,) * len(seen)))
        agents = range(len(predators)) if self.role == "predators" else [who for who, _ in prey]
        return float(np.prod([self.fixed[key, agent, action] for agent, action in zip(agents, joint, strict=True)]))


def _free_of(predators: Cells, prey: Free) -> Free:
    return tuple((who, cell) for who, cell in prey if cell not in predators)


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("kind", ["drawn", "certain"])
@pytest.mark.parametrize("order", ["simultaneous", "prey_first"])
@pytest.mark.parametrize(("n_predators", "n_prey"), [(2, 1), (1, 2)])
def test_best_responses_are_those_of_a_plain_recursion(
    role: Role, kind: str, order: str, n_predators: int, n_prey: int
) -> None:
    config = EnvConfig(size=3, n_predators=n_predators, n_prey=n_prey, move_order=order)  # type: ignore[arg-type]
    n_agents, n_actions = config.team(role).n_agents, config.team(role).n_actions
    shape = (survivors(config)[-1].keys.stop, n_agents, n_actions)
    rng = np.random.default_rng(1)
    fixed = rng.dirichlet(np.ones(shape[2]), shape[:2])
    if kind == "certain":
        fixed = np.eye(shape[2])[rng.integers(shape[2], size=shape[:2])]
    found = best_response(fixed, role, config, 3)
    whole = solve(config, 1).states
    valid = whole.number[whole.first_key[-2] :] >= 0
    assert found[valid] == pytest.approx(PlainResponse(fixed, role, config)(3), abs=1e-12)


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
    with pytest.raises(PolicyError, match="run_straight has memory"):
        chances(ScriptedTeams("run_straight"), "prey", config)


def test_policies_are_asked_with_what_they_see() -> None:
    world = EnvConfig(size=3, n_prey=1, see_teammates=True, see_nearest_first=True)
    plain = EnvConfig(size=3, n_prey=1)
    for script in ("greedy_chase", "random"):
        same = (chances(ScriptedTeams(script), "predators", config) for config in (plain, world))
        assert np.array_equal(*same)
    assert views(world, "predators", world.sight).shape == (729, 3, 6)
    east_of_first = views(world, "predators", world.sight)[:, 0, 2] == 1  # predator_1, seen by predator_0
    assert east_of_first.mean() == pytest.approx(1 / 3)


def test_a_policy_that_sees_the_last_moves_cannot_be_solved_for() -> None:
    with pytest.raises(PolicyError, match=r"^a policy that observes the last moves cannot be solved for: "):
        chances(
            lambda observations: dict.fromkeys(observations, 0), "prey", EnvConfig(size=3, n_prey=1, see_moves=True)
        )


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
    with pytest.raises(PolicyError, match="the policy does not always do the same in a position"):
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

    with pytest.raises(PolicyError, match=says):
        chances(Odd(), "prey", EnvConfig(size=3, n_prey=1))


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (None, r"^the policy's act\(\) must return a mapping from agents to actions, got None$"),
        ({}, r"^the policy's act\(\) must return an action for each agent: an action for prey_0 is missing"),
        ({"prey_0": 0.5}, r"^the policy's act\(\) must return .*: the action of prey_0 must be an integer, got 0.5$"),
        ({"prey_0": 9}, r"^the policy's act\(\) must return .*: the action of prey_0 must be in 0..3, got 9$"),
    ],
)
def test_actions_that_are_none_are_refused(answer: Any, says: str) -> None:
    class Odd(Moody):
        def act(self, observations: dict[str, np.ndarray]) -> Any:
            return answer

    with pytest.raises(PolicyError, match=says):
        chances(Odd(), "prey", EnvConfig(size=3, n_prey=1))


def test_chances_of_many_positions_are_asked_for_at_once() -> None:
    class Batched(Moody):
        def chances_batch(self, observations: np.ndarray) -> np.ndarray:
            self.asked = [*getattr(self, "asked", []), len(observations)]
            return np.full((*observations.shape[:2], 4), 0.25)

    policy = Batched()
    assert (chances(policy, "prey", MEDIUM.replace(size=6)) == 0.25).all()
    assert policy.asked == [1024] * 45 + [6**6 - 45 * 1024, 500]


@pytest.mark.parametrize(
    ("method", "shape"),
    [("chances_batch", (1, 1, 4)), ("chances_batch", (729, 2, 4)), ("act_batch", (729,)), ("act_batch", (1, 1))],
)
def test_answers_about_many_positions_must_have_their_shape(method: str, shape: tuple[int, ...]) -> None:
    policy = Moody()
    setattr(policy, method, lambda _: np.full(shape, 0.25 if method == "chances_batch" else 0))
    answers = {
        "chances_batch": r"^the policy must answer with an array of shape \(729, 1, 4\), got array\(",
        "act_batch": r"^the policy's act_batch\(\) must return integers of shape \(729, 1\), got int64 of shape",
    }
    with pytest.raises(PolicyError, match=answers[method]):
        chances(policy, "prey", EnvConfig(size=3, n_prey=1))


def test_a_policy_that_does_not_draw_is_asked_what_it_does() -> None:
    class Certain(Moody):
        drawn = False

        def chances_batch(self, observations: np.ndarray) -> np.ndarray:
            raise AssertionError

        def act_batch(self, observations: np.ndarray) -> np.ndarray:
            self.asked += 1
            return np.full(observations.shape[:2], self.asked % 4)

    with pytest.raises(PolicyError, match="the policy does not always do the same in a position"):
        chances(Certain(), "prey", EnvConfig(size=3, n_prey=1))


def test_exploitability_of_a_policy_is_that_of_its_chances() -> None:
    config = EnvConfig(size=4, n_predators=2, n_prey=1, max_cycles=3)
    solution, team = solve(config, 3), ScriptedTeam("flee_nearest")
    asked = exploitability(chances(team, "prey", config), "prey", solution, 3)
    found = exploitability_of(team, "prey", solution)
    assert (found.optimal, found.exploited, found.horizon) == (asked.optimal, asked.exploited, 3)
