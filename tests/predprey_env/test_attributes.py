"""What is set on an environment has an effect or is refused; and the attributes that Gymnasium's environments have."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from predprey_env import EnvConfig, parallel_env, team_view, vector_env
from predprey_env.policies import ScriptedTeam

SMALL = {"size": 9, "max_cycles": 5}
FACES: dict[str, Callable[[], Any]] = {
    "parallel_env": lambda: parallel_env(**SMALL),
    "team_view": lambda: team_view("prey", "random", **SMALL),
    "vector_env": lambda: vector_env(2, "prey", "random", **SMALL),
}
FIELDS = [name for name in EnvConfig.model_fields if name != "max_cycles"]
READ_ONLY = [
    *[(face, "config") for face in FACES],
    *[("team_view", name) for name in ("team", "env")],
    *[
        ("vector_env", name)
        for name in ("team", "n_worlds", "num_envs", "metadata", "observation_space", "action_space")
    ],
    *[("vector_env", f"single_{name}_space") for name in ("observation", "action")],
]


# -- set ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("face", "name"), READ_ONLY)
def test_what_an_environment_was_made_with_is_read_only(face: str, name: str) -> None:
    env = FACES[face]()
    before = getattr(env, name)
    with pytest.raises(AttributeError, match=f"^{name} is read-only; make another environment$"):
        setattr(env, name, 3)
    assert getattr(env, name) is before


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("face", FACES)
def test_a_field_of_the_config_is_a_read_only_attribute(face: str, name: str) -> None:
    env = FACES[face]()
    assert getattr(env, name) == getattr(EnvConfig(**SMALL), name)
    with pytest.raises(AttributeError, match=f"^{name} is read-only; make another environment with {name}=\\.\\.\\.$"):
        setattr(env, name, 3)


@pytest.mark.parametrize("face", ["team_view", "vector_env"])
def test_the_opponent_is_read_only_and_the_error_names_the_way(face: str) -> None:
    env = FACES[face]()
    before = env.opponent
    with pytest.raises(AttributeError, match=r"^opponent is read-only; call set_opponent\(opponent\)$"):
        env.opponent = ScriptedTeam("surround")
    assert env.opponent is before
    env.set_opponent("surround")
    assert env.opponent.script == "surround"


@pytest.mark.parametrize("face", FACES)
def test_the_time_limit_can_be_set(face: str) -> None:
    env = FACES[face]()
    env.max_cycles = np.int64(2)
    assert (env.max_cycles, env.config) == (2, EnvConfig(size=9, max_cycles=2))
    env.reset(seed=1, options={"starts": [[[0, 0]] * 3 + [[4, 4]] * 2] * 2} if face == "vector_env" else None)
    with pytest.raises(ValueError, match=r"^max_cycles must be at least 1, got 0$"):
        env.max_cycles = 0
    assert env.max_cycles == 2


def test_in_many_worlds_the_time_limit_counts_at_once() -> None:
    envs = vector_env(2, "prey", lambda views: dict.fromkeys(views, 4), **SMALL)
    envs.reset(options={"starts": [[[0, 0]] * 3 + [[4, 4]] * 2] * 2})
    stay = [0, 1] * 2  # a prey always moves: one to the east, one to the west
    assert not envs.step(np.array(stay))[3].any()
    envs.max_cycles = 2
    assert envs.step(np.array(stay))[3].all()


@pytest.mark.parametrize("face", ["parallel_env", "team_view"])
def test_a_time_limit_below_the_steps_played_ends_the_episode_with_the_next(face: str) -> None:
    env = FACES[face]()
    env.reset(seed=1, options={"starts": [[0, 0]] * 3 + [[4, 4]] * 2})
    for _ in range(2):
        env.step(dict.fromkeys(env.agents, 0))
    env.max_cycles = 1
    inner = getattr(env, "env", env)
    assert env.state()[-1] == 1
    assert env.state() in inner.state_space
    assert all(env.step(dict.fromkeys(env.agents, 0))[3].values())
    assert (env.agents, env.state()[-1]) == ([], 1)


def test_the_render_mode_can_be_set() -> None:
    env = parallel_env(**SMALL)
    view = team_view("prey", "random", **SMALL)
    for each in (env, view):
        each.reset(seed=1)
        assert each.render() is None
        each.render_mode = "ansi"
        assert isinstance(each.render(), str)
        with pytest.raises(ValueError, match=r"^render_mode must be None or one of human, ansi, rgb_array, got 'rgb'$"):
            each.render_mode = "rgb"
        assert each.render_mode == "ansi"
    with pytest.raises(
        AttributeError, match=r"^render_mode is read-only; make another environment with render_mode=\.\.\.$"
    ):
        FACES["vector_env"]().render_mode = "ansi"


@pytest.mark.parametrize("face", FACES)
def test_other_attributes_can_be_set(face: str) -> None:
    env = FACES[face]()
    env.note = "kept"
    for twin in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        assert (twin.note, twin.config, twin.size) == ("kept", env.config, 9)


# -- autoreset ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_autoreset_mode_is_taken_by_name_and_by_value(mode: AutoresetMode) -> None:
    for spelt in (mode, mode.name, mode.value, mode.name.lower(), mode.value.lower()):
        envs = vector_env(2, "prey", "random", spelt, **SMALL)
        assert envs.autoreset_mode is envs.metadata["autoreset_mode"] is mode
        other = vector_env(2, "prey", "random", **SMALL)
        other.autoreset_mode = spelt
        assert other.autoreset_mode is other.metadata["autoreset_mode"] is mode


@pytest.mark.parametrize("mode", ["Sometimes", "", None, 1, "same step", b"SameStep"])
def test_an_unknown_autoreset_mode_is_refused(mode: Any) -> None:
    line = "autoreset_mode must be one of NextStep, SameStep, Disabled, got "
    envs = vector_env(2, "prey", "random", **SMALL)
    for use in (lambda: vector_env(2, "prey", "random", mode), lambda: setattr(envs, "autoreset_mode", mode)):
        with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
            use()
        assert str(refused.value) == f"{line}{mode!r}"


def test_the_autoreset_mode_is_kept_once_worlds_have_started() -> None:
    envs = vector_env(2, "prey", "random", **SMALL)
    envs.autoreset_mode = "SAME_STEP"
    envs.reset(seed=1)
    for _ in range(5):
        *_, infos = envs.step(np.zeros(4, int))
    assert "final_obs" in infos
    envs.autoreset_mode = "SameStep"  # as it is
    line = r"^autoreset_mode cannot change after the first reset\(\): make the environment with 'Disabled'$"
    with pytest.raises(ValueError, match=line):
        envs.autoreset_mode = "DISABLED"
    assert envs.autoreset_mode is envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


# -- seeds --------------------------------------------------------------------------------------------------------


class OneAgent(gymnasium.Env):
    """Gymnasium's own way with seeds, to compare with."""

    observation_space = action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        return 0, {}


def test_seeds_of_many_worlds_are_those_of_gymnasiums_vector_environments() -> None:
    envs, gymnasiums = vector_env(3, "prey", "random", **SMALL), SyncVectorEnv([OneAgent] * 3)
    expected = [(5, (5, 6, 7)), (None, (5, 6, 7)), ([7, 8, 9], (7, 8, 9)), ([None, 3, None], (7, 3, 9))]
    for seed, seeds in expected:
        envs.reset(seed=seed)
        gymnasiums.reset(seed=seed)
        assert envs.np_random_seed == gymnasiums.np_random_seed == seeds
        assert type(envs.np_random) is type(gymnasiums.np_random) is tuple


def test_equal_seeds_give_equal_draws_in_many_worlds() -> None:
    one, two, other = (vector_env(3, "prey", "random", **SMALL) for _ in range(3))
    for envs, seed in ((one, 5), (two, 5), (other, 6)):
        envs.reset(seed=seed)
    drawn = [[generator.random() for generator in envs.np_random] for envs in (one, two, other)]
    assert drawn[0] == drawn[1]
    assert drawn[1][1:] == drawn[2][:2]  # world 1 of seed 5 is world 0 of seed 6
    assert one.reset()[0].tolist() == two.reset()[0].tolist()


def test_seeds_that_nobody_gave_can_be_given_again() -> None:
    envs, twin = (vector_env(3, "prey", "random", **SMALL) for _ in range(2))
    first = envs.reset()[0]
    assert len(set(envs.np_random_seed)) == 3
    assert twin.reset(seed=envs.np_random_seed)[0].tolist() == first.tolist()


def test_a_refused_seed_leaves_the_seeds_as_they_were() -> None:
    envs = vector_env(3, "prey", "random", **SMALL)
    envs.reset(seed=5)
    with pytest.raises(Exception, match="-1"):
        envs.reset(seed=[1, 2, -1])
    assert envs.np_random_seed == (5, 6, 7)


@pytest.mark.parametrize("face", ["parallel_env", "team_view"])
def test_a_single_environment_has_its_seed(face: str) -> None:
    env, twin = FACES[face](), FACES[face]()
    for seed in (5, np.int64(6)):
        env.reset(seed=seed)
        assert env.np_random_seed == seed
        env.reset()
        assert env.np_random_seed == seed
    unseeded = FACES[face]()
    unseeded.reset()
    twin.reset(seed=unseeded.np_random_seed)
    assert unseeded.state().tolist() == twin.state().tolist()


@pytest.mark.parametrize("seed", [3, np.int64(3), np.array(3), np.uint8(3), True, np.bool_(True), np.array(True)])
@pytest.mark.parametrize("face", FACES)
def test_a_seed_is_the_number_that_it_holds(face: str, seed: Any) -> None:
    env, twin = FACES[face](), FACES[face]()
    env.reset(seed=seed)
    twin.reset(seed=int(seed))
    assert env.np_random_seed == twin.np_random_seed == ((int(seed), int(seed) + 1) if face == "vector_env" else seed)
    if face == "vector_env":
        env.reset(seed=[seed, seed])
        assert env.np_random_seed == (int(seed), int(seed))
