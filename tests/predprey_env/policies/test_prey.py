"""The scripts of prey, by hand."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.policies import ScriptedTeam

EAST, WEST, NORTH, SOUTH = range(4)
Offset = tuple[int, int]
Offsets = Callable[..., np.ndarray]


@pytest.fixture
def flee(offsets: Offsets) -> Callable[..., int]:
    """``flee(script, (5, 1), (0, -8))``: what a prey that just began does about predators so far away."""

    def act(script: str, *predators: Offset) -> int:
        return ScriptedTeam(script).act({"prey_0": offsets(*predators)})["prey_0"]

    return act


Flee = Callable[..., int]
FLEEING = ["flee_nearest", "flee_centroid", "run_straight"]


@pytest.mark.parametrize("script", FLEEING)
@pytest.mark.parametrize(
    ("offset", "action"),
    [((5, 1), WEST), ((-5, 1), EAST), ((1, 5), SOUTH), ((1, -5), NORTH), ((3, 3), WEST), ((-3, 3), EAST)],
)
def test_a_single_predator_is_fled_along_the_longer_leg(flee: Flee, script: str, offset: Offset, action: int) -> None:
    assert flee(script, offset) == action


@pytest.mark.parametrize("script", ["flee_nearest", "run_straight"])
def test_the_nearest_predator_is_fled_and_of_two_the_first(flee: Flee, script: str) -> None:
    assert flee(script, (9, 0), (0, -8), (20, 20)) == NORTH
    assert flee(script, (0, 8), (0, -8)) == SOUTH
    assert flee(script, (0, -8), (0, 8)) == NORTH


# -- flee_centroid ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("predators", "action"),
    [
        ([(3, 0), (0, -8), (1, 2)], NORTH),  # together (4, -6)
        ([(-1, 0), (9, 1), (2, 3)], WEST),  # (10, 4): away from the two far ones, past the near one
        ([(2, 2), (-1, 1)], SOUTH),  # (1, 3)
        ([(-2, -2), (1, -1)], NORTH),
        ([(-3, 0), (0, 3)], EAST),  # (-3, 3): the x leg where they tie
        ([(4, 0), (0, -4)], WEST),
    ],
)
def test_predators_are_fled_all_together(flee: Flee, predators: list[Offset], action: int) -> None:
    assert flee("flee_centroid", *predators) == action


def test_who_is_surrounded_evenly_goes_west(flee: Flee) -> None:
    """It must go somewhere."""
    assert flee("flee_centroid", (3, 0), (-3, 0)) == WEST
    assert flee("flee_centroid", (0, 5), (-1, -5), (1, 0)) == WEST


def test_predators_count_the_shortest_way_round() -> None:
    env = PredPreyEnv(EnvConfig(n_predators=2, n_prey=1, size=20))
    views, _ = env.reset(options={"starts": [[18, 0], [3, 5], [0, 0]]})  # 2 west; 3 east and 5 north
    assert views["prey_0"].tolist() == [-2, 0, 3, 5]
    assert ScriptedTeam("flee_centroid").act(views) == {"prey_0": SOUTH}


# -- run_straight -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("predator", "action"), [((9, 1), WEST), ((-9, 1), EAST), ((1, 9), SOUTH), ((1, -9), NORTH)])
def test_it_never_turns(offsets: Offsets, predator: Offset, action: int) -> None:
    policy = ScriptedTeam("run_straight")
    for seen in [predator, *product((-2, 0, 2), repeat=2)]:
        assert policy.act({"prey_0": offsets(seen)}) == {"prey_0": action}


def test_it_forgets_its_direction_when_an_episode_starts(offsets: Offsets) -> None:
    policy = ScriptedTeam("run_straight")
    for predator, action in [((9, 1), WEST), ((1, 9), SOUTH), ((-9, 1), EAST)]:
        policy.reset()
        assert policy.act({"prey_0": offsets(predator)}) == {"prey_0": action}
        assert policy.act({"prey_0": offsets((1, -9))}) == {"prey_0": action}


def test_each_prey_has_its_own_direction(offsets: Offsets) -> None:
    policy = ScriptedTeam("run_straight")
    first = {"prey_0": offsets((9, 1)), "prey_1": offsets((1, 9))}
    assert policy.act(first) == {"prey_0": WEST, "prey_1": SOUTH}
    swapped = {"prey_0": first["prey_1"], "prey_1": first["prey_0"]}
    assert policy.act(swapped) == {"prey_0": WEST, "prey_1": SOUTH}
