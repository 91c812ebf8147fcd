"""Another game than the predator-prey world: what its config says, and which environments can be played."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete, MultiBinary

from esp_trainer.coevolution.sides import new_sides, side_controller, side_shape
from esp_trainer.config import EspConfig, RunConfig, SideConfig
from esp_trainer.game import GameConfig, game_of
from esp_trainer.presets import preset
from predprey_env import EnvConfig

ONE_NETWORK = SideConfig(controller="monolithic")
TAG = GameConfig(environment="mpe2.simple_tag_v3", predators="adversary_", prey="agent_")


class Toy:
    """Two cats and a mouse. Its keyword arguments change what it declares."""

    def __init__(self, names: str = "cat_0 cat_1 mouse_0", seen: Any = (3,), acts: Any = 2, mouse: int = 0) -> None:
        self.possible_agents = names.split()
        spaces = {"image": Box(0, 1, (2, 2)), "short": Box(0, 1, (1,)), "bits": MultiBinary(3)}
        self._seen = None if seen == "none" else spaces.get(seen) or Box(0, 1, (3,))
        self._acts = {"box": Box(0, 1, (2,)), "from 1": Discrete(2, start=1), "one": Discrete(1)}.get(acts, Discrete(2))
        self._alike = not mouse

    def observation_space(self, agent: str) -> Any:
        if self._seen is None:
            raise KeyError(agent)
        return self._seen if self._alike or agent != "cat_1" else Box(0, 1, (4,))

    def action_space(self, agent: str) -> Any:
        return self._acts

    def reset(self, seed: int | None = None) -> Any: ...

    def step(self, actions: dict[str, int]) -> Any: ...


@pytest.fixture(autouse=True)
def _toys(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("toys")
    module.parallel_env = Toy  # type: ignore[attr-defined]
    module.number = 3  # type: ignore[attr-defined]
    module.nothing = lambda: None  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "toys", module)


def toy(**fields: Any) -> GameConfig:
    return GameConfig(**{"environment": "toys", "predators": "cat_", "prey": "mouse_"} | fields)


def test_a_config_of_the_world_is_written_without_the_game() -> None:
    assert "game" in RunConfig.model_fields
    assert list(RunConfig().model_dump()) == [name for name in RunConfig.model_fields if name != "game"]
    assert '"game"' not in RunConfig().model_dump_json()


def test_a_config_of_another_game_is_written_without_the_world_and_read_back() -> None:
    config = RunConfig(game=TAG, predators=ONE_NETWORK, prey=ONE_NETWORK)
    assert "env" not in config.model_dump()
    assert config.model_dump()["game"]["environment"] == "mpe2.simple_tag_v3"
    assert RunConfig.from_dict(config.model_dump()) == config
    assert config.with_fields({"game.options": {"max_cycles": 9}}).game.options == {"max_cycles": 9}


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"env": {"size": 20}}, "env has no meaning in esp_trainer.games.simple_tag, got size=20"),
        (
            {"prey": {"policy": "flee_nearest"}},
            "prey.policy must be esp or random in esp_trainer.games.simple_tag, got 'flee_nearest'",
        ),
        (
            {"predators": {"controller": "split"}},
            (
                "predators.controller must be 'monolithic' in esp_trainer.games.simple_tag: the others read "
                "offsets to opponents; got 'split'"
            ),
        ),
        (
            {"esp": {"fitness_sharing": True}},
            "esp.fitness_sharing must be false in esp_trainer.games.simple_tag: its fitness may be negative",
        ),
        ({"game": {"prey": ""}}, "game.prey must be the beginning of the names of that team's agents, got ''"),
        ({"game": {"environment": ""}}, "game.predators has no meaning without game.environment, got 'adversary_'"),
    ],
)
def test_fields_that_do_not_fit_another_game_are_refused(fields: dict[str, Any], line: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011  # the whole line is compared
        preset("game").with_fields(fields)
    assert str(caught.value) == line


def test_a_side_may_play_at_random() -> None:
    config = preset("game").with_fields({"prey.policy": "random", "esp.past_share": 0})
    assert not hasattr(new_sides(config)["prey"], "algorithm")


def test_the_teams_of_a_game_are_those_of_its_environment() -> None:
    game = game_of(TAG)
    assert game.agents == {"predators": ("adversary_0", "adversary_1", "adversary_2"), "prey": ("agent_0",)}
    assert game.shapes == {"predators": (3, 1, 5, 16), "prey": (1, 3, 5, 14)}
    assert game.words == "3 adversary against 1 agent in mpe2.simple_tag_v3"
    more = game_of(TAG.replace(options={"num_good": 2, "num_obstacles": 0}))
    assert more.shapes == {"predators": (3, 2, 5, 16), "prey": (2, 3, 5, 14)}


def test_an_agent_has_one_network_that_reads_its_whole_observation() -> None:
    config = preset("game")
    assert side_shape(config, "prey") == (1, 3, 5, 14)
    assert side_controller(config, "predators").wiring.tolist() == [list(range(16))]
    assert side_controller(config, "prey").wiring.tolist() == [list(range(14))]
    assert side_controller(RunConfig(esp=EspConfig()), "prey").shape[0] == EnvConfig().n_predators


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"environment": "toys:parallel"}, "game.environment toys:parallel cannot be imported: AttributeError"),
        ({"environment": "no_toys"}, "game.environment no_toys:parallel_env cannot be imported: ModuleNotFoundError"),
        ({"environment": "toys:number"}, "game.environment toys:number must be a function or a class, got int"),
        (
            {"environment": "toys:nothing"},
            "game.environment toys:nothing must be a pettingzoo.ParallelEnv, got one that has no reset() and no step()",
        ),
        ({"options": {"colour": 1}}, "game.environment toys cannot be made: TypeError"),
        ({"prey": "dog_"}, "game.prey must begin the name of an agent of ['cat_0', 'cat_1', 'mouse_0'], got 'dog_'"),
        ({"prey": "cat_1"}, "every agent of toys must be in one team, got cat_1 in both of 'cat_' and 'cat_1'"),
        ({"predators": "cat_0"}, "every agent of toys must be in one team, got cat_1 in none of 'cat_0' and 'mouse_'"),
        (
            {"options": {"names": "cat_1 cat_0 mouse_0"}},
            "the names of the predators must end in _0, _1 and so on, in this order, got ['cat_1', 'cat_0']",
        ),
        (
            {"options": {"names": "cat_0 mouse_x"}},
            "the names of the prey must end in _0, _1 and so on, in this order, got ['mouse_x']",
        ),
        (
            {"options": {"mouse": 1}},
            (
                "the predators of toys must see and act alike, got cat_0 with 3 observed numbers and 2 actions and "
                "cat_1 with 4 observed numbers and 2 actions"
            ),
        ),
        (
            {"options": {"seen": "none"}},
            "toys failed when it was asked for its agents: KeyError: 'cat_0'",
        ),
        ({"options": {"seen": "image"}}, "observations of toys must be vectors, Box(n,), got Box(0.0, 1.0, (2, 2)"),
        ({"options": {"acts": "box"}}, "actions of toys must be Discrete(n), got Box(0.0, 1.0, (2,)"),
        ({"options": {"acts": "from 1"}}, "actions of toys must be Discrete(n), got Discrete(2, start=1) of cat_0"),
        (
            {"options": {"seen": "short"}},
            "a network needs 2 observed numbers and 2 actions, got cat_0 with 1 observed numbers and 2 actions",
        ),
    ],
)
def test_a_game_that_cannot_be_played_is_refused_in_one_line(fields: dict[str, Any], line: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011  # the line is compared
        game_of(toy(**fields))
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)


def test_vectors_of_bits_can_be_observed() -> None:
    assert game_of(toy(options={"seen": "bits"})).shapes["prey"] == (1, 2, 2, 3)
    assert np.isclose(preset("game").prey.input_scale, 1)
