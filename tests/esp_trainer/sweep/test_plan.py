"""What a sweep's file stands for, and what is wrong with one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from esp_trainer.presets import preset
from esp_trainer.sweep.plan import read_plan

if TYPE_CHECKING:
    from pathlib import Path


def plan_of(text: str, tmp_path: Path) -> list[tuple[str, str]]:
    file = tmp_path / "sweep.toml"
    file.write_text(text)
    return [(run.cell, run.name) for run in read_plan(file)]


def test_one_preset_is_one_run_of_seed_0(tmp_path: Path) -> None:
    assert plan_of('preset = "smoke"', tmp_path) == [("smoke", "smoke-seed0")]


def test_runs_are_presets_by_values_by_seeds_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = """
        preset = ["smoke", "paper-3v1"]
        seeds = [7, 3]
        [fields]
        generations = 9
        prey.bias = [true, false]
        "esp.mutation_rate" = [0.5]
    """
    cells = [
        f"{preset}-prey.bias={bias}-esp.mutation_rate=0.5"
        for preset in ("smoke", "paper-3v1")
        for bias in ("true", "false")
    ]
    assert plan_of(text, tmp_path) == [(cell, f"{cell}-seed{seed}") for cell in cells for seed in (7, 3)]
    last = read_plan(tmp_path / "sweep.toml")[-1]
    paper = preset("paper-3v1")
    assert last.config == paper.replace(generations=9, seed=3, esp=paper.esp.replace(mutation_rate=0.5))


def test_conditions_have_names_and_their_fields_count_before_those_of_all(tmp_path: Path) -> None:
    text = """
        preset = "smoke"
        seeds = 2
        [fields]
        generations = 9
        esp.n_trials = 60
        [conditions.plain]
        [conditions."with a bias"]
        prey.bias = true
        esp.n_trials = 50
        [conditions.paper]
        preset = "paper-3v1"
    """
    assert plan_of(text, tmp_path) == [
        (name, f"{name}-seed{seed}") for name in ("plain", "with a bias", "paper") for seed in (0, 1)
    ]
    plain, biased, paper = [run.config for run in read_plan(tmp_path / "sweep.toml") if run.config.seed == 1]
    smoke = preset("smoke").replace(generations=9, seed=1)
    assert plain == smoke.replace(esp=smoke.esp.replace(n_trials=60))
    assert biased == smoke.replace(esp=smoke.esp.replace(n_trials=50), prey=smoke.prey.replace(bias=True))
    assert paper == preset("paper-3v1").with_fields({"generations": 9, "seed": 1, "esp.n_trials": 60})


def test_the_name_of_a_class_gives_a_name_that_every_system_allows(tmp_path: Path) -> None:
    elman = "esp_trainer.networks.elman"
    text = f'preset = "smoke"\n[fields]\nprey.network = ["feedforward", "{elman}:Elman"]'
    cell = f"smoke-prey.network={elman}-Elman"
    assert plan_of(text, tmp_path)[1] == (cell, f"{cell}-seed0")


def test_seeds_are_a_number_or_a_list(tmp_path: Path) -> None:
    assert [name for _, name in plan_of('preset = "smoke"\nseeds = 3', tmp_path)] == [
        "smoke-seed0",
        "smoke-seed1",
        "smoke-seed2",
    ]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "preset is missing"),
        ("preset = 3", "preset must be a name or a list of names, got 3"),
        ("preset = []", "preset must hold at least one value, got none"),
        ('preset = "smok"', "unknown preset smok; did you mean smoke?"),
        ('preset = "smoke"\nseed = 3', "unknown field seed; did you mean seeds?"),
        ('preset = "smoke"\nseeds = 0', "seeds must hold at least one value, got none"),
        ('preset = "smoke"\nseeds = [0.5]', "seeds must be a number or a list of numbers, got [0.5]"),
        ('preset = "smoke"\nseeds = true', "seeds must be a number or a list of numbers, got True"),
        ('preset = "smoke"\nseeds = [-1]', "seed must be at least 0, got -1"),
        ('preset = "smoke"\nseeds = [1, 2, 1]', "runs must be different, got smoke-seed1 2 times"),
        ('preset = "smoke"\nseeds = 100001', "a sweep must have at most 100,000 runs, got 100,001"),
        (
            'preset = "smoke"\n[fields]\nenv.size = [8, 8.0]',
            "env.size must be an integer, got 8.0",
        ),
        (
            'preset = "smoke"\n[fields]\nesp.mutation_rate = [1, 1.0]',
            (
                "runs must be different, got the same config for smoke-esp.mutation_rate=1-seed0 and "
                "smoke-esp.mutation_rate=1.0-seed0"
            ),
        ),
        (
            'preset = "smoke"\n[fields]\nesp = [{n_trials = 5}]',
            "esp must be a value or a list of values, got [{'n_trials': 5}]",
        ),
        (
            'preset = "smoke"\nseeds = 50001\n[conditions.a]\n[conditions.b]\nprey.bias = true',
            "a sweep must have at most 100,000 runs, got 100,002",
        ),
        ('preset = "smoke"\nconditions = 1', "conditions must be tables of fields by name, got 1"),
        ('preset = "smoke"\n[conditions]\na = 1', "conditions must be tables of fields by name, got {'a': 1}"),
        (
            'preset = "smoke"\n[conditions."../a"]',
            "a condition must have a name that a directory can have, got '../a'",
        ),
        (
            'preset = "smoke"\n[conditions."a: b"]',
            "a condition must have a name that a directory can have, got 'a: b'",
        ),
        (
            'preset = "smoke"\n[fields]\nprey.network = ["elman", "elmann"]',
            (
                "smoke-prey.network=elmann: network must be one of feedforward, elman or module:Class, got 'elmann'; "
                "did you mean elman?"
            ),
        ),
        (
            'preset = "smoke"\n[conditions.mine]\npredators.algorithm = "nowhere:Mine"',
            (
                "mine: predators: algorithm nowhere:Mine cannot be imported: ModuleNotFoundError: No module named "
                "'nowhere'"
            ),
        ),
        ('preset = "smoke"\n[conditions.a]\nseed = 1', "seed is no field of a condition: say seeds, above"),
        (
            'preset = "smoke"\n[conditions.a]\nenv.size = [8, 9]',
            "env.size of the condition a must be one value, got [8, 9]",
        ),
        ('preset = "smoke"\n[conditions.a]\npreset = 1', "preset of the condition a must be a name, got 1"),
        ('preset = ["smoke", "paper-3v1"]\n[conditions.a]', "with conditions, preset must be one value, got 2"),
        (
            'preset = "smoke"\n[fields]\nenv.size = [8, 9]\n[conditions.a]',
            "with conditions, env.size must be one value, got 2",
        ),
        (
            'preset = "smoke"\n[conditions.a]\n[conditions.b]',
            "runs must be different, got the same config for a-seed0 and b-seed0",
        ),
        ('preset = "smoke"\nfields = 1', "fields must be a table, got 1"),
        (
            'preset = "smoke"\n[fields]\nesp.n_trial = 3',
            "unknown field esp.n_trial; did you mean esp.n_trials?",
        ),
        ('preset = "smoke"\n[fields]\nseed.x = 3', "unknown field seed.x; did you mean seed?"),
        ('preset = "smoke"\n[fields]\nesp.n_trials = [5, "x"]', "esp.n_trials must be an integer, got 'x'"),
        ('preset = "smoke"\n[fields]\nesp.n_trials = []', "esp.n_trials must hold at least one value, got none"),
        ('preset = "smoke"\n[fields]\nseed = 3', "seed is no field of a sweep: say seeds, above [fields]"),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_the_file(text: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"sweep\.toml: ") as raised:
        plan_of(text, tmp_path)
    assert str(raised.value) == f"{tmp_path / 'sweep.toml'}: {says}"


@pytest.mark.parametrize("data", [b'preset = "smoke"\n[fields', b"\xff\xfe", b"a = " + 10_000 * b"["])
def test_a_file_that_is_no_toml_is_refused_in_one_line(data: bytes, tmp_path: Path) -> None:
    file = tmp_path / "sweep.toml"
    file.write_bytes(data)
    with pytest.raises(ValueError, match=r"sweep\.toml: ") as raised:
        read_plan(file)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_a_file_in_another_encoding_is_refused_with_the_one_that_is_read(encoding: str, tmp_path: Path) -> None:
    file = tmp_path / "sweep.toml"
    file.write_bytes('# é\npreset = "smoke"'.encode(encoding))
    byte = {"utf-16": "0xff at position 0", "latin-1": "0xe9 at position 2"}[encoding]
    with pytest.raises(ValueError, match="UTF-8") as raised:
        read_plan(file)
    assert str(raised.value) == f"{file}: must be text in UTF-8, got byte {byte}"


def test_a_run_whose_name_no_file_system_takes_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    """Beside a run ``traceback-NAME.txt`` may be written, and a file's name has at most 255 bytes."""
    declared = 'preset = "smoke"\n[fields]\nprey.n_hidden = [{}]'
    longest = "1" + "0" * (255 - len("traceback-smoke-prey.n_hidden=1-seed0.txt"))
    (run,) = plan_of(declared.format(longest), tmp_path)
    assert len(f"traceback-{run[1]}.txt".encode()) == 255
    with pytest.raises(ValueError, match=r"in at most 241 characters, got 242: give fewer fields as lists") as raised:
        plan_of(declared.format(longest + "0"), tmp_path)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 300


def test_a_value_added_to_a_list_leaves_the_names_of_the_others(tmp_path: Path) -> None:
    before = plan_of('preset = "smoke"\n[fields]\nesp.n_trials = [50]', tmp_path)
    after = plan_of('preset = "smoke"\n[fields]\nesp.n_trials = [50, 100]', tmp_path)
    assert set(before) < set(after)


def test_a_byte_order_mark_is_passed_over(tmp_path: Path) -> None:
    assert plan_of('\ufeffpreset = "smoke"', tmp_path) == [("smoke", "smoke-seed0")]
