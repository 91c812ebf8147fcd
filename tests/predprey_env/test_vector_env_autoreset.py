"""What ends when, and what starts again when: gymnasium's three modes, against its own vector environment and against
single environments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import DictInfoToList, RecordEpisodeStatistics

from predprey_env import EnvConfig, PredPreyEnv, PredPreyVectorEnv, TeamView, vector_env
from predprey_env.config import TEAMS, TeamName

NEXT_STEP, SAME_STEP, DISABLED = AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP, AutoresetMode.DISABLED
TINY = EnvConfig(n_predators=3, n_prey=2, size=6, max_cycles=9, reward="dense")
TEAM = pytest.mark.parametrize("team", TEAMS)
ORDER = pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
REWARD = pytest.mark.parametrize("reward", ["terminal", "dense"])
# Who catches prey that walk at random, and does not always catch them in nine steps; and who gets away sometimes.
OPPONENTS: dict[TeamName, str] = {"predators": "random", "prey": "parity_chase"}


def draw(env: PredPreyVectorEnv, random: np.random.Generator) -> np.ndarray:
    return random.integers(0, env.single_action_space.n, env.num_envs)


# -- against single environments ----------------------------------------------------------------------------------


@REWARD
@ORDER
@TEAM
@pytest.mark.parametrize("mode", [NEXT_STEP, SAME_STEP])
def test_it_starts_worlds_again_as_single_environments_are(
    singles: Callable[..., Any], mode: AutoresetMode, team: TeamName, move_order: str, reward: str
) -> None:
    config = TINY.replace(move_order=move_order, reward=reward)
    env = PredPreyVectorEnv(config, 19, team, OPPONENTS[team], mode)
    alone = singles(config, team, lambda: OPPONENTS[team], 19, mode)
    views, _ = env.reset(seed=3)
    assert views.tolist() == alone.reset(range(3, 22)).observations.tolist()
    random, kinds = np.random.default_rng(0), set()
    for _ in range(40):
        actions = draw(env, random)
        returned = env.step(actions)
        assert alone.agrees(returned, alone.step(actions))
        kinds |= set(zip(returned[2].tolist(), returned[3].tolist(), strict=True))
    assert alone.n_ended > 19 * 3
    assert kinds == {(False, False), (True, False), (False, True)}  # never both


@TEAM
@ORDER
def test_without_autoreset_the_caller_starts_worlds_again(
    singles: Callable[..., Any], team: TeamName, move_order: str
) -> None:
    config = TINY.replace(move_order=move_order)
    env = PredPreyVectorEnv(config, 19, team, OPPONENTS[team], DISABLED)
    alone = singles(config, team, lambda: OPPONENTS[team], 19, DISABLED)
    env.reset(seed=3)
    alone.reset(range(3, 22))
    random = np.random.default_rng(0)
    for _ in range(40):
        actions = draw(env, random)
        returned = env.step(actions)
        assert alone.agrees(returned, alone.step(actions))
        mask = returned[2] | returned[3]
        if mask.any():
            with pytest.raises(
                RuntimeError,
                match=r"^reset\(\) must be called with a reset_mask for the worlds that are over, got \[\d",
            ):
                env.step(actions)
            views, infos = env.reset(options={"reset_mask": mask})
            expected = alone.reset([None] * 19, which=np.flatnonzero(mask.reshape(19, -1)[:, 0]))
            assert views.tolist() == expected.observations.tolist()
            assert infos["n_captured"].tolist() == expected.infos["n_captured"].tolist()
    assert alone.n_ended > 19 * 3


# -- against gymnasium's ------------------------------------------------------------------------------------------


class OneAgent(gymnasium.Env):
    """A team of one as a plain gymnasium environment."""

    def __init__(self, config: EnvConfig, team: TeamName) -> None:
        self.view = TeamView(PredPreyEnv(config), team, OPPONENTS[team])
        (self.agent,) = self.view.possible_agents
        self.observation_space = self.view.observation_space(self.agent)
        self.action_space = self.view.action_space(self.agent)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, ...]:
        views, infos = self.view.reset(seed)
        return views[self.agent], self.told(infos)

    def step(self, action: Any) -> tuple[Any, ...]:
        *step, infos = self.view.step({self.agent: action})
        return *(part[self.agent] for part in step), self.told(infos)

    def told(self, infos: dict[str, Any]) -> dict[str, Any]:
        return {key: infos[self.agent][key] for key in ("captured", "n_captured", "steps")}


@REWARD
@TEAM
@pytest.mark.parametrize("mode", [NEXT_STEP, SAME_STEP, DISABLED])
def test_teams_of_one_are_what_gymnasium_makes_of_them(mode: AutoresetMode, team: TeamName, reward: str) -> None:
    config = TINY.replace(reward=reward, **{"n_predators" if team == "predators" else "n_prey": 1})
    env = PredPreyVectorEnv(config, 9, team, OPPONENTS[team], mode)
    theirs = SyncVectorEnv([lambda: OneAgent(config, team)] * 9, autoreset_mode=mode)
    assert env.observation_space == theirs.observation_space
    assert env.action_space == theirs.action_space
    assert env.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"]
    assert_alike(env.reset(seed=7), theirs.reset(seed=7))
    random, n_ended = np.random.default_rng(1), 0
    for _ in range(40):
        actions = draw(env, random)
        returned, expected = env.step(actions), theirs.step(actions)
        assert_alike(returned, expected)
        over = returned[2] | returned[3]
        n_ended += over.sum()
        if mode is DISABLED and over.any():
            seeds = random.integers(0, 99, 9).tolist()
            ours, others = (each.reset(seed=seeds, options={"reset_mask": over.copy()}) for each in (env, theirs))
            assert ours[0].tolist() == others[0].tolist()
    assert n_ended > 9 * 3


def assert_alike(returned: tuple[Any, ...], expected: tuple[Any, ...]) -> None:
    for ours, theirs in zip(returned[:-1], expected[:-1], strict=True):
        assert (ours.dtype, ours.tolist()) == (theirs.dtype, theirs.tolist())
    ours, theirs = returned[-1], expected[-1]
    assert {key for key in ours if key[0] != "_"} == {key for key in theirs if key[0] != "_"}
    for key in ("captured", "n_captured", "steps"):
        assert ours[key].tolist() == theirs[key].tolist()
    if "final_obs" in theirs:
        mask = theirs["_final_obs"]
        assert ours["_final_obs"].tolist() == ours["_final_info"].tolist() == mask.tolist()
        assert ours["final_obs"][mask].tolist() == [view.tolist() for view in theirs["final_obs"][mask]]
        for key in ("captured", "n_captured", "steps"):
            assert ours["final_info"][key][mask].tolist() == theirs["final_info"][key][mask].tolist()


# -- by hand ------------------------------------------------------------------------------------------------------

# A predator at (0, 0), and a prey at (3, 1) that runs east: after two steps north they are (5, -1) apart on 10 cells,
# which is (-5, -1), 6 of at most 10 steps, and the fitness of that is 20 (1 - 6/10) = 8.
CHASE = {"n_predators": 1, "n_prey": 1, "size": 10, "max_cycles": 2}
APART = {"starts": [[[0, 0], [3, 1]]]}
NORTH = np.array([2])


def test_values_are_bootstrapped_from_the_last_view_of_a_truncated_episode() -> None:
    env = vector_env(1, "predators", "run_straight", SAME_STEP, **CHASE)
    env.reset(seed=0, options=APART)
    views, *_, infos = env.step(NORTH)
    assert views.tolist() == [[4, 0]]
    assert "final_obs" not in infos
    views, rewards, terminated, truncated, infos = env.step(NORTH)
    assert (rewards.tolist(), terminated.tolist(), truncated.tolist()) == ([8], [False], [True])
    assert infos["final_obs"].tolist() == [[-5, -1]]
    assert infos["final_info"]["steps"].tolist() == [2]
    assert infos["steps"].tolist() == [0]
    assert views.tolist() != [[-5, -1]]  # of the next episode
    last = np.where(infos["_final_obs"][:, None], infos["final_obs"], views)
    targets = rewards + 0.5 * last.sum(axis=1) * ~terminated  # were the value of a view the sum of its numbers
    assert targets.tolist() == [8 - 0.5 * 6]


def test_the_step_after_the_end_starts_the_next_episode_and_takes_no_action() -> None:
    env = vector_env(1, "predators", "run_straight", NEXT_STEP, **CHASE)
    env.reset(seed=0, options=APART)
    env.step(NORTH)
    views, rewards, _, truncated, infos = env.step(NORTH)
    assert (views.tolist(), rewards.tolist(), truncated.tolist()) == ([[-5, -1]], [8], [True])
    assert infos["steps"].tolist() == [2]
    views, rewards, terminated, truncated, infos = env.step(NORTH)
    assert (rewards.tolist(), terminated.tolist(), truncated.tolist()) == ([0], [False], [False])
    assert infos["steps"].tolist() == [0]
    other = vector_env(1, "predators", "run_straight", NEXT_STEP, **CHASE)
    other.reset(seed=0, options=APART)
    assert views.tolist() == other.reset()[0].tolist()


@pytest.mark.parametrize("mode", [NEXT_STEP, SAME_STEP, DISABLED])
def test_a_full_catch_terminates_even_at_the_time_limit(mode: AutoresetMode) -> None:
    """In both worlds the time is up after a step; in the second the prey runs into the predator."""
    env = vector_env(2, "prey", "greedy_chase", mode, **CHASE | {"max_cycles": 1})
    env.reset(seed=0, options={"starts": [[[0, 0], [5, 5]], [[0, 0], [2, 0]]]})
    _, rewards, terminated, truncated, infos = env.step(np.array([0, 1]))
    assert (terminated.tolist(), truncated.tolist()) == ([False, True], [True, False])
    assert rewards.tolist() == [25, 12.5]
    told = infos["final_info"] if mode is SAME_STEP else infos
    assert told["captured"].tolist() == [0, 1]


def test_worlds_end_and_start_apart() -> None:
    """The first is over in the second step and starts again; the second plays on."""
    env = vector_env(2, "prey", "greedy_chase", NEXT_STEP, **CHASE | {"max_cycles": 9})
    env.reset(seed=0, options={"starts": [[[0, 0], [4, 0]], [[0, 0], [5, 5]]]})
    steps = [env.step(np.array([1, 0])) for _ in range(4)]
    assert [step[2].tolist() for step in steps] == [[False, False], [True, False], [False, False], [False, False]]
    assert [step[4]["steps"].tolist() for step in steps] == [[1, 1], [2, 2], [0, 3], [1, 4]]


def test_the_mode_may_be_given_by_name() -> None:
    for mode in AutoresetMode:
        env = vector_env(1, "prey", "random", mode.value)
        assert env.autoreset_mode is env.metadata["autoreset_mode"] is mode
    assert vector_env(1, "prey", "random").autoreset_mode is NEXT_STEP


# -- wrappers -----------------------------------------------------------------------------------------------------


@TEAM
@pytest.mark.parametrize("mode", [NEXT_STEP, SAME_STEP])
def test_gymnasium_counts_returns_and_lengths_as_of_its_own(mode: AutoresetMode, team: TeamName) -> None:
    config = TINY.replace(**{"n_predators" if team == "predators" else "n_prey": 1})
    env = RecordEpisodeStatistics(PredPreyVectorEnv(config, 9, team, OPPONENTS[team], mode))
    theirs = RecordEpisodeStatistics(SyncVectorEnv([lambda: OneAgent(config, team)] * 9, autoreset_mode=mode))
    for each in (env, theirs):
        each.reset(seed=2)
    random = np.random.default_rng(0)
    for _ in range(40):
        actions = draw(env, random)
        infos, expected = env.step(actions)[-1], theirs.step(actions)[-1]
        assert ("episode" in infos) == ("episode" in expected)
        if "episode" in infos:
            assert infos["_episode"].tolist() == expected["_episode"].tolist()
            for key in ("r", "l"):
                assert infos["episode"][key].tolist() == expected["episode"][key].tolist()
    assert env.episode_count == theirs.episode_count > 20
    assert list(env.return_queue) == list(theirs.return_queue)


def test_gymnasium_counts_returns_and_lengths_by_hand() -> None:
    """From (4, 0) the prey runs into the chaser in two steps; from (3, 1) it runs away until the time is up."""
    env = RecordEpisodeStatistics(vector_env(2, "prey", "greedy_chase", NEXT_STEP, **CHASE | {"max_cycles": 3}))
    env.reset(seed=0, options={"starts": [[[0, 0], [4, 0]], [[0, 0], [3, 1]]]})
    *_, infos = env.step(np.array([1, 0]))
    assert "episode" not in infos
    *_, infos = env.step(np.array([1, 0]))
    assert infos["_episode"].tolist() == [True, False]
    assert (infos["episode"]["r"][0], infos["episode"]["l"][0]) == (pytest.approx(12.5 * 2 / 3), 2)
    *_, infos = env.step(np.array([1, 0]))
    assert infos["_episode"].tolist() == [False, True]
    assert (infos["episode"]["r"][1], infos["episode"]["l"][1]) == (25, 3)


@pytest.mark.parametrize("mode", [NEXT_STEP, SAME_STEP])
def test_every_info_has_a_mask_of_the_rows_that_have_it(mode: AutoresetMode) -> None:
    env = vector_env(2, "prey", "greedy_chase", mode, **CHASE)
    _, infos = env.reset(seed=0)
    told = [infos, *(env.step(np.array([0, 2]))[-1] for _ in range(3))]
    for each in [*told, *(infos["final_info"] for infos in told if "final_info" in infos)]:
        masks = [each[f"_{key}"] for key in ("captured", "n_captured", "steps")]
        assert [(mask.dtype, mask.tolist()) for mask in masks] == [(np.bool_, [True, True])] * 3


def test_gymnasium_lists_infos_by_row() -> None:
    env = DictInfoToList(vector_env(2, "prey", "greedy_chase", SAME_STEP, **CHASE))
    _, infos = env.reset(seed=0, options={"starts": [[[0, 0], [5, 5]], [[0, 0], [3, 1]]]})
    assert infos == [{"captured": 0, "n_captured": 0, "steps": 0}] * 2
    *_, infos = env.step(np.array([0, 2]))
    assert infos == [{"captured": 0, "n_captured": 0, "steps": 1}] * 2
    *_, infos = env.step(np.array([0, 2]))
    assert infos[0]["final_info"] == {"captured": 0, "n_captured": 0, "steps": 2}
    assert infos[0]["final_obs"].tolist() == [2, 4]  # the chaser went west and south to (9, 9), it east to (7, 5)
    assert infos[0]["steps"] == 0
