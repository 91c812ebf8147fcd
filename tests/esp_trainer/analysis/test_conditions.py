"""Which runs are one condition, what it is called, and which may be compared."""

from __future__ import annotations

from pathlib import Path

import pytest

from esp_trainer.analysis.conditions import check_same_world, conditions
from esp_trainer.config import RunConfig
from esp_trainer.presets import preset

SMOKE = preset("smoke")


def test_seeds_lengths_and_names_of_presets_make_no_condition() -> None:
    others = [SMOKE.replace(seed=1, preset="mine"), SMOKE.replace(seed=2, generations=3, checkpoint_every=1)]
    assert conditions([SMOKE, *others]) == {"smoke": [0, 1, 2]}


def test_conditions_come_in_the_order_of_their_first_runs() -> None:
    half = SMOKE.with_fields({"esp.past_share": 0.5})
    runs = [half, SMOKE, half.replace(seed=1), SMOKE.replace(seed=1)]
    assert conditions(runs) == {"esp.past_share=0.5": [0, 2], "esp.past_share=0": [1, 3]}


def named(*configs: RunConfig) -> list[str]:
    return list(conditions(configs))


def test_presets_that_tell_the_conditions_apart_name_them() -> None:
    assert named(preset("paper-3v2"), preset("modern-3v2")) == ["paper-3v2", "modern-3v2"]
    assert named(preset("paper-3v2"), preset("modern-3v2").with_fields({"esp.n_trials": 9})) == [
        "paper-3v2",
        "modern-3v2",
    ]


def test_within_presets_fields_are_named_that_differ_there() -> None:
    grid = [preset(name).with_fields({"esp.n_trials": n}) for name in ("paper-3v2", "modern-3v2") for n in (500, 1000)]
    assert named(*grid) == [
        "paper-3v2, esp.n_trials=500",
        "paper-3v2, esp.n_trials=1000",
        "modern-3v2, esp.n_trials=500",
        "modern-3v2, esp.n_trials=1000",
    ]


def test_all_fields_that_differ_are_named() -> None:
    recent = SMOKE.with_fields({"esp.past_share": 0.5, "esp.past_choice": "recent"})
    assert named(SMOKE, recent) == [
        "esp.past_share=0, esp.past_choice=uniform",
        "esp.past_share=0.5, esp.past_choice=recent",
    ]


def test_a_league_is_named_by_the_first_digits_of_its_digest() -> None:
    assert named(SMOKE, SMOKE.replace(league="0123456789abcdef" * 4)) == ["league=none", "league=01234567"]


def test_what_both_sides_share_is_named_once() -> None:
    scaled = {"predators.input_scale": 0.2, "prey.input_scale": 0.2}
    assert named(SMOKE, SMOKE.with_fields(scaled)) == ["input_scale=1", "input_scale=0.2"]
    assert named(SMOKE, SMOKE.with_fields({"prey.bias": True})) == ["prey.bias=false", "prey.bias=true"]


def test_worlds_that_pay_in_other_ways_are_one() -> None:
    paid = {"env.prey_fitness": "complementary", "env.reward": "dense", "env.credit": "individual"}
    check_same_world([(Path("a"), SMOKE), (Path("b"), SMOKE.with_fields({**paid, "env.closeness": "nearest"}))])


def test_worlds_in_which_teams_cannot_meet_are_refused() -> None:
    runs = [(Path("a"), SMOKE), (Path("b"), SMOKE), (Path("c"), SMOKE.with_fields({"env.size": 14}))]
    with pytest.raises(
        ValueError, match=r"^runs must be of one world, so that their teams can meet, got a with "
    ) as error:
        check_same_world(runs)
    assert str(error.value).endswith("got a with env.size=12 and c with env.size=14")


def test_names_that_a_sweep_gave_count_if_each_condition_has_one() -> None:
    runs = [SMOKE, SMOKE.replace(seed=1), SMOKE.with_fields({"esp.past_share": 0.5})]
    assert conditions(runs, ["a", "a", "b"]) == {"a": [0, 1], "b": [2]}
    fields = {"esp.past_share=0": [0, 1], "esp.past_share=0.5": [2]}
    assert conditions(runs, ["a", "a", None]) == fields
    assert conditions(runs, ["a", "c", "b"]) == fields
    assert conditions(runs, ["a", "a", "a"]) == fields
