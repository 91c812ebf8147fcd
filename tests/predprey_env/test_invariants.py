"""What holds in every episode of every world: random configurations, random actions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.config import SIGHT_OPTIONS

CONFIGS = st.from_type(EnvConfig)
SEEDS = st.integers(0, 2**31)
MOVES = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (0, 0)])


class Places(NamedTuple):
    """Where everybody is."""

    cells: np.ndarray
    """int ``(n_agents, 2)``."""
    free: np.ndarray
    """Which prey: bool ``(n_prey,)``."""


class Turn(NamedTuple):
    """A call of `step`."""

    number: int
    """From 1 on."""
    moves: tuple[bool, bool]
    """Whether predators and prey move in it."""
    complete: bool
    """Whether a time step ends with it."""
    actions: dict[str, int]
    before: Places
    after: Places
    observations: dict[str, np.ndarray]
    rewards: dict[str, float]
    terminations: dict[str, bool]
    truncations: dict[str, bool]
    infos: dict[str, dict[str, float]]


def places(env: PredPreyEnv) -> Places:
    n, state = env.config.n_agents, env.state()
    assert state in env.state_space
    return Places(state[: 2 * n].reshape(2, n).T.astype(int), state[2 * n : -1] == 1)


def episode(env: PredPreyEnv, seed: int) -> Iterator[Turn]:
    """The turns of an episode that was reset."""
    random, number, in_turns = np.random.default_rng(seed), 0, env.config.move_order == "prey_first"
    while env.agents:
        actions = {agent: int(random.integers(env.action_space(agent).n)) for agent in env.agents}
        before, number = places(env), number + 1
        step = env.step(actions)
        moves = (number % 2 == 0, number % 2 == 1) if in_turns else (True, True)
        yield Turn(number, moves, moves[0], actions, before, places(env), *step)


def reset(config: EnvConfig, seed: int) -> PredPreyEnv:
    env = PredPreyEnv(config)
    env.reset(seed=seed)
    return env


# -- places -------------------------------------------------------------------------------------------------------


@given(config=CONFIGS, seed=SEEDS)
def test_whoever_acts_moves_as_it_chose_and_stays_on_the_torus(config: EnvConfig, seed: int) -> None:
    env, p = reset(config, seed), config.n_predators
    for turn in episode(env, seed):
        assert turn.after.cells.min() >= 0
        assert turn.after.cells.max() < config.size
        for i, agent in enumerate(env.possible_agents):
            prey = i - p
            if agent not in turn.actions or not turn.moves[prey >= 0] or (prey >= 0 and not turn.before.free[prey]):
                assert turn.after.cells[i].tolist() == turn.before.cells[i].tolist()
                continue
            chosen = ((turn.before.cells[i] + MOVES[turn.actions[agent]]) % config.size).tolist()
            swapped = config.swap_captures and prey >= 0 and not turn.after.free[prey]  # and so never left
            expected = [chosen, turn.before.cells[i].tolist()] if swapped else [chosen]
            assert turn.after.cells[i].tolist() in expected


@given(config=CONFIGS, seed=SEEDS)
def test_a_prey_is_caught_exactly_where_a_predator_is_and_stays_caught(config: EnvConfig, seed: int) -> None:
    env, p = reset(config, seed), config.n_predators
    for turn in episode(env, seed):
        assert (turn.after.free <= turn.before.free).all()
        cells = turn.after.cells
        met = (cells[p:, None] == cells[None, :p]).all(axis=2).any(axis=1)
        assert not met[turn.after.free].any()
        assert met[turn.before.free & ~turn.after.free].all()
        for agent, info in turn.infos.items():
            assert info["n_captured"] == (~turn.after.free).sum()
            assert info["captured"] == (agent[:4] == "prey" and not turn.after.free[int(agent[-1])])


@given(config=CONFIGS, seed=SEEDS)
def test_views_are_offsets_the_shortest_way_round(config: EnvConfig, seed: int) -> None:
    config = config.replace(**dict.fromkeys(SIGHT_OPTIONS, False))
    env, n, p = reset(config, seed), config.size, config.n_predators
    for turn in episode(env, seed):
        for agent, view in turn.observations.items():
            assert view in env.observation_space(agent)
            i = env.possible_agents.index(agent)
            others = range(p, config.n_agents) if i < p else range(p)
            for j, offset in zip(others, view.reshape(-1, 2).astype(int), strict=True):
                if turn.after.free[max(i, j) - p]:
                    assert (np.abs(offset) <= n // 2).all()
                    assert ((turn.after.cells[i] + offset - turn.after.cells[j]) % n == 0).all()
                else:
                    assert not offset.any()


@given(config=CONFIGS, half=st.integers(2, 5), seed=SEEDS)
def test_on_an_even_torus_only_idling_changes_the_parity_of_a_distance(config: EnvConfig, half: int, seed: int) -> None:
    """Between whole time steps; in turns each of the two moves changes it, unless the predator idles."""
    env, p = reset(config.replace(size=2 * half), seed), config.n_predators
    for turn in episode(env, seed):
        before, after = (np.abs(each.cells[:p, None] - each.cells[None, p:]).sum(axis=2) % 2 for each in turn[4:6])
        predators_go = np.array([turn.moves[0] and turn.actions[f"predator_{i}"] != 4 for i in range(p)])
        changed = predators_go[:, None] ^ turn.moves[1]
        assert ((before ^ after)[:, turn.after.free] == changed.repeat(config.n_prey, 1)[:, turn.after.free]).all()


# -- fitness and rewards ------------------------------------------------------------------------------------------


@given(config=CONFIGS, seed=SEEDS)
def test_fitness_keeps_to_its_bands(config: EnvConfig, seed: int) -> None:
    """Predators' go by the prey caught, 20 g/n + 2 g and what closeness adds; prey's by who is left, and how long."""
    n = config.n_prey
    for turn in episode(reset(config, seed), seed):
        g = int((~turn.after.free).sum())
        low, high = (25.0, 25.0) if g == n else (20 * g / n + 2 * g, 20 * g / n + 2 * g + 20 / n)
        predators = [info["fitness"] for agent, info in turn.infos.items() if agent.startswith("predator")]
        assert all(low - 1e-9 <= fitness <= high + 1e-9 for fitness in predators)
        if config.credit == "team":
            assert len(set(predators)) == 1
        lasted = 12.5 * turn.infos["predator_0"]["steps"] / config.max_cycles
        expected = 25.0 if g == 0 else lasted if g == n else 12.5
        for agent, info in turn.infos.items():
            if agent.startswith("predator"):
                continue
            if config.prey_fitness == "lifespan":
                assert info["fitness"] == expected
                assert 0 < info["fitness"] <= 25
            else:
                assert 25 - high - 1e-9 <= info["fitness"] <= 25 - low + 1e-9
                assert config.credit == "individual" or info["fitness"] == 25 - predators[0]


@given(config=CONFIGS, seed=SEEDS)
def test_rewards_sum_to_the_fitness_at_the_end(config: EnvConfig, seed: int) -> None:
    """Or to its change since the start if they are dense; and are 0 until the end if they are not."""
    env = PredPreyEnv(config)
    _, infos = env.reset(seed=seed)
    start = {agent: info["fitness"] if config.reward == "dense" else 0.0 for agent, info in infos.items()}
    total, left = dict.fromkeys(start, 0.0), set()
    for turn in episode(env, seed):
        for agent, reward in turn.rewards.items():
            total[agent] += reward
            if turn.terminations[agent] or turn.truncations[agent]:
                left.add(agent)
                assert total[agent] == pytest.approx(turn.infos[agent]["fitness"] - start[agent], abs=1e-9)
            elif config.reward == "terminal":
                assert reward == 0.0
    assert left == set(start)


# -- time ---------------------------------------------------------------------------------------------------------


@given(config=CONFIGS, seed=SEEDS)
def test_an_episode_ends_when_all_are_caught_or_else_when_the_time_is_up(config: EnvConfig, seed: int) -> None:
    env, calls = reset(config, seed), 2 if config.move_order == "prey_first" else 1
    acting = env.agents
    for turn in episode(env, seed):
        assert turn.infos["predator_0"]["steps"] == -(-turn.number // calls)
        all_caught = turn.complete and not turn.after.free.any()
        time_is_up = turn.number == config.max_cycles * calls and not all_caught
        assert (not env.agents) == (all_caught or time_is_up)
        for agent in acting:
            leaves = config.captured_prey == "removed" and turn.infos[agent]["captured"] == 1
            assert turn.terminations[agent] == (all_caught or leaves)
            assert turn.truncations[agent] == time_is_up
            assert leaves or not (turn.terminations[agent] and turn.truncations[agent])
        assert all(list(part) == acting for part in turn[6:])
        acting = [agent for agent in acting if not (turn.terminations[agent] or turn.truncations[agent])]
        assert env.agents == acting
    assert acting == []


@given(config=CONFIGS, seed=SEEDS)
def test_infos_say_whose_turn_is_next(config: EnvConfig, seed: int) -> None:
    env = PredPreyEnv(config)
    _, infos = env.reset(seed=seed)
    in_turns = config.move_order == "prey_first"
    assert {agent: info["in_turn"] for agent, info in infos.items()} == {
        agent: int(not in_turns or agent.startswith("prey")) for agent in env.agents
    }
    for turn in episode(env, seed):
        for agent, info in turn.infos.items():
            assert info["in_turn"] == (not in_turns or turn.moves[agent.startswith("predator")])


@given(config=CONFIGS, seed=SEEDS, garbage=st.sampled_from([{}, None, {"predator_0": 99}, {"wolf": 1}, [1, 2]]))
def test_after_the_end_nothing_happens(config: EnvConfig, seed: int, garbage: object) -> None:
    env = reset(config, seed)
    for _ in episode(env, seed):
        pass
    state = env.state().tolist()
    assert env.step(garbage) == ({}, {}, {}, {}, {})
    assert env.state().tolist() == state


@given(config=CONFIGS, seed=SEEDS)
def test_random_starts_are_on_the_torus_and_prey_off_the_predators_where_that_is_asked(
    config: EnvConfig, seed: int
) -> None:
    assume(config.start_collisions == "redraw")
    start = places(reset(config, seed))
    assert start.free.all()
    p = config.n_predators
    assert not (start.cells[p:, None] == start.cells[None, :p]).all(axis=2).any()
