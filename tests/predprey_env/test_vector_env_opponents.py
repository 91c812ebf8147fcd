"""Who can play the other team in many worlds at once: compiled, asked one by one, or asked all at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from esp_trainer import Team
from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from predprey_env import EnvConfig, PredPreyVectorEnv
from predprey_env.agents import other_team
from predprey_env.config import TEAMS, TeamName
from predprey_env.envs.worlds import move_opponents
from predprey_env.jit.compilation import rule
from predprey_env.jit.lanes import load, store
from predprey_env.policies import SCRIPTS, ScriptedTeam
from predprey_env.policies.protocol import choose, memory_rows
from predprey_env.sight import PLAIN_SIGHT, Sight

SMALL = EnvConfig(n_predators=3, n_prey=2, size=6, max_cycles=9, reward="dense")
TEAM = pytest.mark.parametrize("team", TEAMS)
ORDER = pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
N_WORLDS = 18
Singles = Callable[..., Any]


def agree(singles: Singles, config: EnvConfig, team: TeamName, many: Any, one: Callable[[], Any]) -> PredPreyVectorEnv:
    """Assert that an opponent plays in many worlds as another, made for each, does in single ones."""
    env = PredPreyVectorEnv(config, N_WORLDS, team, many, AutoresetMode.SAME_STEP)
    alone = singles(config, team, one, N_WORLDS, AutoresetMode.SAME_STEP)
    views, _ = env.reset(seed=1)
    assert views.tolist() == alone.reset(range(1, 1 + N_WORLDS)).observations.tolist()
    random = np.random.default_rng(0)
    for _ in range(30):
        actions = random.integers(0, env.single_action_space.n, env.num_envs)
        assert alone.agrees(env.step(actions), alone.step(actions))
    assert alone.n_ended > 2 * N_WORLDS
    return env


# -- compiled -----------------------------------------------------------------------------------------------------


def evolved(
    team: TeamName, controller: str = "split", sight: Sight = PLAIN_SIGHT, network: str = "feedforward"
) -> Team:
    shape, side = SMALL.team(team), SideConfig(controller=controller, network=network)
    wiring = wiring_for(side, shape.n_opponents, shape.n_agents, sight)
    made = make_controller(side, wiring, shape.n_actions, shape.n_agents, sight)
    genomes = np.random.default_rng(3).normal(size=(shape.n_agents // made.n_together, *made.shape))
    return Team(team, side, made, genomes.astype(np.float32))


@pytest.mark.parametrize("controller", ["split", "monolithic", "central"])
@ORDER
@TEAM
def test_an_evolved_team_plays_in_compiled_code_as_it_does_when_asked(
    singles: Singles, team: TeamName, move_order: str, controller: str
) -> None:
    opponent = evolved(other_team(team), controller)
    agree(singles, SMALL.replace(move_order=move_order), team, opponent, lambda: opponent.act)


@pytest.mark.slow  # compiles another kernel for each team
@TEAM
def test_a_team_that_remembers_plays_in_compiled_code_as_it_does_when_asked(singles: Singles, team: TeamName) -> None:
    opponent = evolved(other_team(team), network="elman")
    agree(singles, SMALL, team, opponent, lambda: deepcopy(opponent))


@pytest.mark.slow
def test_opponents_that_remember_can_take_over_and_be_drawn(singles: Singles) -> None:
    """They need more memory than those before them, and those go on as if nothing had happened."""
    config, pool = SMALL.replace(max_cycles=40), [evolved("prey", network="elman"), "run_straight"]
    env, other = (PredPreyVectorEnv(config, N_WORLDS, "predators", "run_straight") for _ in range(2))
    env.reset(seed=1)
    other.reset(seed=1)
    with pytest.raises(ValueError, match=r"^script must be one of"):
        env.set_opponent([pool[0], "no_such_script"])
    actions = np.random.default_rng(0).integers(0, 5, (20, env.num_envs))
    for chosen in actions[:5]:
        assert env.step(chosen)[0].tolist() == other.step(chosen)[0].tolist()
    env.set_opponent(pool)
    for chosen in actions[5:]:
        env.step(chosen)
    fresh = PredPreyVectorEnv(config, N_WORLDS, "predators", pool)
    assert env.reset(seed=3)[0].tolist() == fresh.reset(seed=3)[0].tolist()
    for chosen in actions:
        assert env.step(chosen)[0].tolist() == fresh.step(chosen)[0].tolist()


@ORDER
@TEAM
def test_an_evolved_team_sees_what_it_evolved_with_whatever_the_world_shows(
    singles: Singles, team: TeamName, move_order: str
) -> None:
    world = SMALL.replace(move_order=move_order, see_moves=True, see_nearest_first=True)
    opponent = evolved(other_team(team), sight=Sight(teammates=True, moves=True, scaled=True))
    agree(singles, world, team, opponent, lambda: opponent)
    agree(singles, world, team, ByHand(opponent), lambda: opponent)


class ByHand:
    """A policy that the vector environment knows nothing of but what it wants to see."""

    def __init__(self, team: Team) -> None:
        self.sight, self.reset, self.act = team.sight, team.reset, team.act


class Compass(NamedTuple):
    """A player that goes east, west, north and south in turn, from where its seed says."""

    n_directions: int


@rule
def _turn(player: Compass, agent: int, seen: Any, memory: Any, at: int) -> Any:
    count = load(memory, at + 3) + 1
    store(memory, at + 3, count)
    return (load(memory, at) + count + agent) & (player.n_directions - 1)


class CompassTeam:
    """A policy of one's own that can be compiled."""

    def reset(self, seed: int | None = None) -> None:
        raise AssertionError("compiled players are not asked")

    act = reset

    def compiled(self, team: TeamName, env: EnvConfig, lanes: int) -> Compass:
        assert lanes in (0, 16)
        return Compass(4)


@pytest.fixture
def compass() -> Iterator[CompassTeam]:
    """Machine code for a class that lives in a test is not kept on disk."""
    choose.register(Compass, _turn)
    move_opponents._cache.disable()
    yield CompassTeam()
    move_opponents._cache.enable()


def test_a_player_of_ones_own_plays_in_compiled_code(compass: CompassTeam) -> None:
    """Each prey walks round a square, seen from a predator that stands still."""
    env = PredPreyVectorEnv(SMALL.replace(size=20, n_predators=1), N_WORLDS, "predators", compass)
    starts = np.tile([[0, 0], [5, 5], [8, 5]], (N_WORLDS, 1, 1))
    views, _ = env.reset(seed=1, options={"starts": starts})
    steps = [views]
    for _ in range(8):
        views, *_ = env.step(np.full(N_WORLDS, 4))
        steps.append(views)
    moves = np.diff(np.stack(steps), axis=0).reshape(8, N_WORLDS, 2, 2)
    directions = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
    taken = (moves[:, :, :, None] == directions).all(axis=4).argmax(axis=3)
    assert (np.abs(moves).sum(axis=3) == 1).all()
    assert (np.diff(taken, axis=0) % 4 == 1).all()
    assert len(np.unique(taken[0, :, 0])) == 4  # each world has its own seed


# -- asked one by one ---------------------------------------------------------------------------------------------


class Counter:
    """A policy with a memory: a step further round the compass each time, from where its seed says."""

    def __init__(self) -> None:
        self.count = 0
        self.n_resets = 0

    def reset(self, seed: int | None = None) -> None:
        assert type(seed) is int
        assert 0 <= seed < 2**31
        self.count = seed
        self.n_resets += 1

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        self.count += 1
        return {agent: (self.count + i) % 4 for i, agent in enumerate(observations)}


@ORDER
@TEAM
def test_each_world_has_its_own_copy_of_a_policy(singles: Singles, team: TeamName, move_order: str) -> None:
    policy = Counter()
    agree(singles, SMALL.replace(move_order=move_order), team, policy, Counter)
    assert (policy.count, policy.n_resets) == (0, 0)  # it is theirs, not the caller's


@ORDER
@TEAM
def test_a_function_is_asked_in_every_world(singles: Singles, team: TeamName, move_order: str) -> None:
    def nearest_corner(views: dict[str, np.ndarray]) -> dict[str, int]:
        return {agent: int(np.abs(view).sum() * 7) % 4 for agent, view in views.items()}

    agree(singles, SMALL.replace(move_order=move_order), team, nearest_corner, lambda: nearest_corner)


def test_policies_see_what_agents_see_by_name() -> None:
    asked = []

    def idle(views: dict[str, np.ndarray]) -> dict[str, int]:
        asked.append({agent: view.copy() for agent, view in views.items()})
        for view in views.values():
            view[:] = 99  # which harms nobody
        return dict.fromkeys(views, 4)

    env = PredPreyVectorEnv(SMALL.replace(size=20, n_predators=2), 2, "prey", idle)
    env.reset(seed=0, options={"starts": [[[0, 0], [1, 0], [3, 2], [0, 5]], [[0, 0], [9, 9], [1, 0], [19, 0]]]})
    for _ in range(2):
        env.step(np.array([0, 0, 0, 0]))
    assert [{agent: view.tolist() for agent, view in views.items()} for views in asked] == [
        {"predator_0": [3, 2, 0, 5], "predator_1": [2, 2, -1, 5]},
        {"predator_0": [1, 0, -1, 0], "predator_1": [-8, -9, -10, -9]},
        {"predator_0": [4, 2, 1, 5], "predator_1": [3, 2, 0, 5]},
        {"predator_0": [2, 0, 0, 0], "predator_1": [-7, -9, 0, 0]},  # the second prey ran into it
    ]
    assert {view.dtype for views in asked for view in views.values()} == {np.dtype(np.float32)}


def test_a_policy_is_not_asked_in_worlds_that_are_over() -> None:
    asked = []

    def idle(views: dict[str, np.ndarray]) -> dict[str, int]:
        asked.append(len(asked))
        return dict.fromkeys(views, 4)

    env = PredPreyVectorEnv(SMALL.replace(n_predators=1, n_prey=1, size=20), 3, "prey", idle)
    env.reset(seed=0, options={"starts": [[[0, 0], [1, 0]], [[0, 0], [5, 5]], [[0, 0], [9, 9]]]})
    numbers = []
    for _ in range(4):  # the first prey is caught at once, and a step later starts again
        env.step(np.array([1, 0, 0]))
        numbers.append(len(asked))
    assert np.diff([0, *numbers]).tolist() == [3, 2, 3, 3]


# -- asked all at once --------------------------------------------------------------------------------------------


class Batched:
    """A policy that answers for all worlds at once; greedy, by numpy alone."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, ...]] = []

    def reset(self, seed: int | None = None) -> None:
        """Nothing to forget."""

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        return {agent: int(self.choose(view[None, None])[0, 0]) for agent, view in observations.items()}

    def act_batch(self, observations: np.ndarray) -> np.ndarray:
        self.asked.append((observations.dtype, observations.shape))
        actions = self.choose(observations)
        observations[:] = 99  # which harms nobody
        return actions

    def choose(self, views: np.ndarray) -> np.ndarray:
        x, y = views[..., 0], views[..., 1]
        return np.where(np.abs(x) >= np.abs(y), np.where(x > 0, 0, 1), np.where(y > 0, 2, 3))


@ORDER
@TEAM
def test_a_policy_that_can_is_asked_for_all_worlds_at_once(singles: Singles, team: TeamName, move_order: str) -> None:
    policy, shape = Batched(), SMALL.team(other_team(team))
    agree(singles, SMALL.replace(move_order=move_order), team, policy, Batched)
    assert set(policy.asked) == {(np.dtype(np.float32), (N_WORLDS, shape.n_agents, 2 * shape.n_opponents))}
    if move_order == "simultaneous":
        assert len(policy.asked) == 30


@pytest.mark.parametrize("kind", [np.uint8, np.int32, np.int64, lambda actions: actions.tolist()])
def test_a_batch_of_any_integers_is_read(singles: Singles, kind: Callable[[Any], Any]) -> None:
    policy = Batched()
    choose_plain = policy.choose
    policy.choose = lambda views: kind(choose_plain(views))
    agree(singles, SMALL, "prey", policy, Batched)


# -- who is refused -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("opponent", [None, 3, {"random"}, ["random", 3], [["random"]]])
def test_what_is_no_opponent_is_refused(opponent: Any) -> None:
    with pytest.raises(ValueError, match=r"^opponent must be the name of a script, a policy .*, got [^\n]*$"):
        PredPreyVectorEnv(SMALL, 2, "prey", opponent)


@TEAM
def test_a_script_of_the_wrong_team_is_refused(team: TeamName) -> None:
    script = SCRIPTS[team][1]
    with pytest.raises(ValueError, match=f"^script must be one of random, .*, got '{script}'$"):
        PredPreyVectorEnv(SMALL, 2, team, script)
    line = f"^expected {other_team(team)}, got {script}, a script of {team}$"
    with pytest.raises(ValueError, match=line):
        PredPreyVectorEnv(SMALL, 2, team, ScriptedTeam(script))


@TEAM
def test_an_evolved_team_that_does_not_fit_is_refused(team: TeamName) -> None:
    """Compiled code would read beyond its arrays."""
    with pytest.raises(ValueError, match=f"^expected {other_team(team)}, got a team of {team}$"):
        PredPreyVectorEnv(SMALL, 2, team, evolved(team))
    more = SMALL.replace(n_predators=4, n_prey=3)
    with pytest.raises(ValueError, match=r"^this world has \d \w+, got a team of \d$"):
        PredPreyVectorEnv(more, 2, team, evolved(other_team(team)))


def test_a_script_with_other_actions_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^predators have 4 actions in this world, got a team with 5$"):
        PredPreyVectorEnv(SMALL.replace(predator_idle=False), 2, "prey", ScriptedTeam("parity_chase"))


class Greedy(NamedTuple):
    """A player whose memory cannot be told."""

    n_actions: int


def test_the_old_opponents_stay_where_the_memory_of_new_ones_cannot_be_told() -> None:
    class Refuses(CompassTeam):
        def compiled(self, team: TeamName, env: EnvConfig, lanes: int) -> Any:
            return Greedy(4)

    choose.register(Greedy, _turn)
    memory_rows.register(Greedy, lambda player: player.n_rows)
    env = PredPreyVectorEnv(SMALL, N_WORLDS, "predators", "run_straight")
    env.reset(seed=1)
    with pytest.raises(AttributeError, match="n_rows"):
        env.set_opponent(Refuses())
    other = PredPreyVectorEnv(SMALL, N_WORLDS, "predators", "run_straight")
    other.reset(seed=1)
    actions = np.zeros(env.num_envs, int)
    assert env.step(actions)[0].tolist() == other.step(actions)[0].tolist()
