from __future__ import annotations

import numpy as np
import pytest

from predprey_env import predprey_v0
from predprey_env.policies import ScriptedTeam

EAST, WEST, NORTH, SOUTH, IDLE = range(5)


def offsets(*pairs: tuple[int, int]) -> np.ndarray:
    return np.array(pairs, np.float32).ravel()


def chase(*pairs: tuple[int, int], n_actions: int = 5) -> int:
    return ScriptedTeam("greedy_chase", n_actions).act({"predator_0": offsets(*pairs)})["predator_0"]


def flee(*pairs: tuple[int, int]) -> int:
    return ScriptedTeam("flee_nearest", 4).act({"prey_0": offsets(*pairs)})["prey_0"]


@pytest.mark.parametrize(
    ("offset", "action"), [((5, 1), EAST), ((-5, 1), WEST), ((1, 5), NORTH), ((1, -5), SOUTH), ((3, 3), EAST)]
)
def test_a_chaser_shortens_the_longer_leg(offset: tuple[int, int], action: int) -> None:
    assert chase(offset) == action


@pytest.mark.parametrize(
    ("offset", "action"), [((5, 1), WEST), ((-5, 1), EAST), ((1, 5), SOUTH), ((1, -5), NORTH), ((3, 3), WEST)]
)
def test_a_fleeing_prey_lengthens_the_longer_leg(offset: tuple[int, int], action: int) -> None:
    assert flee(offset) == action


def test_the_nearest_opponent_counts_and_of_two_the_first() -> None:
    assert chase((9, 0), (0, -8)) == SOUTH
    assert chase((0, 8), (0, -8)) == NORTH
    assert flee((9, 0), (0, -8), (20, 20)) == NORTH


def test_a_chaser_passes_over_caught_prey_and_rests_when_none_is_left() -> None:
    assert chase((0, 0), (0, 40)) == NORTH
    assert chase((0, 40), (0, 0)) == NORTH
    assert chase((0, 0), (0, 0)) == IDLE
    assert chase((0, 0), (0, 0), n_actions=4) == SOUTH


def test_a_team_acts_for_its_own_agents_only() -> None:
    env = predprey_v0.parallel_env()
    observations, _ = env.reset(seed=0)
    assert list(ScriptedTeam("greedy_chase", 5).act(observations)) == ["predator_0", "predator_1", "predator_2"]
    assert list(ScriptedTeam("flee_nearest", 4).act(observations)) == ["prey_0", "prey_1"]


def test_an_unknown_script_is_refused() -> None:
    with pytest.raises(ValueError, match="script must be one of greedy_chase, flee_nearest, got 'swim'"):
        ScriptedTeam("swim", 4)


def test_a_chaser_on_the_same_axis_never_gets_nearer_to_a_prey_that_runs_straight() -> None:
    env = predprey_v0.parallel_env(n_predators=1, n_prey=1, size=20)
    observations, _ = env.reset(options={"starts": [[0, 0], [3, 0]]})
    hunter, prey = ScriptedTeam("greedy_chase", 5), ScriptedTeam("flee_nearest", 4)
    for _ in range(30):
        assert observations["predator_0"].tolist() == [3, 0]
        observations, *_ = env.step(hunter.act(observations) | prey.act(observations))
