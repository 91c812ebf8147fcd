"""A candidate against an opponent: alike in compiled code and outside, and told what it does wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from esp_trainer import load_team
from esp_trainer.benchmark.match import Arena, Meeting
from esp_trainer.tasks import WORLDS
from esp_trainer.teams.zoo import known_teams
from esp_trainer.types import ROLES, PolicyError, Role, ScriptedTeams
from predprey_env import EnvConfig
from predprey_env.agents import other_team
from predprey_env.policies import SCRIPTS, Policy, ScriptedTeam

SMALL = EnvConfig(size=8, max_cycles=25)
CHASE = ScriptedTeams("greedy_chase")


class ByHand:
    """A policy that nothing is known of but its two methods."""

    def __init__(self, policy: Policy) -> None:
        self.reset, self.act = policy.reset, policy.act


class Told:
    """Does what a function says, for all worlds at once or for one."""

    def __init__(self, choose: Callable[[np.ndarray], Any]) -> None:
        self._choose = choose

    def reset(self, seed: int | None = None) -> None:
        pass

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, Any]:
        return dict(zip(observations, self._choose(np.stack(list(observations.values()))), strict=True))


class AllAtOnce(Told):
    def act_batch(self, observations: np.ndarray) -> np.ndarray:
        return np.asarray(self._choose(observations))


def east(rows: np.ndarray) -> np.ndarray:
    return np.zeros(len(rows), int)


def evolved(task: str, role: Role) -> Any:
    """A team of the zoo that takes the action with the most votes."""
    names = [name for name, team in known_teams().items() if (team.task, team.role) == (task, role)]
    return next(team for team in map(load_team, names) if not team.controller.draws)


def assert_same(one: Meeting, other: Meeting) -> None:
    for name in ("captured", "fitness", "steps"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("task", WORLDS)
def test_an_evolved_candidate_plays_outside_as_it_does_in_compiled_code(task: str, role: Role):
    arena, mine = Arena(WORLDS[task], 12, seed=4), evolved(task, role)
    scripts = [ScriptedTeams(script) for script in SCRIPTS[other_team(role)] if script != "random"]
    for opponent in (evolved(task, other_team(role)), *scripts):
        compiled = arena.meet(mine, role, opponent)
        assert_same(compiled, arena.meet(ByHand(mine), role, opponent))
        assert compiled.captured.max() <= WORLDS[task].n_prey


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("env", [SMALL, SMALL.replace(move_order="prey_first")], ids=["at once", "in turns"])
def test_a_scripted_candidate_plays_outside_as_it_does_in_compiled_code(env: EnvConfig, role: Role):
    """In a small world, where nearly all is caught, so that worlds end at other times."""
    arena, ends = Arena(env, 40, seed=1), set()
    for mine in SCRIPTS[role]:
        for theirs in SCRIPTS[other_team(role)]:
            if "random" not in (mine, theirs):
                compiled = arena.meet(ScriptedTeams(mine), role, ScriptedTeams(theirs))
                outside = arena.meet(ByHand(ScriptedTeam.of(mine, role, env)), role, ScriptedTeams(theirs))
                assert_same(compiled, outside)
                ends |= set(compiled.steps.tolist())
    assert len(ends) > 5


@pytest.mark.parametrize("role", ROLES)
def test_all_worlds_in_one_call_are_as_one_by_one(role: Role):
    arena, opponent = Arena(SMALL, 40, seed=2), ScriptedTeams(SCRIPTS[other_team(role)][1])

    def towards(seen: np.ndarray) -> np.ndarray:
        return (np.abs(seen).sum(axis=-1).astype(int) % 4).astype(np.int64)

    assert_same(arena.meet(Told(towards), role, opponent), arena.meet(AllAtOnce(towards), role, opponent))


def test_fitness_is_what_the_paper_pays():
    """Of a prey that runs east for ever: 25 if it is not caught, else 12.5 times its share of the time (section V)."""
    meeting = Arena(EnvConfig(n_prey=1), 16, seed=0).meet(Told(east), "prey", CHASE)
    caught = meeting.captured == 1
    assert (meeting.fitness[~caught] == 25).all()
    assert (meeting.steps[~caught] == 150).all()
    expected = 12.5 * meeting.steps[caught] / 150
    np.testing.assert_allclose(meeting.fitness[caught], expected)


def test_a_seed_decides_the_starts():
    meetings = [
        Arena(SMALL, 40, seed).meet(ScriptedTeams("intercept"), "predators", ScriptedTeams("flee_nearest"))
        for seed in (5, 5, 6)
    ]
    assert_same(meetings[0], meetings[1])
    assert meetings[0].steps.tolist() != meetings[2].steps.tolist()


@pytest.mark.parametrize("opponent", ["random", "run_straight"])
def test_what_is_random_follows_from_the_seed(opponent: str):
    class Random:
        def reset(self, seed: int | None = None) -> None:
            self._generator = np.random.default_rng(seed)

        def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
            return {agent: int(self._generator.integers(5)) for agent in observations}

    one, again, other = (
        Arena(SMALL, 24, seed).meet(Random(), "predators", ScriptedTeams(opponent)) for seed in (1, 1, 2)
    )
    assert_same(one, again)
    assert one.fitness.tolist() != other.fitness.tolist()


def test_each_world_has_a_policy_of_its_own():
    """Or one that counts its steps would count those of others too."""

    class Counts:
        def reset(self, seed: int | None = None) -> None:
            self.steps = 0

        def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
            self.steps += 1
            assert self.steps <= SMALL.max_cycles, "steps of other worlds are counted too"
            return dict.fromkeys(observations, 0)

    meeting = Arena(SMALL, 24, seed=0).meet(Counts(), "prey", CHASE)
    assert meeting.steps.max() <= SMALL.max_cycles


def raising(*_: Any) -> Any:
    raise KeyError("lost")


class FailsToStart(Told):
    def reset(self, seed: int | None = None) -> None:
        raise OSError("no such\nmodel")


ERRORS: dict[str, tuple[Any, str]] = {
    "raises": (Told(raising), "the policy's act() raised KeyError: 'lost'"),
    "raises for all": (AllAtOnce(raising), "the policy's act_batch() raised KeyError: 'lost'"),
    "not a number": (
        Told(lambda rows: [float("nan")] * len(rows)),
        "the policy's act() must return an action for each agent: the action of predator_0 must be an integer, got nan",
    ),
    "too high": (
        Told(lambda rows: [5] * len(rows)),
        "the policy's act() must return an action for each agent: the action of predator_0 must be in 0..4, got 5",
    ),
    "too high for all": (
        AllAtOnce(lambda seen: np.full(seen.shape[:2], 7)),
        "the policy's act_batch() must return actions in 0..4, got 7 to 7",
    ),
    "not numbers for all": (
        AllAtOnce(lambda seen: np.full(seen.shape[:2], np.nan)),
        "the policy's act_batch() must return integers of shape (8, 3), got float64 of shape (8, 3)",
    ),
    "another shape": (
        AllAtOnce(lambda seen: np.zeros(len(seen), int)),
        "the policy's act_batch() must return integers of shape (8, 3), got int64 of shape (8,)",
    ),
    "cannot start": (FailsToStart(raising), "the policy's reset() raised OSError: no such model"),
}


@pytest.mark.parametrize("error", ERRORS)
def test_what_a_candidate_does_wrong_is_told_in_one_line(error: str):
    policy, line = ERRORS[error]
    with pytest.raises(PolicyError) as refused:
        Arena(SMALL, 8, seed=0).meet(policy, "predators", ScriptedTeams("run_straight"))
    assert str(refused.value) == line


def test_an_agent_that_is_forgotten_is_told():
    class Forgets(Told):
        def act(self, observations: dict[str, np.ndarray]) -> dict[str, Any]:
            return {"predator_0": 0}

    with pytest.raises(PolicyError, match=r"^the policy's act\(\) must .*: an action for predator_1 is missing"):
        Arena(SMALL, 8, seed=0).meet(Forgets(raising), "predators", ScriptedTeams("run_straight"))


def test_a_policy_that_counts_does_as_one_that_counts_for_all_worlds():
    """They step together, so that one count serves all worlds that still play."""

    class Turns:
        def reset(self, seed: int | None = None) -> None:
            self.steps = 0

        def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
            self.steps += 1
            return dict.fromkeys(observations, self.steps // 3 % 4)

    class TurnsAtOnce(Turns):
        def act_batch(self, observations: np.ndarray) -> np.ndarray:
            self.steps += 1
            return np.full(observations.shape[:2], self.steps // 3 % 4)

    arena = Arena(SMALL, 24, seed=0)
    one, other = (arena.meet(policy, "prey", CHASE) for policy in (Turns(), TurnsAtOnce()))
    assert_same(one, other)
    assert len(set(one.steps.tolist())) > 3


def test_a_world_that_is_over_is_asked_no_more_and_counts_once():
    asked: list[int] = []

    class Noting(Told):
        def act(self, observations: dict[str, np.ndarray]) -> dict[str, Any]:
            asked.append(1)
            return super().act(observations)

        def __deepcopy__(self, _: Any) -> Noting:
            return Noting(east)

    meeting = Arena(SMALL.replace(n_prey=1), 24, seed=0).meet(Noting(east), "prey", CHASE)
    assert meeting.steps.min() < SMALL.max_cycles
    assert len(asked) == meeting.steps.sum()


@pytest.mark.parametrize("answer", [None, 3, [0, 0, 0]])
def test_an_answer_that_is_no_mapping_is_told(answer: Any):
    class Answers(Told):
        def act(self, observations: dict[str, np.ndarray]) -> Any:
            return answer

    with pytest.raises(PolicyError, match=r"^the policy's act\(\) must return a mapping .*, got .+$"):
        Arena(SMALL, 8, seed=0).meet(Answers(east), "predators", ScriptedTeams("run_straight"))


def test_a_policy_that_cannot_be_copied_is_told_in_one_line():
    """Each world gets a copy; one that holds a lock, a file or a connection has none."""

    class Holds(Told):
        def __deepcopy__(self, _: Any) -> Holds:
            raise TypeError("cannot pickle\na lock")

    with pytest.raises(PolicyError) as refused:
        Arena(SMALL, 8, seed=0).meet(Holds(east), "predators", ScriptedTeams("run_straight"))
    assert str(refused.value).startswith("the policy")
    assert "cannot pickle a lock" in str(refused.value)


@pytest.mark.parametrize("kind", [Told, AllAtOnce])
def test_a_policy_that_ends_the_process_is_told(kind: type[Told]):
    """Else the benchmark is over without a table, and with the exit code that the policy chose."""

    def leave(_: np.ndarray) -> Any:
        raise SystemExit(0)

    with pytest.raises(PolicyError, match=r"^the policy's act(_batch)?\(\) raised SystemExit"):
        Arena(SMALL, 8, seed=0).meet(kind(leave), "predators", ScriptedTeams("run_straight"))


def test_each_world_is_reset_once_with_a_seed_of_its_own_that_follows_from_that_of_all():
    seeds: dict[int, list[int | None]] = {1: [], 2: []}

    class Noting(Told):
        noted: list[int | None]

        def reset(self, seed: int | None = None) -> None:
            Noting.noted.append(seed)

    for seed, Noting.noted in seeds.items():
        Arena(SMALL, 24, seed).meet(Noting(east), "prey", CHASE)
    assert [len(set(noted)) for noted in seeds.values()] == [len(noted) for noted in seeds.values()] == [24, 24]
    assert not set(seeds[1]) & set(seeds[2])


def test_an_opponent_may_be_the_name_of_a_script():
    arena = Arena(EnvConfig(size=8, n_prey=1, max_cycles=20), 8, seed=0)
    by_name, itself = (
        arena.meet(ScriptedTeams("surround"), "predators", prey) for prey in ("random", ScriptedTeams("random"))
    )
    assert by_name.steps.tolist() == itself.steps.tolist()
    with pytest.raises(ValueError, match=r"script must be one of random, .* got 'greedy_chase'"):
        arena.meet(ScriptedTeams("surround"), "predators", "greedy_chase")


@pytest.mark.parametrize("role", ROLES)
def test_two_policies_of_ones_own_meet_as_the_teams_that_they_are(role: Role) -> None:
    """Whichever of the two is compiled, and whichever is only a policy."""
    arena = Arena(SMALL, 20, seed=3)
    candidate, opponent = ScriptedTeams("surround"), ScriptedTeams("flee_centroid")
    if role == "prey":
        candidate, opponent = opponent, candidate
    policies = candidate.policy(role, SMALL), opponent.policy(other_team(role), SMALL)
    expected = arena.meet(candidate, role, opponent)
    assert 0 < expected.captured.mean() < SMALL.n_prey
    for one, other in ((ByHand(policies[0]), ByHand(policies[1])), (candidate, ByHand(policies[1]))):
        found = arena.meet(one, role, other)
        for part in ("captured", "fitness", "steps"):
            assert getattr(found, part).tolist() == getattr(expected, part).tolist()


def test_what_an_opponent_of_ones_own_does_wrong_is_told_in_one_line() -> None:
    with pytest.raises(PolicyError, match=r"^the opponent's act\(\) must .* be in 0..3, got 7$") as told:
        Arena(SMALL, 2, seed=3).meet(Told(east), "predators", Told(lambda rows: np.full(len(rows), 7)))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("candidate", "role", "opponent", "says"),
    [
        (CHASE, "predator", "flee_nearest", r"^role must be predators or prey, got 'predator'$"),
        (Told, "predators", "flee_nearest", r"^candidate must be an object, got the class Told: give Told\(\.\.\.\)$"),
        (
            ByHand(ScriptedTeam("flee_nearest", "prey")),
            "prey",
            Told,
            r"^opponent must be an object, got the class Told",
        ),
        (evolved("pond", "prey"), "predators", "flee_nearest", r"^expected predators, got a team of prey$"),
    ],
)
def test_who_cannot_play_is_refused_in_one_line(candidate: Any, role: Any, opponent: Any, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        Arena(SMALL, 2, 0).meet(candidate, role, opponent)


def test_an_arena_needs_a_world_and_episodes() -> None:
    with pytest.raises(TypeError, match=r"^env must be an EnvConfig, got 'pond'$"):
        Arena("pond", 2, 0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^n_episodes must be at least 1, got -2$"):
        Arena(SMALL, -2, 0)
