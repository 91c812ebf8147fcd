"""A result as text, as numbers and as a figure."""

from __future__ import annotations

import csv
import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from esp_trainer.benchmark.report import BenchmarkResult, benchmark_table, save_benchmark
from esp_trainer.cli.parser import make_parser

Make = Callable[..., BenchmarkResult]


def test_the_table_tells_each_meeting_and_what_all_say(result: Make):
    assert benchmark_table(result()).splitlines() == [
        "hunters: predators of 3v2, 64 episodes each from held-out starts (seed 5)",
        "",
        "held out                                caught [95% interval]           fitness  all caught after",
        "held-out/x-3v2/prey/seed-1-late          0.400 [0.289, 0.522]             12.50        71.2 steps",
        "",
        "older held out                          caught [95% interval]           fitness  all caught after",
        "held-out/paper-3v2/prey/seed-1-late      0.250 [0.160, 0.368]             12.50        80.0 steps",
        "",
        "zoo                                     caught [95% interval]           fitness  all caught after",
        "x-3v2/prey/seed-2-late                   0.500 [0.381, 0.619]             10.00                 -",
        "",
        "scripts                                 caught [95% interval]           fitness  all caught after",
        "random                                   1.000 [0.943, 1.000]             25.00        30.0 steps",
        "",
        "held out       0.400 prey caught, 0.400 against the worst tenth",
        "older held out 0.250 prey caught, 0.250 against the worst tenth",
        "zoo            0.500 prey caught, 0.500 against the worst tenth",
        "scripts        1.000 prey caught, 1.000 against the worst tenth",
        "rating         31 [-5, 66] points, number 3 of 17",
        "gain           +0.013 against the best mixture of opponents, less the value of their game",
        "exploited      0.250 less than that value against its worst opponent",
    ]


def test_prey_are_told_by_what_is_not_caught(result: Make):
    assert "held out       0.400 prey not caught, 0.400 against the worst tenth" in benchmark_table(result(role="prey"))


def test_a_candidate_that_did_not_finish_is_reported(result: Make):
    lines = benchmark_table(result(standing=None, rows=result().rows[:1])).splitlines()
    assert lines[-1] == "the candidate did not finish"
    assert not any("random" in line for line in lines)


def test_the_command_gives_the_same_again(result: Make):
    words = "esp-trainer benchmark --policy my_policies:hunters --role predators --task 3v2 --episodes 64 --seed 5"
    assert result().command == words
    assert result(drawn=True).command == f"{words} --drawn"


def test_equal_results_are_equal_files_and_others_are_not(result: Make, tmp_path: Path):
    for place, made in {"one": result(), "again": result(), "other": result(held_out=0.41)}.items():
        save_benchmark(made, tmp_path / place)
    files = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert files == ["results.json", "scores.csv", "scores.png", "table.txt"]
    for name in files:
        one, again, other = ((tmp_path / place / name).read_bytes() for place in ("one", "again", "other"))
        assert one == again
        assert one != other


def test_what_is_kept_can_be_read_back(result: Make, tmp_path: Path):
    save_benchmark(result(), tmp_path)
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["complete"] is True
    assert told["digest"] == "0123456789abcdef0123"
    assert [row["caught"]["rate"] for row in told["rows"]] == [0.4, 0.25, 0.5, 1.0]
    assert told["standing"]["rank"] == 3
    with (tmp_path / "scores.csv").open() as file:
        assert {row["opponent"]: float(row["caught"]) for row in csv.DictReader(file)} == {
            row["opponent"]: row["caught"]["rate"] for row in told["rows"]
        }
    assert (tmp_path / "table.txt").read_text() == f"{benchmark_table(result())}\n\n{result().command}\n"


def test_part_of_a_way_is_kept_as_part_of_it(result: Make, tmp_path: Path):
    save_benchmark(result(standing=None, rows=result().rows[:2]), tmp_path / "some")
    save_benchmark(result(standing=None, rows=[]), tmp_path / "none")
    assert json.loads((tmp_path / "some/results.json").read_text())["complete"] is False
    assert len(json.loads((tmp_path / "some/results.json").read_text())["rows"]) == 2
    assert not (tmp_path / "none/scores.png").exists()


@pytest.mark.parametrize("spec", ["my_policies:hunters", "a dir/it's.safetensors", 'sb3:PPO:"x" $HOME.zip'])
def test_the_command_is_understood_by_a_shell_and_by_us(spec: str, result: Make):
    words = shlex.split(result(spec=spec, drawn=True).command)
    options = make_parser().parse_args(words[1:])
    assert words[0] == "esp-trainer"
    assert (options.policy, options.role, options.task) == (spec, "predators", "3v2")
    assert (options.episodes, options.seed, options.drawn) == (64, 5, True)


def test_a_name_is_not_drawn_as_a_formula(result: Make, tmp_path: Path):
    """Which may be a wrong one: the figure comes last, after all the playing."""
    save_benchmark(result(name="$a^^$"), tmp_path)
    assert (tmp_path / "scores.png").is_file()
