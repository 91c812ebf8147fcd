"""A checkpoint is all that the next generation follows from, and belongs to one config."""

from __future__ import annotations

import math
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.coevolution.sides import EvolvingSide, new_sides
from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from esp_trainer.run.checkpoint import load_checkpoint, save_checkpoint
from esp_trainer.types import Role, ScriptedTeams

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


@pytest.fixture
def saved(tiny: RunConfig, tmp_path: Path, start: Any) -> Path:
    """The checkpoint of a run of four generations."""
    list(start(tmp_path / "run", tiny.replace(generations=4)).generations())
    return tmp_path / "run/checkpoint.safetensors"


def _alter(path: Path, change: Callable[[dict[str, Any], dict[str, np.ndarray]], Any]) -> None:
    """Write the checkpoint anew, with a digest that is right."""
    header, arrays = read_arrays(path, "checkpoint")
    change(header, arrays)
    del header["kind"], header["schema"]
    write_arrays(path, "checkpoint", header, arrays)


def test_both_sides_come_back_as_they_were(tiny: RunConfig, tmp_path: Path, start: Any) -> None:
    trainer = start(tmp_path / "run", tiny)
    list(islice(trainer.generations(), 4))
    sides, done = load_checkpoint(tmp_path / "run/checkpoint.safetensors", tiny)
    assert done == 4
    assert list(sides) == ["predators", "prey"]
    for role, side in trainer.coevolution.evolving.items():
        restored = sides[role]
        assert isinstance(restored, EvolvingSide)
        assert (restored.algorithm.genomes == side.algorithm.genomes).all()
        assert restored.algorithm.genomes.flags.writeable
        assert len(restored.hall_of_fame) == 4
        assert (restored.hall_of_fame.champions == side.hall_of_fame.champions).all()
        assert (restored.best, restored.stagnant) == (side.best, side.stagnant)


def test_the_state_before_the_first_champion_comes_back(tiny: RunConfig, tmp_path: Path) -> None:
    """Minus infinity has no JSON."""
    save_checkpoint(tmp_path / "c", tiny, new_sides(tiny), 0)
    sides, done = load_checkpoint(tmp_path / "c", tiny)
    assert done == 0
    assert all(isinstance(side, EvolvingSide) and side.best == -math.inf for side in sides.values())


def test_a_script_comes_back_from_the_config(tiny: RunConfig, tmp_path: Path) -> None:
    config = tiny.replace(prey=SideConfig(policy="flee_nearest"))
    save_checkpoint(tmp_path / "c", config, new_sides(config), 0)
    sides, _ = load_checkpoint(tmp_path / "c", config)
    assert sides["prey"] == ScriptedTeams("flee_nearest")
    assert set(read_arrays(tmp_path / "c", "checkpoint")[1]) == {
        *("predators.genomes", "predators.hall_of_fame", "predators.met")
    }


@pytest.mark.parametrize("part", ["algorithm", "network"])
def test_a_class_that_cannot_be_imported_is_no_damage_of_the_checkpoint(
    part: str, tiny: RunConfig, tmp_path: Path
) -> None:
    config = tiny.with_fields({f"prey.{part}": "nowhere:Mine"})
    save_checkpoint(tmp_path / "c", config, new_sides(tiny), 0)
    with pytest.raises(ValueError, match=f"^(prey: )?{part} nowhere:Mine cannot be imported") as refused:
        load_checkpoint(tmp_path / "c", config)
    assert not isinstance(refused.value, DamagedFileError)


@pytest.mark.parametrize("changed", [{"generations": 7}, {"checkpoint_every": 1}])
def test_how_long_a_run_is_and_how_often_it_is_saved_may_change(
    changed: dict[str, int], tiny: RunConfig, saved: Path
) -> None:
    assert load_checkpoint(saved, tiny.replace(**changed))[1] == 4


OTHERS: dict[str, tuple[Callable[[RunConfig], RunConfig], str]] = {
    "seed": (lambda c: c.replace(seed=1), "seed is 0 there and 1 in config.json"),
    "preset": (lambda c: c.replace(preset="mine"), 'preset is "smoke" there and "mine" in config.json'),
    "env": (
        lambda c: c.replace(env=c.env.replace(swap_captures=True)),
        "env.swap_captures is false there and true in config.json",
    ),
    "esp": (
        lambda c: c.replace(esp=c.esp.replace(mutation_rate=0.5)),
        "esp.mutation_rate is 0.4 there and 0.5 in config.json",
    ),
    "prey": (lambda c: c.replace(prey=c.prey.replace(n_hidden=3)), "prey.n_hidden is 2 there and 3 in config.json"),
    "predators": (
        lambda c: c.replace(predators=c.predators.replace(policy="greedy_chase")),
        'predators.policy is "esp" there and "greedy_chase" in config.json',
    ),
    "champion": (
        lambda c: c.replace(champion=c.champion.replace(n_held_out=9)),
        "champion.n_held_out is 8 there and 9 in config.json",
    ),
}


@pytest.mark.parametrize(("change", "line"), OTHERS.values(), ids=OTHERS)
def test_the_checkpoint_of_another_config_is_refused_with_the_field_that_differs(
    change: Callable[[RunConfig], RunConfig], line: str, tiny: RunConfig, saved: Path
) -> None:
    with pytest.raises(ValueError, match="belongs to another config") as refused:
        load_checkpoint(saved, change(tiny))
    assert str(refused.value) == f"{saved} belongs to another config: {line}"


def test_the_checkpoint_of_a_config_with_more_or_fewer_fields_is_refused(tiny: RunConfig, saved: Path) -> None:
    _alter(saved, lambda header, _: header["config"]["esp"].update(later=3))
    with pytest.raises(ValueError, match=r"is not a usable checkpoint: unknown field esp\.later"):
        load_checkpoint(saved, tiny)
    _alter(saved, lambda header, _: header.pop("config"))
    with pytest.raises(ValueError, match="belongs to another config"):
        load_checkpoint(saved, tiny)


UNUSABLE: dict[str, Callable[[dict[str, Any], dict[str, np.ndarray]], Any]] = {
    "genomes of another shape": lambda _, arrays: arrays.update(
        {"prey.genomes": arrays["prey.genomes"][:, :, :, :-1].copy()}
    ),
    "fame of another shape": lambda _, arrays: arrays.update(
        {"prey.hall_of_fame": arrays["prey.hall_of_fame"][..., :-1].copy()}
    ),
    "a hall of fame that is too short": lambda _, arrays: arrays.update(
        {"prey.hall_of_fame": arrays["prey.hall_of_fame"][:-1].copy()}
    ),
    "genomes of another type": lambda _, arrays: arrays.update(
        {"prey.genomes": arrays["prey.genomes"].astype(np.int32)}
    ),
    "a side without genomes": lambda _, arrays: arrays.pop("predators.genomes"),
    "a side without fame": lambda _, arrays: arrays.pop("predators.hall_of_fame"),
    "a side without progress": lambda header, _: header["sides"].pop("prey"),
    "progress without best": lambda header, _: header["sides"]["prey"].pop("best"),
    "progress in words": lambda header, _: header["sides"]["prey"].update(stagnant="many"),
    "no number of generations": lambda header, _: header.pop("generations"),
    "generations in words": lambda header, _: header.update(generations="four"),
    "fewer than no generations": lambda header, _: header.update(generations=-1),
    "no sides": lambda header, _: header.pop("sides"),
    "sides of another type": lambda header, _: header.update(sides=[1, 2]),
    "a config of another type": lambda header, _: header.update(config=[1]),
}


@pytest.mark.parametrize("change", UNUSABLE.values(), ids=UNUSABLE)
def test_a_checkpoint_that_is_whole_and_wrong_is_refused_in_one_line(
    change: Callable[[dict[str, Any], dict[str, np.ndarray]], Any], tiny: RunConfig, saved: Path
) -> None:
    _alter(saved, change)
    with pytest.raises(ValueError, match=str(saved)) as refused:
        load_checkpoint(saved, tiny)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("array", ["prey.genomes", "predators.hall_of_fame"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_weights_that_are_not_finite_are_refused(array: str, value: float, tiny: RunConfig, saved: Path) -> None:
    def spoil(_: dict[str, Any], arrays: dict[str, np.ndarray]) -> None:
        arrays[array] = arrays[array].copy()
        arrays[array].flat[17] = value

    _alter(saved, spoil)
    with pytest.raises(DamagedFileError, match=rf"is damaged: {array} holds values that are not finite$"):
        load_checkpoint(saved, tiny)


def test_a_checkpoint_with_any_of_many_bits_flipped_is_refused_or_the_same(tiny: RunConfig, saved: Path) -> None:
    data = saved.read_bytes()
    whole, same = read_arrays(saved, "checkpoint")
    generator = np.random.default_rng(0)
    for bit in {*range(64), *generator.integers(0, 8 * len(data), 1500).tolist()}:
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        saved.write_bytes(flipped)
        try:
            load_checkpoint(saved, tiny)
        except DamagedFileError as refused:
            assert "\n" not in str(refused)  # noqa: PT017  # or it loads, when the last digit of a number does not count
            continue
        header, arrays = read_arrays(saved, "checkpoint")
        assert header == whole
        assert all((array == same[name]).all() for name, array in arrays.items())


def test_a_checkpoint_cut_anywhere_is_refused(tiny: RunConfig, saved: Path) -> None:
    data = saved.read_bytes()
    lengths = {*range(200), *range(0, len(data), 97), len(data) - 1}
    for length in lengths:
        saved.write_bytes(data[:length])
        with pytest.raises(DamagedFileError) as refused:
            load_checkpoint(saved, tiny)
        assert "\n" not in str(refused.value)


def test_a_champion_is_no_checkpoint(tiny: RunConfig, saved: Path) -> None:
    team = saved.parent / "champions/prey-00000.safetensors"
    with pytest.raises(DamagedFileError, match=r"must be a checkpoint, but is a team$"):
        load_checkpoint(team, tiny)


def test_the_same_state_is_the_same_file(tiny: RunConfig, saved: Path, tmp_path: Path) -> None:
    config = RunConfig.from_dict(read_arrays(saved, "checkpoint")[0]["config"])
    sides, done = load_checkpoint(saved, config)
    save_checkpoint(tmp_path / "again", config, sides, done)
    assert (tmp_path / "again").read_bytes() == saved.read_bytes()


def test_a_longer_run_from_before_halls_of_fame_were_bounded_goes_on(
    tiny: RunConfig, tmp_path: Path, start: Any
) -> None:
    config = tiny.replace(esp=tiny.esp.replace(hof_size=6))
    list(start(tmp_path / "run", config).generations())
    header, arrays = read_arrays(tmp_path / "run/checkpoint.safetensors", "checkpoint")
    header["config"]["esp"]["hof_size"] = 3
    write_arrays(tmp_path / "old", "checkpoint", header, arrays)
    sides, done = load_checkpoint(tmp_path / "old", config.replace(esp=config.esp.replace(hof_size=3)))
    assert done == 6
    for role, side in sides.items():
        assert isinstance(side, EvolvingSide)
        assert (side.hall_of_fame.champions == arrays[f"{role}.hall_of_fame"][[0, 4, 5]]).all()


class _Mine(Subpopulations):
    """Another algorithm, as far as anybody can tell."""


@pytest.mark.parametrize("role", ["predators", "prey"])
def test_a_side_that_another_algorithm_bred_is_not_gone_on_with_by_esp(
    role: Role, tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any
) -> None:
    trainer = start(tmp_path, tiny)
    side = trainer.coevolution.sides[role]
    side.algorithm = _Mine(tiny.esp, side.algorithm.controller, side.algorithm.genomes)
    list(islice(trainer.generations(), 4))
    before = snapshot(tmp_path)
    wanted = rf"checkpoint.safetensors: the {role} come from .*:_Mine, and resume can go on with esp only$"
    with pytest.raises(ValueError, match=wanted):
        resume(tmp_path)
    assert snapshot(tmp_path) == before
    assert load_checkpoint(tmp_path / "checkpoint.safetensors", tiny)[1] == 4  # to read it is no harm
    list(trainer.generations())  # and who has the algorithm goes on
    assert trainer.done == 6


def test_what_another_algorithm_bred_is_known_before_its_first_checkpoint(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any, snapshot: Any
) -> None:
    trainer = start(tmp_path, tiny)
    side = trainer.coevolution.sides["prey"]
    side.algorithm = _Mine(tiny.esp, side.algorithm.controller, side.algorithm.genomes)
    next(trainer.generations())
    trainer.directory.unlock()
    before = snapshot(tmp_path)
    with pytest.raises(ValueError, match="resume can go on with esp only"):
        resume(tmp_path)
    assert snapshot(tmp_path) == before


def test_a_side_that_somebodys_team_played_is_not_gone_on_with_by_esp(
    tiny: RunConfig, tmp_path: Path, start: Any, resume: Any
) -> None:
    trainer = start(tmp_path, tiny)
    trainer.coevolution.sides["prey"] = ScriptedTeams("flee_nearest")
    list(trainer.generations())
    with pytest.raises(ValueError, match="the prey come from flee_nearest, and resume can go on with esp only"):
        resume(tmp_path)


def test_a_checkpoint_from_before_algorithms_were_named_is_gone_on_with(
    saved: Path, resume: Any, tmp_path: Path
) -> None:
    _alter(saved, lambda header, _: header.pop("algorithms"))
    assert resume(tmp_path / "run").done == 4
