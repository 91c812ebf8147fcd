"""The reproduction: its settings, its rule for verdicts, and the numbers behind them."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer import preset
from esp_trainer.analysis.inference import Comparison, holm
from esp_trainer.presets import PRESETS

SCRIPTS = Path(__file__).parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from race.measure import gather, is_measured, measured_file  # noqa: E402
from reproduction import claims, measure  # noqa: E402
from reproduction.claims import MEASURED_NUMBERS, Claim, Verdict, read_claims, verdicts  # noqa: E402
from reproduction.results import StudyResults, load  # noqa: E402
from reproduction.settings import Setting, read_settings, small  # noqa: E402

SETTINGS = read_settings()
PANELS = {name: each for name, each in SETTINGS.items() if each.part == "panel"}
OTHERS = {name: each for name, each in SETTINGS.items() if each.part != "panel"}
PAPERS = {name for name in PRESETS if name not in ("smoke", "game") and not name.startswith("race-")}
"""Presets that the report is about; the others have one of their own."""
MERELY_FITNESS = {"env.prey_fitness", "env.closeness"}


def leaves(settings: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def differences(a: Any, b: Any) -> set[str]:
    """The fields in which two configs differ."""
    one, other = dict(leaves(a.model_dump())), dict(leaves(b.model_dump()))
    return {name for name in one if one[name] != other[name]}


# What is run.


def test_every_preset_of_the_paper_and_around_it_is_a_setting():
    assert set(OTHERS) >= PAPERS
    for name in PAPERS:
        assert SETTINGS[name].config.replace(seed=0) == preset(name)


@pytest.mark.parametrize("settings", [SETTINGS, small(SETTINGS)], ids=["whole", "small"])
def test_no_setting_is_run_twice(settings: dict[str, Setting]):
    own = [each for each in settings.values() if each.part not in ("panel", "modern")]  # modern is a combination again
    configs = [each.config.replace(preset="").model_dump_json() for each in own]
    assert len(set(configs)) == len(configs)


def test_a_setting_is_kept_with_what_it_is_and_its_seeds():
    assert len(OTHERS) == 62
    assert sum(len(each.runs) for each in OTHERS.values()) == 570
    assert all(each.meaning for each in OTHERS.values())
    assert SETTINGS["scaled-3v1"].seeds == list(range(10))
    assert SETTINGS["modern-3v2"].seeds == list(range(100, 120))


def changes(name: str) -> set[str]:
    """What an arm changes in the paper's setting."""
    config = SETTINGS[name].config
    given = {"preset", "generations", "seed"} if SETTINGS[name].part == "sensitivity" else {"preset", "seed"}
    return differences(config, preset(f"paper-3v{config.env.n_prey}")) - given


SINGLE = [name for name, each in OTHERS.items() if name not in PRESETS and each.part != "combination"]
COMBINED = [name for name, each in OTHERS.items() if each.part == "combination"]


@pytest.mark.parametrize("name", COMBINED)
def test_a_combination_is_made_of_what_was_tried_alone(name: str):
    alone = [changes(single) for single in SINGLE if single[-3:] == name[-3:]]
    parts = [each for each in alone if each <= changes(name)]
    assert len(parts) > 1
    assert set().union(*parts) == changes(name)


@pytest.mark.parametrize("name", SINGLE)
def test_a_setting_changes_one_thing(name: str):
    changed = changes(name)
    if name.startswith("shared-fitness"):
        assert changed == {"esp.past_share", "esp.fitness_sharing"}
    elif name.startswith("previous-champion"):
        assert changed == {"esp.past_share", "esp.past_choice"}
    elif name.startswith("linear"):
        assert changed == {"predators.output", "prey.output"}
        assert changes(name.replace("linear", "drawn")) - changed == {"predators.choice", "prey.choice"}
    elif changed != {"predators.input_scale", "prey.input_scale"}:
        assert len(changed) == 1, changed


def test_the_seeds_of_held_out_runs_are_nobody_elses():
    theirs = {seed for each in PANELS.values() for seed in each.seeds}
    ours = {seed for each in OTHERS.values() for seed in each.seeds}
    fresh = {measure.RESPONSE_SEED + seed for seed in ours}
    assert theirs
    assert not theirs & ours
    assert not fresh & (theirs | ours)


@pytest.mark.parametrize("name", OTHERS)
def test_every_setting_meets_held_out_runs_of_its_own_world(name: str):
    panel = [each for each in PANELS.values() if each.world == SETTINGS[name].world]
    assert {each.config.predators.input_scale for each in panel} == {1.0, 0.2}
    assert sum(len(each.runs) for each in panel) == 6
    for each in panel:
        env = differences(each.config, SETTINGS[name].config)
        assert {field for field in env if field.startswith("env.")} <= MERELY_FITNESS
        assert each.config.predators.policy == each.config.prey.policy == "esp"


@pytest.mark.parametrize("setting", small(SETTINGS).values(), ids=lambda each: str(each.name))
def test_in_small_there_are_held_out_runs_too(setting: Setting):
    panel = [each for each in small(SETTINGS).values() if each.part == "panel"]
    assert setting.world in [each.world for each in panel]
    assert len(setting.runs) == 2


# The rule.


def comparison(low: float, high: float, p: float = 1.0) -> Comparison:
    return Comparison((low + high) / 2, low, high, 0.0, p)


def claim(expects: str, settings: tuple[str, ...] = (), margin: float = 0.1) -> Claim:
    return Claim("I", "so it is", list(settings), "late", "a number", expects, margin, "success")


SURE, UNSURE = 0.049, 0.05


@pytest.mark.parametrize(
    ("expects", "low", "high", "p", "word"),
    [
        # More.
        ("more", 0.2, 0.4, SURE, "supported"),
        ("more", 0.01, 0.4, SURE, "supported"),  # it may be small
        ("more", 0.2, 0.4, UNSURE, "undecided"),
        ("more", -0.2, 0.4, UNSURE, "undecided"),
        ("more", -0.2, 0.1, UNSURE, "undecided"),  # 0.1 would matter
        ("more", -0.2, 0.09, UNSURE, "not supported"),
        ("more", 0.01, 0.09, SURE, "not supported"),  # it is there, and does not matter
        ("more", -0.4, -0.2, SURE, "not supported"),
        ("more", -0.4, 0.2, SURE, "not supported"),  # the contrary, by the test
        # No change.
        ("no change", -0.09, 0.09, UNSURE, "supported"),
        ("no change", 0.01, 0.09, SURE, "supported"),  # a change that does not matter
        ("no change", -0.1, 0.09, UNSURE, "undecided"),
        ("no change", -0.09, 0.1, UNSURE, "undecided"),
        ("no change", 0.2, 0.4, SURE, "not supported"),
        ("no change", -0.4, -0.2, SURE, "not supported"),
        ("no change", 0.2, 0.4, UNSURE, "undecided"),
        ("no change", 0.01, 0.17, SURE, "undecided"),  # a change, but perhaps a small one
        # Too few seeds for an interval.
        ("more", -np.inf, np.inf, UNSURE, "undecided"),
        ("no change", -np.inf, np.inf, UNSURE, "undecided"),
    ],
)
def test_verdicts_follow_from_interval_and_test(expects: str, low: float, high: float, p: float, word: str):
    found = comparison(low, high) if np.isfinite(low) else Comparison(0.5, low, high, 0.0, p)
    assert Verdict(claim(expects), found, p).word == word


def test_claims_are_corrected_together(monkeypatch: pytest.MonkeyPatch):
    found = [comparison(0.2, 0.4, p) for p in (0.02, 0.001, 0.03)]
    tests = iter([*found, found[2]])
    monkeypatch.setattr(claims, "test", lambda claim, results: next(tests))
    three = verdicts([claim("more")] * 3, {})
    assert [each.found for each in three] == found
    assert [each.p for each in three] == pytest.approx([0.04, 0.003, 0.04])  # by hand: 2, 3 and 1 times, and no less
    assert [each.word for each in three] == ["supported"] * 3
    (one,) = verdicts([claim("more")], {})
    assert one.p == 0.03


def test_a_claim_whose_settings_are_not_there_is_left_out(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(claims, "test", lambda claim, results: comparison(0, 0))
    results = {"a": StudyResults(SETTINGS["paper-3v1"], {})}
    given = [claim("more", ("a",)), claim("more", ("a", "b")), claim("more", ("b",))]
    assert [each.claim for each in verdicts(given, results)] == given[:1]
    assert verdicts(given[1:], results) == []


# The numbers.


def results(**arrays: Any) -> StudyResults:
    """Of two seeds."""
    return StudyResults(
        SETTINGS["paper-3v1"], {name.replace("__", "."): np.array(value) for name, value in arrays.items()}
    )


def test_late_is_the_last_third_of_a_curve():
    found = results(curve__caught=[[0, 0, 0, 0, 0, 1, 2], [9, 9, 9, 9, 9, 3, 5]])
    assert found.late("caught").tolist() == [1.5, 4]  # two of seven generations


TWELVE = [list(range(0, 120, 10))] * 2


def test_a_late_share_is_that_of_the_last_sixth_of_the_generations():
    table = np.zeros((2, 12, 3))
    table[0, 10:] = [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]
    table[1, 9:] = 1
    table[1, 4:6] = 0.5
    found = results(generations=TWELVE, panel__prey=table)
    assert found.late_share("panel.prey") == pytest.approx([0.35, 1])
    assert found.late_share("panel.prey", until=110) == pytest.approx([0.2, 1])  # one of eleven
    # Before generation 60 there are six, and the last sixth is one of them.
    assert found.late_share("panel.prey", until=60) == pytest.approx([0, 0.5])
    assert found.late_share("panel.prey", until=61) == pytest.approx([0, 0])


def test_two_sided_is_the_progress_of_the_lesser_side():
    hunting, hunted = np.zeros((2, 12, 2)), np.zeros((2, 12, 2))
    hunting[0, :2], hunting[0, 10:] = 0.1, [0.4, 0.6]  # predators of the first seed: 0.4 better
    hunted[0, :2], hunted[0, 10:] = 0.7, 0.5  # its prey are caught 0.2 less
    hunting[1, :2], hunting[1, 10:] = 0.3, 0.2  # predators of the second: 0.1 worse
    hunted[1, :2] = 1.0
    found = results(generations=TWELVE, panel__predators=hunting, panel__prey=hunted)
    assert found.two_sided() == pytest.approx([0.2, -0.1])


def test_progress_can_be_asked_of_a_part_of_the_run():
    hunting = np.repeat(np.linspace(0, 0.55, 12)[None, :, None], 2, axis=0)  # 0.05 a row
    hunted = 1 - hunting
    found = results(generations=TWELVE, panel__predators=hunting, panel__prey=hunted, curve__caught=np.zeros((2, 120)))
    assert found.halfway == 60
    assert found.two_sided() == pytest.approx([0.5, 0.5])  # two rows of twelve at each end
    assert found.two_sided(since=60) == pytest.approx([0.25, 0.25])  # one row of six
    assert found.two_sided(until=60) == pytest.approx([0.25, 0.25])
    assert found.two_sided(since=30, until=60) == pytest.approx([0.1, 0.1])


def test_shares_caught_are_counted_over_all_parities():
    captured = np.zeros((2, 1, 3, 4), np.int16)
    captured[0, 0] = [[1, 0, 0, 1], [8, 24, 24, 8], [0, 0, 16, 0]]
    found = results(generations=[[0, 1, 2]] * 2, own__captured=captured, met=[[8, 24, 24, 8]] * 2)
    np.testing.assert_allclose(found.caught, [[[2 / 64, 1, 0.25]], [[0, 0, 0]]])
    assert found.n_seeds == 2


def test_a_behaviour_is_its_rate_over_chance_or_of_one_agent_its_rate():
    rates = [[[0.5, 0.2], [0.3, np.nan]], [[0.0, 0.1], [np.nan, np.nan]]]
    found = results(behaviour__baiting=rates, behaviour__idling=rates)
    np.testing.assert_allclose(found.behaviour("baiting"), [[0.3, np.nan], [-0.1, np.nan]])
    np.testing.assert_allclose(found.behaviour("idling"), [[0.5, 0.3], [0.0, np.nan]])


def test_results_are_kept_until_their_setting_changes(tmp_path: Path):
    runs, kept, setting = tmp_path / "runs", tmp_path / "kept", small(SETTINGS)["paper-3v1"]
    for run in setting.runs:
        assert load(kept, setting) is None
        path = measured_file(runs, run)
        path.parent.mkdir(parents=True, exist_ok=True)
        (runs / run.name).mkdir()
        seed = np.array(run.config.seed)
        for config in ("", SETTINGS["paper-3v1"].config.model_dump_json()):
            np.savez_compressed(path, config=np.array(config), seed=seed)
            assert not is_measured(runs, run), "another world's measurements, or nobody's"
        np.savez_compressed(path, config=np.array(run.config.model_dump_json()), seed=seed)
        assert is_measured(runs, run)
        gather(runs, setting.runs, kept)
    found = load(kept, setting)
    assert found is not None
    assert found["seed"].tolist() == setting.seeds
    assert "config" not in found
    assert load(kept, SETTINGS["paper-3v1"]) is None, "the same name in another world"
    assert [file.name for file in kept.iterdir()] == ["paper-3v1.npz"]


def test_what_was_measured_before_a_field_existed_counts_with_its_default(tmp_path: Path):
    setting = small(SETTINGS)["paper-3v1"]
    told = setting.config.model_dump()
    del told["prey"]["choice"]
    about = {"config": told, "seeds": setting.seeds}
    np.savez_compressed(tmp_path / "paper-3v1.npz", about=np.array(json.dumps(about)))
    assert load(tmp_path, setting) is not None
    told["prey"]["choice"] = "drawn"
    np.savez_compressed(tmp_path / "paper-3v1.npz", about=np.array(json.dumps(about)))
    assert load(tmp_path, setting) is None


@pytest.mark.parametrize("name", ["paper-3v1", "fleeing-prey", "modern-3v2"])
def test_the_measurements_in_the_repository_are_of_the_settings_of_today(name: str):
    found = load(SCRIPTS.parent / "docs" / "reproduction" / "data", SETTINGS[name])
    assert found is not None
    assert found.n_seeds == len(SETTINGS[name].runs)


# The claims.


def made_up(setting: Setting, level: float, slope: float) -> StudyResults:
    """Return measurements of all seeds of a setting: fractions that rise, and every behaviour to the same degree."""
    n, rows = len(setting.runs), np.arange(12)
    noise = 0.001 * np.random.default_rng(0).random((n, 1))
    generations = np.linspace(0, setting.config.generations - 1, 12).round().astype(int)
    curve = np.full((n, setting.config.generations), level) + noise
    better = level + slope * rows[None, :, None] / 11 + noise[..., None]
    arrays = {
        "generations": np.repeat(generations[None], n, axis=0),
        **{f"curve.{name}": curve for name in ("caught", "none_caught", "all_caught")},
        **{f"{table}.predators": better for table in ("panel", "scripts")},
        **{f"{table}.prey": 1 - better for table in ("panel", "scripts")},
    }
    for name in {each.of for each in read_claims() if each.number == "behaviour"}:
        arrays[f"behaviour.{name}"] = np.stack([level + 0 * better[..., 0] + noise, 0 * better[..., 0]], axis=-1)
    return StudyResults(setting, arrays)


def word_of(results: dict[str, StudyResults], says: str, section: str) -> Verdict:
    (found,) = (v for v in verdicts(read_claims(), results) if v.claim.says == says and v.claim.section == section)
    return found


def test_every_claim_is_about_settings_that_are_run_and_figures_that_are_drawn():
    drawn = {"success", "ciao", "master", "global", "behaviours", "parity", "ablations", "scripts"}
    for each in read_claims():
        assert set(each.settings) <= set(OTHERS)
        assert len(each.settings) in (1, 2)
        assert each.figure in drawn
        assert each.number in {*MEASURED_NUMBERS, "cycles"}
        assert each.expects in ("more", "no change")
        assert each.margin > 0


def test_verdicts_come_out_as_the_measurements_say():
    progress = {name: made_up(each, 0.3, 0.4) for name, each in OTHERS.items()}
    found = verdicts(read_claims(), progress)
    assert len(found) == len(read_claims())
    assert [each.p for each in found] == pytest.approx(holm([each.found.p for each in found]))
    assert word_of(progress, "split networks sustain an arms race with a single prey", "VI.B").word == "supported"
    assert word_of(progress, "the prey baits", "VI.B").word == "supported"
    assert word_of(progress, "... and it stagnates", "VI.A").word == "not supported"
    assert word_of(progress, "more hidden neurons do not help it", "VI.A").word == "supported"
    stagnation = {name: made_up(each, 0.0, 0.0) for name, each in OTHERS.items()}
    assert word_of(stagnation, "split networks sustain an arms race with a single prey", "VI.B").word == "not supported"
    assert word_of(stagnation, "the prey baits", "VI.B").word == "not supported"
    assert word_of(stagnation, "... and it stagnates", "VI.A").word == "supported"


def test_two_settings_are_compared_in_the_direction_of_the_claim():
    both = {name: made_up(SETTINGS[name], 0.2, 0.0) for name in ("paper-3v1", "monolithic-3v1")}
    both["monolithic-3v1"] = made_up(SETTINGS["monolithic-3v1"], 0.7, 0.0)
    easily = word_of(both, "... more often than a prey with split networks", "VI.A")
    assert easily.found.difference == pytest.approx(0.5, abs=0.01)
    assert easily.word == "supported"
    swapped = {"paper-3v1": made_up(SETTINGS["paper-3v1"], 0.7, 0.0), "monolithic-3v1": both["paper-3v1"]}
    assert word_of(swapped, "... more often than a prey with split networks", "VI.A").word == "not supported"


def test_worse_evasion_is_more_prey_caught_by_held_out_predators():
    """The made-up prey are caught less the higher the level is."""
    both = {
        "paper-3v1": made_up(SETTINGS["paper-3v1"], 0.8, 0),
        "complementary-3v1": made_up(SETTINGS["complementary-3v1"], 0.3, 0),
    }
    found = word_of(both, "complementary prey fitness gives worse evasion, one prey", "V")
    assert found.found.difference == pytest.approx(0.5, abs=0.01)
    assert found.word == "supported"
