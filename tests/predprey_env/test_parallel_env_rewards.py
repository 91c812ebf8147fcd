"""Whole episodes by hand; what every episode promises is in test_invariants.py.

On a torus of 8 cells the largest distance is 8. Predators start at (0, 0) and (0, 4), prey at (2, 0), (4, 0), (6, 2).
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from predprey_env import EnvConfig, PredPreyEnv

STARTS = [(0, 0), (0, 4), (2, 0), (4, 0), (6, 2)]
Play = Callable[..., list]


def env_of(n_prey: int, max_cycles: int, **switches: object) -> PredPreyEnv:
    return PredPreyEnv(EnvConfig(n_predators=2, n_prey=n_prey, size=8, max_cycles=max_cycles, **switches))


def returns(steps: list) -> dict[str, float]:
    total = dict.fromkeys(steps[0].rewards, 0.0)
    for step in steps:
        for agent, reward in step.rewards.items():
            total[agent] += reward
    return total


NOTHING_CAUGHT = [
    # The prey ends at (4, 0), 4 and 8 steps from the predators: d = 1 - 6/8.
    (1, 2, ["IIE", "IIE"], 20 * (2 / 8)),
    # The prey end where they began. Distances 2, 6 and 4, 8: d = 1 - 5/8.
    (2, 2, ["IIEN", "IIWS"], 20 * (3 / 8) / 2),
    # And 4, 4 for the third: 28 steps over 6 pairs.
    (3, 2, ["IIENE", "IIWSW"], 20 * (1 - 28 / 48) / 3),
]
SOME_CAUGHT = [
    # Prey 0 is caught at (1, 0); prey 1 ends at (4, 0), 3 and 8 steps away: d = 1 - 5.5/8.
    (2, 2, ["EIWE", "IIEW"], 20 * 1 / 2 + 2 + 20 * (2.5 / 8) / 2),
    # Prey 2 ends at (6, 2), 5 and 4 steps away: d = 1 - (3 + 8 + 5 + 4) / 4 / 8.
    (3, 2, ["EIWEN", "IIEWS"], 20 * 1 / 3 + 2 + 20 * (3 / 8) / 3),
    # Prey 1 is caught at (3, 0); prey 2 ends at (6, 3), 6 and 3 steps away: d = 1 - 4.5/8.
    (3, 3, ["EIWEN", "EIEWS", "EIEWN"], 20 * 2 / 3 + 2 * 2 + 20 * (3.5 / 8) / 3),
]
ALL_CAUGHT = [
    (1, 2, ["EIW"], 12.5 * 1 / 2),
    (2, 10, ["EIWE", "EIEW", "EINW"], 12.5 * 3 / 10),  # prey 0 in step 1, prey 1 in step 3
    (3, 10, ["EWWEN", "ESEWE", "EIEWN"], 12.5 * 3 / 10),  # and prey 2 at (7, 3), in step 2
    (1, 1, ["EIW"], 12.5),
]
EPISODES = [
    *[(n, cycles, words, score, 25.0) for n, cycles, words, score in NOTHING_CAUGHT],
    *[(n, cycles, words, score, 12.5) for n, cycles, words, score in SOME_CAUGHT],
    *[(n, cycles, words, 25.0, score) for n, cycles, words, score in ALL_CAUGHT],
]


@pytest.mark.parametrize("episode", EPISODES, ids=str)
def test_the_undiscounted_return_is_the_papers_fitness(play: Play, episode) -> None:
    n_prey, max_cycles, words, predators, prey = episode
    env = env_of(n_prey, max_cycles)
    steps = play(env, STARTS[: 2 + n_prey], *words)
    assert env.agents == []
    assert all(set(step.rewards.values()) == {0.0} for step in steps[:-1])
    assert returns(steps) == {agent: prey if "prey" in agent else predators for agent in env.possible_agents}
    ends = (steps[-1].terminations, steps[-1].truncations)
    assert [set(end.values()) for end in ends] == ([{True}, {False}] if predators == 25 else [{False}, {True}])


@pytest.mark.parametrize("episode", EPISODES, ids=str)
def test_dense_rewards_add_up_to_the_gain_in_fitness(play: Play, episode) -> None:
    n_prey, max_cycles, words, predators, prey = episode
    env = env_of(n_prey, max_cycles, reward="dense")
    _, infos = env.reset(options={"starts": STARTS[: 2 + n_prey]})
    total = returns(play(env, STARTS[: 2 + n_prey], *words))
    for agent, gained in total.items():
        end = prey if "prey" in agent else predators
        assert gained == pytest.approx(end - infos[agent]["fitness"], abs=1e-12)


def test_dense_rewards_by_hand(play: Play) -> None:
    steps = play(env_of(2, 10, reward="dense"), STARTS[:4], "EIWE", "IIWW")
    # 3.75 at the start. Then prey 0 is caught and prey 1 at (5, 0), 4 and 7 steps away: 12 + 10 (1 - 5.5/8) = 15.125.
    assert steps[0].rewards == {"predator_0": 11.375, "predator_1": 11.375, "prey_0": -12.5, "prey_1": -12.5}
    # Then prey 1 is at (4, 0), 3 and 8 steps away: no change.
    assert steps[1].rewards == dict.fromkeys(steps[1].rewards, 0.0)


def test_a_removed_prey_leaves_with_the_fitness_of_an_episode_that_ends_with_it(play: Play) -> None:
    steps = play(env_of(2, 10, captured_prey="removed"), STARTS[:4], "EIWE", "EIEW", "EINW")
    assert steps[0].rewards == {"predator_0": 0.0, "predator_1": 0.0, "prey_0": 12.5, "prey_1": 0.0}
    assert steps[1].rewards == {"predator_0": 0.0, "predator_1": 0.0, "prey_1": 0.0}
    assert steps[2].rewards == {"predator_0": 25.0, "predator_1": 25.0, "prey_1": 12.5 * 3 / 10}


def test_a_removed_prey_gets_its_last_dense_reward(play: Play) -> None:
    steps = play(env_of(2, 10, captured_prey="removed", reward="dense"), STARTS[:4], "EIWE", "EIEW")
    assert steps[0].rewards["prey_0"] == -12.5
    assert "prey_0" not in steps[1].rewards


def test_every_agent_has_its_own_reward_under_individual_credit(play: Play) -> None:
    (last,) = play(env_of(1, 1, credit="individual"), STARTS[:3], "IIE")  # the prey ends at (3, 0): 3 and 7 steps
    assert last.rewards == {"predator_0": 20 * (5 / 8), "predator_1": 20 * (1 / 8), "prey_0": 25.0}
