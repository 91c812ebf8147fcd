"""The scripts of predators, by hand."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

from predprey_env.policies import ScriptedTeam

EAST, WEST, NORTH, SOUTH, IDLE = range(5)
Offset = tuple[int, int]
Offsets = Callable[..., np.ndarray]


@pytest.fixture
def hunt(offsets: Offsets) -> Callable[..., int]:
    """``hunt(script, (5, 1), (0, -8))``: what a predator that just began does about prey so far away."""

    def act(script: str, *prey: Offset, agent: int = 0, n_actions: int = 5) -> int:
        name = f"predator_{agent}"
        return ScriptedTeam(script, n_actions=n_actions).act({name: offsets(*prey)})[name]

    return act


Hunt = Callable[..., int]
HUNTERS = ["greedy_chase", "parity_chase", "intercept", "surround"]


# -- all hunters --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("script", HUNTERS)
def test_a_caught_prey_is_passed_over(hunt: Hunt, script: str) -> None:
    assert hunt(script, (0, 0), (0, 40)) == NORTH
    assert hunt(script, (0, -40), (0, 0)) == SOUTH
    assert hunt(script, (0, 0), (-2, 0), (0, 40), (0, 0)) == WEST


@pytest.mark.parametrize("script", HUNTERS)
def test_where_none_is_left_the_last_action_is_taken(hunt: Hunt, script: str) -> None:
    for agent in range(4):
        assert hunt(script, (0, 0), (0, 0), agent=agent) == IDLE
        assert hunt(script, (0, 0), (0, 0), agent=agent, n_actions=4) == SOUTH


@pytest.mark.parametrize("script", HUNTERS)
def test_the_nearest_prey_is_hunted_and_of_two_the_first(hunt: Hunt, script: str) -> None:
    assert hunt(script, (30, 0), (0, -8)) == SOUTH
    assert hunt(script, (0, 8), (0, -8)) == NORTH
    assert hunt(script, (20, 20), (0, -8), (-8, 0)) == SOUTH
    assert hunt(script, (6, 0), (20, 2), (0, 4)) == NORTH


# -- greedy_chase, parity_chase -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("offset", "action"),
    [((5, 1), EAST), ((-5, 1), WEST), ((1, 5), NORTH), ((1, -5), SOUTH), ((3, 3), EAST), ((-3, -3), WEST)],
)
def test_a_chaser_shortens_the_longer_leg(hunt: Hunt, offset: Offset, action: int) -> None:
    assert hunt("greedy_chase", offset) == action
    assert hunt("parity_chase", offset) == action


def test_parity_idles_exactly_when_the_nearest_free_prey_is_an_odd_distance_away(hunt: Hunt) -> None:
    steps = range(-4, 5)
    for prey in product(product(steps, steps), [(3, 1), (-2, -1), (0, 0)]):
        if nearest := min((abs(x) + abs(y) for x, y in prey if (x, y) != (0, 0)), default=0):
            greedy = hunt("greedy_chase", *prey)
            assert greedy != IDLE
            assert hunt("parity_chase", *prey) == (IDLE if nearest % 2 else greedy)
        else:
            assert hunt("parity_chase", *prey) == IDLE  # there is nobody to hunt


def test_in_turns_it_idles_exactly_at_the_even_distances(offsets: Offsets) -> None:
    """The prey has moved, and the predator sees it: from beside it, it lands on it."""
    for script in ("parity_chase", "intercept", "surround"):
        for prey in product(range(-4, 5), repeat=2):
            policy, nearest = ScriptedTeam(script, in_turns=True), abs(prey[0]) + abs(prey[1])
            idles = policy.act({"predator_0": offsets(prey)}) == {"predator_0": IDLE}
            assert idles == (nearest % 2 == 0)


def test_parity_never_idles_where_predators_may_not(hunt: Hunt) -> None:
    for prey in product(product(range(-4, 5), repeat=2), [(3, 1), (-2, -1), (0, 0)]):
        greedy = hunt("greedy_chase", *prey, n_actions=4)
        assert hunt("parity_chase", *prey, n_actions=4) == greedy < IDLE


# -- intercept ----------------------------------------------------------------------------------------------------


@pytest.fixture
def watch(offsets: Offsets) -> Callable[..., list[int]]:
    """``watch([(6, 0)], [(5, 1)])``: what `intercept` does in an episode in which it sees these views."""

    def play(*views: list[Offset], n_actions: int = 5) -> list[int]:
        policy = ScriptedTeam("intercept", n_actions=n_actions)
        return [policy.act({"predator_0": offsets(*view)})["predator_0"] for view in views]

    return play


Watch = Callable[..., list[int]]


def test_it_aims_ahead_of_a_prey_that_crosses_its_way(watch: Watch) -> None:
    """The prey runs north all the time.

    First seen 6 east it is run at. At (5, 1) it just went north, and in 6/2 steps will be at (5, 4); from (4, 2) at
    (4, 5), so that the predator turns north where a greedy one goes on east.
    """
    assert watch([(6, 0)], [(5, 1)], [(4, 2)], [(4, 2)]) == [EAST, EAST, NORTH, NORTH]


def test_a_prey_that_dithers_is_led_by_its_last_move_only(watch: Watch) -> None:
    """North, south, north: at (4, 2) and (3, 1) it aims at (4, 5) and (3, -1), at (2, 2) at (2, 4)."""
    assert watch([(5, 1)], [(4, 2)]) == [EAST, NORTH]
    assert watch([(4, 2)], [(3, 1)], [(2, 2)]) == [EAST, EAST, NORTH]


def test_a_prey_that_comes_closer_is_met_half_way(watch: Watch) -> None:
    """(6, 2) and then (4, 2), as it went west: in 3 steps at (1, 2). A greedy predator goes east."""
    assert watch([(6, 2)], [(4, 2)]) == [EAST, NORTH]


def test_a_prey_that_runs_away_straight_is_followed(watch: Watch) -> None:
    assert watch([(6, 0)], [(6, 0)], [(6, 0)]) == [EAST] * 3
    assert watch([(0, -6)], [(0, -6)], [(0, -6)]) == [SOUTH] * 3


# The predator moves in the first step; what it then sees of a prey that moved once makes it turn.
TURNS = [
    ((4, 2), EAST, (3, 3), NORTH),
    ((-4, 2), WEST, (-3, 3), NORTH),
    ((1, 5), NORTH, (2, 4), EAST),
    ((1, -5), SOUTH, (2, -4), EAST),
    ((1, 4), IDLE, (2, 4), EAST),  # an odd distance
    ((-1, -4), IDLE, (-2, -4), WEST),
]


@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_its_own_move_is_not_taken_for_the_preys(watch: Watch, hunt: Hunt, turn: tuple) -> None:
    first, moved, second, turned = turn
    assert watch([first], [second]) == [moved, turned]
    assert hunt("greedy_chase", second) != turned


def test_in_its_first_step_it_has_seen_nobody_move(watch: Watch, hunt: Hunt) -> None:
    for offset in product(range(-4, 5), repeat=2):
        assert watch([offset]) == [hunt("parity_chase", offset)]


def test_a_new_episode_is_a_first_step(offsets: Offsets) -> None:
    policy = ScriptedTeam("intercept")
    assert policy.act({"predator_0": offsets((1, 5))}) == {"predator_0": NORTH}
    policy.reset()
    assert policy.act({"predator_0": offsets((2, 4))}) == {"predator_0": NORTH}  # else EAST, as above


def test_another_prey_is_not_taken_for_one_that_ran(watch: Watch) -> None:
    """Of two 10 away the first is chased, then caught by others; 8 away at (5, -3) is the second now.

    Had the first leapt there from (9, 0), it would be far south in 4 steps.
    """
    assert watch([(10, 0), (6, -4)], [(0, 0), (5, -3)]) == [EAST, EAST]


def test_a_prey_that_crosses_the_antipode_is_not_taken_for_one_that_ran(watch: Watch) -> None:
    """On 20 cells: a step south from 10 south is 9 north. Led by that leap of 19 the predator would go north."""
    assert watch([(9, -10)], [(9, 9)]) == [IDLE, EAST]


def test_each_predator_remembers_its_own_prey(offsets: Offsets) -> None:
    policy = ScriptedTeam("intercept")
    views = [
        {"predator_0": offsets((4, 2)), "predator_1": offsets((1, 5))},
        {"predator_0": offsets((3, 3)), "predator_1": offsets((2, 4))},
    ]
    assert [policy.act(view) for view in views] == [
        {"predator_0": EAST, "predator_1": NORTH},
        {"predator_0": NORTH, "predator_1": EAST},
    ]


def test_it_keeps_step_as_parity_chase_does(watch: Watch) -> None:
    assert watch([(5, 0)], [(4, 0)], [(3, 0)]) == [IDLE, EAST, IDLE]
    assert watch([(5, 0)], [(3, 0)], n_actions=4) == [EAST, EAST]


# -- surround -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("prey", "roles"),  # from the west, the east, the south and the north
    [
        # 4 away: 2 out. The aims are (0, 2), (4, 2), (2, 0), (2, 4).
        ((2, 2), [NORTH, EAST, EAST, NORTH]),
        # (-4, 2), (0, 2), (-2, 0), (-2, 4)
        ((-2, 2), [WEST, NORTH, WEST, NORTH]),
        # 6 away: 3 out. (-1, -4), (5, -4), (2, -7), (2, -1)
        ((2, -4), [SOUTH, EAST, SOUTH, EAST]),
        # (1, 2), (7, 2), (4, -1), (4, 5)
        ((4, 2), [NORTH, EAST, EAST, NORTH]),
        # 8 away: 4 out. (-4, 8), (4, 8), (0, 4), (0, 12)
        ((0, 8), [NORTH, NORTH, NORTH, NORTH]),
    ],
)
def test_each_role_aims_at_its_own_side(hunt: Hunt, prey: Offset, roles: list[int]) -> None:
    assert [hunt("surround", prey, agent=agent) for agent in range(4)] == roles


def test_roles_are_dealt_in_turn(hunt: Hunt) -> None:
    assert [hunt("surround", (2, 2), agent=agent) for agent in range(4, 12)] == [NORTH, EAST, EAST, NORTH] * 2


def test_it_keeps_step_unless_predators_may_not_idle(hunt: Hunt) -> None:
    for agent in range(4):
        assert hunt("surround", (2, 1), agent=agent) == IDLE
    # 3 away: 1.5 out. (0.5, 1), (3.5, 1), (2, -0.5), (2, 2.5)
    assert [hunt("surround", (2, 1), agent=agent, n_actions=4) for agent in range(4)] == [NORTH, EAST, EAST, NORTH]
