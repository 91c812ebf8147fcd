"""Rows in their places, and files that are something else left alone."""

from __future__ import annotations

import dataclasses
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from esp_trainer.benchmark.leaderboard import append
from esp_trainer.benchmark.report import BenchmarkResult

Make = Callable[..., BenchmarkResult]


@pytest.fixture
def board(tmp_path: Path) -> Path:
    return tmp_path / "board.md"


def rows(board: Path) -> dict[str, list[str]]:
    """The names under each title, in order."""
    parts = re.split(r"^## (.+)$", board.read_text(), flags=re.MULTILINE)[1:]
    return {
        title: re.findall(r"^\| ((?!name|---)(?:\\\||[^|])+) \|", body, re.MULTILINE)
        for title, body in zip(parts[::2], parts[1::2], strict=True)
    }


def test_a_row_tells_all_that_is_needed_to_verify_it(board: Path, result: Make):
    append(board, result())
    cells = board.read_text().splitlines()[-1].strip("| ").split(" | ")
    assert cells[:6] == ["hunters", "0.400", "0.400", "0.250", "0.500", "1.000"]
    assert cells[6:9] == ["31 [-5, 66]", "+0.013", "0.250"]
    assert cells[9:11] == ["`0123456789abcdef`", "`fedcba98`"]
    assert cells[12] == f"`{result().command}`"


def test_the_best_against_held_out_teams_comes_first(board: Path, result: Make):
    for score in (0.3, 0.5, 0.4):
        append(board, result(score, name=f"with {score}", spec=f"my_policies:p{score}"))
    assert rows(board) == {"3v2, predators": ["with 0.5", "with 0.4", "with 0.3"]}


OPENING = "# Leaderboard\n\nThe best policies of each task, against evolved teams that are held out from training:\n\n"


def test_it_begins_with_how_the_best_do_beside_scripts(board: Path, result: Make):
    append(board, result(0.4, name="a"))
    only = "the best predators catch 0.40 of the held-out prey"
    assert board.read_text().startswith(f"{OPENING}- On `3v2` {only}.\n\nHow well")
    append(board, result(0.1, name="b", digest="surround"))
    assert f"- On `3v2` {only} (the best script 0.10).\n\n" in board.read_text()
    append(board, result(0.8, name="c", role="prey", digest="flee_nearest"))
    append(board, result(0.7, name="d", role="prey"))
    assert board.read_text().startswith(
        f"{OPENING}- On `3v2` {only} (the best script 0.10), and the best prey escape 0.80 of the time from "
        "held-out predators (a script; the best other policy 0.70).\n\n"
    )


@pytest.mark.parametrize("later", ["The best policies .+\n\n", "The best policies .+\n\n- On `3v2` .+\n\n"])
def test_one_of_an_older_release_gets_its_opening_and_answer(board: Path, result: Make, later: str):
    append(board, result(name="a"))
    older = re.sub(later, "", board.read_text())
    assert not older.startswith(OPENING)
    board.write_text(older)
    append(board, result(name="b", task="3v1"))
    best = "the best predators catch 0.40 of the held-out prey."
    assert f"{OPENING}- On `3v1` {best}\n- On `3v2` {best}\n\nHow well" in board.read_text()


def test_tasks_and_roles_have_tables_of_their_own(board: Path, result: Make):
    append(board, result(name="a"))
    append(board, result(name="b", role="prey"))
    append(board, result(name="c", task="3v1"))
    assert rows(board) == {"3v1, predators": ["c"], "3v2, predators": ["a"], "3v2, prey": ["b"]}


def test_the_same_policy_measured_the_same_way_is_there_once(board: Path, result: Make):
    append(board, result(name="first"))
    before = board.read_bytes()
    append(board, result(name="first"))
    assert board.read_bytes() == before
    append(board, result(name="renamed"))
    assert rows(board) == {"3v2, predators": ["renamed"]}
    for change in ({"digest": "f" * 20}, {"seed": 6}, {"zoo": "1" * 16}, {"drawn": True}):
        append(board, result(name=str(change), **change))
    assert len(rows(board)["3v2, predators"]) == 5


def test_one_that_did_not_come_through_is_refused(board: Path, result: Make):
    with pytest.raises(ValueError, match=r"^only a candidate that met the whole gauntlet can be on a leaderboard$"):
        append(board, result(standing=None))
    assert not board.exists()


def test_a_file_that_is_something_else_is_left_as_it_is(board: Path, result: Make):
    board.write_text("# My notes\n")
    with pytest.raises(
        ValueError, match=r"board\.md is not a leaderboard: it does not begin with the introduction of one$"
    ):
        append(board, result())
    assert board.read_text() == "# My notes\n"


@pytest.mark.parametrize("name", ["a|b", "a\nb", "a | b", "`a`", "## a"])
def test_a_name_cannot_break_the_table(name: str, board: Path, result: Make):
    append(board, result(name=name))
    append(board, result(0.9, name="best", spec="my_policies:best"))
    text = board.read_text()
    assert [line.count(" | ") for line in text.splitlines() if line.startswith("| ")] == [12] * 4
    assert len(rows(board)["3v2, predators"]) == 2
    assert list(rows(board)) == ["3v2, predators"]


def test_a_blank_name_does_not_shift_the_scores_by_which_rows_are_sorted(board: Path, result: Make):
    """The first is better against all, the second against the worst tenth."""
    standing = result().standing
    assert standing is not None
    better = dataclasses.replace(standing, generalist={**standing.generalist, "held out": (0.9, 0.1)})
    append(board, result(name=" ", spec="my_policies:a", standing=better))
    append(board, result(0.5, name="b", spec="my_policies:b"))
    found = [line.split("|")[2].strip() for line in board.read_text().splitlines()[-2:]]
    assert found == ["0.900", "0.500"]


@pytest.mark.parametrize("row", ["| hunters |", "| hunters | best | x |", "| hunters | 0.4"])
def test_a_leaderboard_with_a_row_that_is_not_ours_is_refused_and_left_as_it_is(row: str, board: Path, result: Make):
    append(board, result())
    board.write_text("\n".join([*board.read_text().splitlines()[:-1], row, ""]))
    before = board.read_bytes()
    with pytest.raises(ValueError, match=r"board\.md") as refused:
        append(board, result(0.5, spec="my_policies:b"))
    assert "\n" not in str(refused.value)
    assert board.read_bytes() == before


def test_names_are_kept_where_the_system_does_not_write_utf_8(board: Path, result: Make):
    """Such as on Windows: it is our file, and in UTF-8 wherever it is written."""
    append(board, result(name="Jäger"))
    read = "from esp_trainer.benchmark.leaderboard import read_leaderboard"
    code = f"import pathlib; {read}; read_leaderboard(pathlib.{board!r})"
    plain = {**os.environ, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "LC_ALL": "C"}
    done = subprocess.run([sys.executable, "-c", code], env=plain, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
