"""Options of reset(): ours misspelt are refused, in one line; those of others are passed over."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from predprey_env import EnvConfig, predprey_v0, team_view, vector_env
from predprey_env.envs.options import OPTIONS, read_reset_options

SMALL = {"n_predators": 1, "n_prey": 1, "size": 9}
CELLS = [[1, 2], [3, 4]]
SINGLE: dict[str, Callable[[], Any]] = {
    "parallel_env": lambda: predprey_v0.parallel_env(**SMALL),
    "env": lambda: predprey_v0.env(**SMALL),
    "raw_env": lambda: predprey_v0.raw_env(**SMALL),
    "team_view": lambda: team_view("prey", "random", **SMALL),
}
FACES = {**SINGLE, "vector_env": lambda: vector_env(2, "prey", "random", **SMALL)}


@pytest.mark.parametrize(
    "name", ["start", "Starts", "starst", "start_cells", "startingPositions", "Cells", "positions", "strats"]
)
@pytest.mark.parametrize("face", FACES)
def test_a_misspelt_option_is_refused(face: str, name: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        FACES[face]().reset(seed=1, options={name: CELLS})
    assert str(refused.value) == f"unknown reset option {name}; did you mean starts?"


@pytest.mark.parametrize("name", ["reset_mask", "resetmask", "mask"])
@pytest.mark.parametrize("face", FACES)
def test_only_a_vector_environment_has_a_reset_mask(face: str, name: str) -> None:
    env, mask = FACES[face](), np.ones(2, bool)
    if (face, name) == ("vector_env", "reset_mask"):
        env.reset(options={name: mask})
        return
    hint = "did you mean reset_mask?" if face == "vector_env" else "only a vector environment has reset_mask"
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        env.reset(options={name: mask})
    assert str(refused.value) == f"unknown reset option {name}; {hint}"


OTHERS = dict.fromkeys(
    ["restart", "restarts", "warmstart", "", "state", "start_time", "cell_size", "action_mask", "reset"], 1
)


@pytest.mark.parametrize("options", [None, {}, {"starts": None}, {"wind": 3, "curriculum": "hard", 5: 6}, OTHERS])
@pytest.mark.parametrize("face", SINGLE)
def test_options_of_others_are_passed_over(face: str, options: Any) -> None:
    env, twin = SINGLE[face](), SINGLE[face]()
    env.reset(seed=3, options=options)
    twin.reset(seed=3)
    assert env.state().tolist() == twin.state().tolist()


@pytest.mark.parametrize("face", SINGLE)
def test_starts_are_taken_beside_options_of_others(face: str) -> None:
    env = SINGLE[face]()
    env.reset(options={"starts": CELLS, "wind": 3})
    assert env.state().tolist()[:4] == [1, 3, 2, 4]


@pytest.mark.parametrize("face", FACES)
def test_options_that_are_no_mapping_are_refused(face: str) -> None:
    with pytest.raises(ValueError, match=r"^options must be a mapping from names to values, got \['starts'\]$"):
        FACES[face]().reset(options=["starts"])


def test_a_refused_option_leaves_the_episode_as_it_was() -> None:
    env = predprey_v0.parallel_env(**SMALL)
    env.reset(seed=3)
    before, random = env.state().tolist(), env.np_random.bit_generator.state
    with pytest.raises(ValueError, match="did you mean starts"):
        env.reset(seed=4, options={"start": CELLS})
    assert env.state().tolist() == before
    assert env.np_random.bit_generator.state == random


def test_where_nobody_else_has_options_every_unknown_one_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^unknown reset option wind; there are starts and reset_mask$"):
        read_reset_options({"starts": CELLS, "wind": 3}, OPTIONS, only_ours=True)
    assert read_reset_options({"starts": CELLS}, OPTIONS, only_ours=True) == {"starts": CELLS}


def test_no_field_of_the_config_is_taken_for_an_option() -> None:
    """Wrappers that hand a config's fields to reset() are not ours to judge."""
    fields = EnvConfig().model_dump()
    fields.pop("start_collisions")
    assert read_reset_options(fields) == fields
