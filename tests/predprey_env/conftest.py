"""What several test files of the environment share: worlds and episodes written by hand, random configurations, and
single environments side by side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from hypothesis import settings
from hypothesis import strategies as st

from predprey_env import EnvConfig, PredPreyEnv, PredPreyVectorEnv, TeamView
from predprey_env.config import SIGHT_OPTIONS
from predprey_env.rules.dynamics import World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from predprey_env.config import TeamName

settings.register_profile("predprey", deadline=None, derandomize=True, max_examples=40)
settings.load_profile("predprey")

# Tiny worlds, in which random walkers meet: `st.from_type(EnvConfig)` draws them.
st.register_type_strategy(
    EnvConfig,
    st.fixed_dictionaries(
        {
            "n_predators": st.integers(1, 4),
            "n_prey": st.integers(1, 3),
            "size": st.integers(3, 9),
            "max_cycles": st.integers(1, 20),
            "move_order": st.sampled_from(["simultaneous", "prey_first"]),
            "swap_captures": st.booleans(),
            "captured_prey": st.sampled_from(["inert", "removed"]),
            "start_collisions": st.sampled_from(["redraw", "allow"]),
            "predator_idle": st.booleans(),
            "closeness": st.sampled_from(["uncaught", "all", "nearest"]),
            "credit": st.sampled_from(["team", "individual"]),
            "prey_fitness": st.sampled_from(["lifespan", "complementary"]),
            "reward": st.sampled_from(["terminal", "dense"]),
            **{name: st.booleans() for name in sorted(SIGHT_OPTIONS - {"mask_actions"})},
        }
    ).map(lambda fields: EnvConfig(**fields)),
)

Cells = list[tuple[int, int]]


class Step(NamedTuple):
    """What `ParallelEnv.step` returns, by name."""

    observations: dict[str, np.ndarray]
    rewards: dict[str, float]
    terminations: dict[str, bool]
    truncations: dict[str, bool]
    infos: dict[str, dict[str, float]]


@pytest.fixture(scope="session")
def make_world() -> Callable[..., World]:
    """``make_world(predators, prey, caught=())``: a world from lists of cells and the indices of caught prey."""

    def make(predators: Cells, prey: Cells, caught: tuple[int, ...] = ()) -> World:
        cells = np.array([*predators, *prey], np.int32)
        alive = np.array([i not in caught for i in range(len(prey))], np.int32)
        return World(cells[:, 0].copy(), cells[:, 1].copy(), alive)

    return make


@pytest.fixture(scope="session")
def play() -> Callable[..., list[Step]]:
    """``play(env, starts, "IE", "WN")``: an episode by hand, one word a step, one letter of EWNSI an agent."""

    def play_words(env: PredPreyEnv, starts: Cells, *words: str) -> list[Step]:
        env.reset(options={"starts": starts})
        letters = [dict(zip(env.possible_agents, word, strict=True)) for word in words]
        return [Step(*env.step({agent: "EWNSI".index(letter[agent]) for agent in env.agents})) for letter in letters]

    return play_words


@pytest.fixture(scope="session")
def play_randomly() -> Callable[..., list[Step]]:
    """``play_randomly(env, seed)``: a whole episode of random actions, all that it returned, the reset first."""

    def episode(env: PredPreyEnv, seed: int, *, reset: bool = True) -> list[Any]:
        actions = np.random.default_rng(seed)
        record: list[Any] = [env.reset(seed=seed)] if reset else []
        while env.agents:
            chosen = {agent: int(actions.integers(env.action_space(agent).n)) for agent in env.agents}
            record.append(Step(*env.step(chosen)))
        return record

    return episode


class Batch(NamedTuple):
    """What a vector environment returns, by name; a row for each agent of each world."""

    observations: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    infos: dict[str, Any]


class Singles:
    """A list of single environments, each started again as :class:`gymnasium.vector.SyncVectorEnv` starts its own."""

    def __init__(self, views: list[TeamView], mode: AutoresetMode | str) -> None:
        self.views, self.mode = views, AutoresetMode(mode)
        self.over = [False] * len(views)
        self.rows: list[list[Any]] = [[] for _ in views]
        self.n_ended = 0

    def reset(self, seeds: list[int | None], starts: Any = None, which: Iterable[int] | None = None) -> Batch:
        """Start the worlds ``which``, all by default."""
        for world in range(len(self.views)) if which is None else which:
            self.start(world, seeds[world], None if starts is None else {"starts": starts[world]})
        return self.batch()

    def start(self, world: int, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        views, infos = self.views[world].reset(seed, options)
        self.over[world] = False
        self.rows[world] = [(views[agent], 0.0, False, False, infos[agent]) for agent in views]

    def step(self, actions: np.ndarray) -> Batch:
        ended: list[int] = []
        for world, (view, chosen) in enumerate(zip(self.views, actions.reshape(len(self.views), -1), strict=True)):
            if self.over[world]:
                assert self.mode is AutoresetMode.NEXT_STEP
                self.start(world)
                continue
            step = view.step(dict(zip(view.agents, chosen.tolist(), strict=True)))
            self.rows[world] = [tuple(part[agent] for part in step) for agent in step[0]]
            self.over[world] = not view.agents
            ended += [world] * self.over[world]
        self.n_ended += len(ended)
        batch = self.batch()
        if ended and self.mode is AutoresetMode.SAME_STEP:
            for world in ended:
                self.start(world)
            fresh = self.batch()
            mask = np.isin(np.arange(len(self.views)), ended).repeat(len(self.rows[0]))
            final = {"final_obs": batch.observations, "final_info": batch.infos}
            infos = fresh.infos | final | {"_final_obs": mask, "_final_info": mask}
            batch = batch._replace(observations=fresh.observations, infos=infos)
        return batch

    def batch(self) -> Batch:
        rows = [row for world in self.rows for row in world]
        seen, *rest, infos = zip(*rows, strict=True)
        told = {key: np.array([info[key] for info in infos]) for key in ("captured", "n_captured")}
        return Batch(np.stack(seen), *(np.array(part) for part in rest), told)

    def agrees(self, returned: tuple[Any, ...], expected: Batch) -> bool:
        """Whether a vector environment returned the same, to the bit; of final values where the mask says so."""
        got = Batch(*returned)
        assert {key for key in got.infos if key[0] != "_"} == {key for key in expected.infos if key[0] != "_"} | {
            "steps"
        }
        parts = list(zip(got[:4], expected[:4], strict=True))
        parts += [(got.infos[key], expected.infos[key]) for key in ("captured", "n_captured")]
        if "final_obs" in expected.infos:
            mask, told = expected.infos["_final_obs"], expected.infos["final_info"]
            parts += [(got.infos[key], mask) for key in ("_final_obs", "_final_info")]
            parts += [(got.infos["final_obs"][mask], expected.infos["final_obs"][mask])]
            parts += [(got.infos["final_info"][key][mask], told[key][mask]) for key in told]
        return all(same_array(a, b) for a, b in parts)


def same_array(a: np.ndarray, b: np.ndarray) -> bool:
    """Bit for bit, of the same type and shape."""
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


@pytest.fixture(scope="session")
def singles() -> Callable[..., Singles]:
    """``singles(config, team, opponent, n_worlds, mode)``: single environments; ``opponent()`` makes each its own."""

    def make(
        config: EnvConfig, team: TeamName, opponent: Callable[[], Any], n_worlds: int, mode: AutoresetMode | str
    ) -> Singles:
        return Singles([TeamView(PredPreyEnv(config), team, opponent()) for _ in range(n_worlds)], mode)

    return make


@pytest.fixture(scope="session")
def same_future() -> Callable[..., bool]:
    """``same_future(env, twin, n_steps=20)``: whether two vector environments of six rows play on alike, through many
    ends and starts and a reset.
    """

    def compare(env: PredPreyVectorEnv, twin: PredPreyVectorEnv, n_steps: int = 20) -> bool:
        records = []
        for each in (env, twin):
            returned = [each.step(np.full(6, step % 4)) for step in range(n_steps)]
            records.append([repr(step) for step in [*returned, each.reset()]])
        return records[0] == records[1]

    return compare
