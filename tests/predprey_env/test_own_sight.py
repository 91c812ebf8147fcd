"""Observations of one's own: in every face of the environment, and in evolved teams."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from wide_sight import WIDE, WIDTH, Wide

from esp_trainer.cli import main
from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides, side_controller
from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.reference import predprey_reference
from esp_trainer.exact.chances import views
from esp_trainer.files import DamagedFileError
from esp_trainer.presets import preset
from esp_trainer.types import PolicyError
from predprey_env import (
    EnvConfig,
    observe,
    offset_to,
    parallel_env,
    parallel_vector_env,
    team_view,
    vector_env,
)
from predprey_env.jit import as_float, rule, store
from predprey_env.policies import ScriptedTeam
from predprey_env.rules.observation import offsets_seen
from predprey_env.sight import Sight, options_of

HERE = __name__
TINY = {"n_predators": 3, "n_prey": 2, "size": 7, "max_cycles": 12}


class Still(NamedTuple):
    """The offsets alone, of which it says that they are not of moves."""

    factor: float = 1.0
    moves = False

    def n_seen(self, n_agents: int, n_opponents: int) -> int:
        return 2 * n_opponents

    def groups(self, n_agents: int, n_opponents: int) -> list[list[int]]:
        return [[2 * i, 2 * i + 1] for i in range(n_opponents)]

    def bounds(self, n_agents: int, n_opponents: int, size: int) -> tuple[int, int]:
        return -size, size


@observe.register(Still)
@rule
def still(sight: Any, world: Any, moved: Any, agent: int, rules: Any, out: Any, row: int) -> int:
    hunts = agent < rules.n_predators
    first, n_opponents = (rules.n_predators, rules.n_prey) if hunts else (0, rules.n_predators)
    for other in range(first, first + n_opponents):
        dx, dy = offset_to(world, agent, other, rules)
        store(out, row, as_float(dx))
        store(out, row + 1, as_float(dy))
        row += 2
    return row


def sides(config: RunConfig) -> RunConfig:
    return config.replace(
        generations=2,
        env=config.env.replace(**TINY, observation=WIDE),
        esp=config.esp.replace(n_trials=40, n_episodes=2),
        champion=config.champion.replace(n_candidates=3, n_held_out=8),
    )


# -- the environment -----------------------------------------------------------------------------------------------


def test_agents_see_what_the_rule_writes() -> None:
    env = parallel_env(**TINY, observation=WIDE)
    starts = np.array([[0, 0], [3, 3], [6, 6], [1, 2], [5, 0]])
    observations, _ = env.reset(options={"starts": starts})
    assert observations["predator_0"].reshape(2, WIDTH)[:, :4].tolist() == [[0.5, 1, 0, 0], [-1, 0, 0, 0]]
    observations, *_ = env.step({"predator_0": 4, "predator_1": 4, "predator_2": 4, "prey_0": 2, "prey_1": 0})
    assert observations["predator_0"].reshape(2, WIDTH)[:, :4].tolist() == [[0.5, 1.5, 0, 1], [-0.5, 0, 1, 0]]
    space = env.observation_space("prey_1")
    assert (space.shape, space.low.min(), space.high.max()) == ((3 * WIDTH,), -7, 7)
    assert all(env.observation_space(agent).contains(seen) for agent, seen in observations.items())


@pytest.mark.slow
def test_many_worlds_and_team_views_see_as_single_worlds_do() -> None:
    observation = WIDE
    single = team_view("prey", opponent="surround", **TINY, observation=observation)
    many = vector_env(5, "prey", opponent="surround", **TINY, observation=observation)
    both = parallel_vector_env(5, **TINY, observation=observation)
    seen, _ = single.reset(seed=3)
    rows, _ = many.reset(seed=3)
    teams, _ = both.reset(seed=3)
    assert np.array_equal(np.stack([*seen.values()]), rows[:2])
    assert np.array_equal(teams["prey_1"][0], rows[1])
    for action in (0, 2, 3, 1):
        seen, *_ = single.step(dict.fromkeys(single.agents, action))
        rows, *_ = many.step(np.full(10, action))
        if not single.agents:
            break
        assert np.array_equal(np.stack([*seen.values()]), rows[:2])


@pytest.mark.slow
def test_an_opponent_sees_in_its_own_way_in_a_plain_world() -> None:
    """Scratch for observations grows to what an opponent needs."""
    config = sides(preset("paper-3v2"))
    hunters = champion(config)
    plain = {**TINY, "observation": "offsets"}
    many = vector_env(4, "prey", opponent=hunters, **plain)
    single = team_view("prey", opponent=hunters, **plain)
    rows, _ = many.reset(seed=1)
    seen, _ = single.reset(seed=1)
    for _ in range(6):
        assert np.array_equal(np.stack([*seen.values()]), rows[:2])
        rows, *_ = many.step(np.zeros(8, int))
        seen, *_ = single.step(dict.fromkeys(single.agents, 0))
        if not single.agents:
            break
    script = ScriptedTeam.of("flee_nearest", "prey", EnvConfig(**TINY, observation=WIDE))
    many = vector_env(2, "predators", opponent=script, **TINY, observation=WIDE)
    assert many.reset(seed=0)[0].shape == (6, 2 * WIDTH)


# -- evolved teams -------------------------------------------------------------------------------------------------


def champion(config: RunConfig) -> Team:
    controller = side_controller(config, "predators")
    genomes = np.random.default_rng(0).normal(0, 1, (3, *controller.shape)).astype(np.float32)
    return Team("predators", config.predators, controller, genomes, {"env": config.env.model_dump()})


@pytest.mark.slow
def test_both_evaluators_play_the_same() -> None:
    config = sides(preset("paper-3v2")).replace(prey=SideConfig(controller="monolithic"))
    evaluators = FusedEvaluator(config.env), predprey_reference(config.env)
    found = []
    for evaluator in evaluators:
        run = Coevolution(config, new_sides(config), evaluator)
        generation = run.step(0)
        found.append([generation.trials[role].fitness.tobytes() for role in generation.trials])
    assert found[0] == found[1]


def test_a_team_keeps_its_sight_in_its_file(tmp_path: Path) -> None:
    config = sides(preset("paper-3v2"))
    team = champion(config)
    team.save(tmp_path / "team.safetensors")
    loaded = Team.load(tmp_path / "team.safetensors")
    assert loaded.sight == Wide()
    loaded.check_fits("predators", EnvConfig(**TINY))
    with pytest.raises(ValueError, match=r"^this world has 3 prey, got predators evolved against 2$"):
        loaded.check_fits("predators", EnvConfig(**{**TINY, "n_prey": 3}))


class Blurred(Sight):
    """The paper's observation as a class of its own, which may have another rule."""


observe.register(Blurred, offsets_seen)


def test_a_class_derived_from_the_papers_observation_is_another(tmp_path: Path) -> None:
    env = EnvConfig(observation=f"{HERE}:Blurred")
    assert type(EnvConfig(**options_of(env.sight)).sight) is Blurred
    champion(preset("paper-3v2").replace(env=env)).save(tmp_path / "team.safetensors")
    assert type(Team.load(tmp_path / "team.safetensors").sight) is Blurred


def test_a_team_whose_sight_is_gone_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    champion(sides(preset("paper-3v2"))).save(tmp_path / "team.safetensors")
    monkeypatch.delattr("wide_sight.Wide")
    with pytest.raises(DamagedFileError, match=r"observation .*:Wide cannot be imported: AttributeError"):
        Team.load(tmp_path / "team.safetensors")


@pytest.mark.slow
def test_runs_resume_to_the_same_bytes(tmp_path: Path) -> None:
    options = ["--quiet", "--env.observation", WIDE, "--esp.n_trials", "40"]
    for name, generations in (("whole", "4"), ("resumed", "2")):
        assert main(["train", "smoke", "--out", str(tmp_path / name), "--generations", generations, *options]) == 0
    assert main(["resume", str(tmp_path / "resumed"), "--generations", "4", "--quiet"]) == 0
    whole, resumed = ((tmp_path / name / "metrics.jsonl").read_bytes() for name in ("whole", "resumed"))
    assert whole == resumed


def test_positions_hold_no_last_moves() -> None:
    small = EnvConfig(n_predators=1, n_prey=1, size=3)
    seen = views(small, "predators", Still())
    assert np.array_equal(seen, views(small, "predators"))
    with pytest.raises(PolicyError, match=r"^a policy that observes the last moves cannot be solved for"):
        views(small, "predators", Wide())


# -- what is refused ---------------------------------------------------------------------------------------------------


class Unruly(NamedTuple):
    factor: float = 1.0
    n_seen = groups = bounds = Still.n_seen


class Bare(NamedTuple):
    factor: float = 1.0


class Undecided(NamedTuple):
    factor: float
    n_seen = groups = bounds = Still.n_seen


class Short(Still):
    def n_seen(self, n_agents: int, n_opponents: int) -> int:
        return 1


class Beyond(Still):
    def groups(self, n_agents: int, n_opponents: int) -> list[list[int]]:
        return [[0, 99]]


class Reversed(Still):
    def bounds(self, n_agents: int, n_opponents: int, size: int) -> tuple[int, int]:
        return 1, -1


class Raising(Still):
    def bounds(self, n_agents: int, n_opponents: int, size: int) -> tuple[int, int]:
        raise KeyError("size")


class Half(Still):
    def n_seen(self, n_agents: int, n_opponents: int) -> float:
        return 2.0


class Flat(Still):
    def groups(self, n_agents: int, n_opponents: int) -> list[int]:
        return [0, 1]


class Single(Still):
    def bounds(self, n_agents: int, n_opponents: int, size: int) -> int:
        return size


class Few(Still):
    pass


@rule
def few(sight: Any, world: Any) -> int:
    return 0


for _class in (Undecided, Short, Beyond, Reversed, Raising, Half, Flat, Single):
    observe.register(_class, still)
observe.register(Few, few)


WRONG = """
    ofsets: must be one of offsets or module:Class, got 'ofsets'; did you mean offsets?
    nowhere:Near: observation nowhere:Near cannot be imported: ModuleNotFoundError: No module named 'nowhere'
    HERE:TINY: observation HERE:TINY must be a class, got dict
    HERE:Bare: observation HERE:Bare has no n_seen() and no groups() and no bounds()
    HERE:Undecided: observation HERE:Undecided must have a default for each field, got none for factor
    HERE:Unruly: observation HERE:Unruly has no rule: put @observe.register(Unruly) above it
    HERE:Few: the rule of observation HERE:Few must take sight, world, moved, agent, rules, out, row, got sight, world
    HERE:Short: n_seen() of observation HERE:Short must return an integer of at least 2, got 1
    HERE:Beyond: groups of equal length, at least 2, of entries in 0..3, got [[0, 99]]
    HERE:Reversed: bounds() of observation HERE:Reversed must return the lowest and the highest values
    HERE:Raising: bounds() of observation HERE:Raising raised KeyError: 'size'
    HERE:Half: n_seen() of observation HERE:Half must return an integer of at least 2, got 2.0
    HERE:Flat: groups of equal length, at least 2, of entries in 0..3, got [0, 1]
    HERE:Single: bounds() of observation HERE:Single must return the lowest and the highest values, got 7
    pathlib:Path: observation pathlib:Path must be a named tuple, got Path
"""


@pytest.mark.parametrize("wrong", WRONG.strip().splitlines(), ids=lambda line: line.split(": ")[0].strip())
def test_what_is_no_sight_is_refused_in_one_line(wrong: str) -> None:
    name, line = wrong.strip().replace("HERE", HERE).split(": ", 1)
    with pytest.raises(ValueError, match=f"^[^\\n]*{re.escape(line)}[^\\n]*$"):
        EnvConfig(**TINY, observation=name)


def test_options_of_the_papers_observation_are_not_of_anothers() -> None:
    line = f"see_moves, see_scaled: only for observation=offsets, got observation={WIDE}"
    with pytest.raises(ValueError, match=f"^{line}$"):
        EnvConfig(observation=WIDE, see_moves=True, see_scaled=True)


class Shorter(Still):
    """Its rule writes less than it says."""

    def n_seen(self, n_agents: int, n_opponents: int) -> int:
        return 2 * n_opponents + 1


class Narrow(Still):
    """Its bounds are too narrow."""

    def bounds(self, n_agents: int, n_opponents: int, size: int) -> tuple[int, int]:
        return -1, 1


class Peeking(Still):
    """Its rule reads an agent that is not there."""

    def groups(self, n_agents: int, n_opponents: int) -> list[list[int]]:
        return [[0, 1]]


@rule
def peeking(sight: Any, world: Any, moved: Any, agent: int, rules: Any, out: Any, row: int) -> int:
    dx, _ = offset_to(world, agent, 5, rules)
    store(out, row, as_float(dx))
    return row + 1


class Silent(Still):
    """Its rule does not return the next row."""


@rule
def silent(sight: Any, world: Any, moved: Any, agent: int, rules: Any, out: Any, row: int) -> int:
    still(sight, world, moved, agent, rules, out, row)
    return row


observe.register(Shorter, still)
observe.register(Narrow, still)
observe.register(Peeking, peeking)
observe.register(Silent, silent)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("Shorter", "must write 5 rows in a team of 3 against 2, as n_seen() says, got 4"),
        ("Narrow", "must write numbers within bounds(), got "),
        ("Peeking", "must keep to the first 5 rows of world.x, got row 5"),
        ("Silent", "must return the row after the last that it wrote, got 0 for 4"),
    ],
)
def test_a_rule_that_breaks_its_promises_is_refused_in_one_line(name: str, line: str) -> None:
    with pytest.raises(ValueError, match=f"^the rule of observation {HERE}:{name} {re.escape(line)}[^\\n]*$"):
        EnvConfig(**TINY, observation=f"{HERE}:{name}")
