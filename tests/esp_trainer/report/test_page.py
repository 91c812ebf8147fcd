"""The command ``report`` and what is in its page; how the page behaves is in ``test_page_used.py``."""

from __future__ import annotations

import html
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from esp_trainer.cli import main

DataOf = Callable[[Path], dict[str, Any]]


def story(page: Path) -> str:
    text = page.read_text("utf-8")
    return html.unescape(text[text.index('<p id="verdict">') : text.index("</section>")])


def test_a_page_is_one_file_that_asks_for_no_other(page_file: Path) -> None:
    text = page_file.read_text("utf-8")
    outside_of_data = text[: text.index('<script type="application/json"')]
    for tag in ('src="', "src='", '<link rel="stylesheet', "@import"):
        assert tag not in outside_of_data.replace(PLOTLY_OWN(outside_of_data), "")
    assert "default-src 'none'" in text


def PLOTLY_OWN(text: str) -> str:  # noqa: N802
    """Plotly's script, which holds tags as strings."""
    begin = text.index("plotly.js v")
    return text[begin : text.index("</script>", begin)]


def test_the_same_run_gives_the_same_page(runs: list[Path], report: Callable[..., int], tmp_path: Path) -> None:
    for name in ("a.html", "b.html"):
        assert report(runs[0], "--out", tmp_path / name) == 0
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


def test_a_page_holds_all_champions_that_there_is_room_for(page_file: Path, data_of: DataOf) -> None:
    (run,) = data_of(page_file)["runs"]
    assert run["sides"]["predators"]["generations"] == list(range(24))


def test_of_more_it_holds_those_that_were_measured(
    runs: list[Path], report: Callable[..., int], tmp_path: Path, data_of: DataOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("esp_trainer.report.page._GENES", 1000)
    assert report(runs[0], "--out", tmp_path / "page.html") == 0
    data = data_of(tmp_path / "page.html")
    kept = data["runs"][0]["sides"]["prey"]["generations"]
    assert set(kept) >= set(data["matrix"]["prey"]) | {moment["generation"] for moment in data["moments"]}
    assert len(kept) <= 24


def test_it_goes_beside_what_it_is_about(runs: list[Path], report: Callable[..., int], tmp_path: Path) -> None:
    places = [Path(shutil.copytree(run, tmp_path / run.name)) for run in runs]
    assert report(places[0]) == 0
    assert (places[0] / "report.html").exists()
    assert report(*places) == 0
    assert (tmp_path / "report.html").exists()


def test_a_run_can_be_resumed_beside_its_page(run: Path, report: Callable[..., int]) -> None:
    assert report(run) == 0
    page = (run / "report.html").read_bytes()
    assert main(["resume", str(run), "--generations", "25", "--quiet"]) == 0
    assert (run / "report.html").read_bytes() == page


def test_every_file_of_a_run_is_explained(run: Path, report: Callable[..., int]) -> None:
    assert report(run) == 0
    explained = (Path(__file__).parents[3] / "docs/files.md").read_text("utf-8")
    kinds = {re.sub(r"\d{5}", "00041", file.relative_to(run).as_posix()) for file in run.rglob("*") if file.is_file()}
    assert "analysis/cross-play.safetensors" in kinds
    assert {kind for kind in kinds if f"`{kind.replace('prey', 'predators')}`" not in explained} == set()


def test_what_is_missing_stands_on_the_page(run: Path, report: Callable[..., int], capsys: Any) -> None:
    (run / "checkpoint.safetensors").unlink()
    for file in (run / "champions").iterdir():
        file.unlink()
    assert report(run) == 0
    text = story(run / "report.html")
    assert "Nothing can be said of progress: no champion could be read." in text
    assert "The story in two lines" in text
    assert "no match can be played" in text
    assert "no match can be played" in capsys.readouterr().err


def test_a_run_in_progress_says_how_far_it_is(run: Path, report: Callable[..., int]) -> None:
    config = run / "config.json"
    config.write_text(config.read_text().replace('"generations": 24', '"generations": 100'))
    assert report(run) == 0
    assert "run has 24 of its 100 generations so far." in story(run / "report.html")


def test_a_run_that_cannot_be_read_is_left_out_of_several(
    runs: list[Path], run: Path, report: Callable[..., int], tmp_path: Path
) -> None:
    (run / "config.json").write_text("{")
    assert report(*runs, run, "--out", tmp_path / "page.html") == 0
    assert f"Left out: {run / 'config.json'} is damaged" in story(tmp_path / "page.html")


def test_runs_of_different_lengths_are_shown_as_far_as_all_go(
    runs: list[Path], run: Path, report: Callable[..., int], tmp_path: Path, data_of: DataOf
) -> None:
    assert main(["resume", str(run), "--generations", "27", "--quiet"]) == 0
    assert report(run, runs[1], "--out", tmp_path / "page.html") == 0
    assert "The runs have 24 to 27 generations: the first 24 of each are measured." in story(tmp_path / "page.html")
    assert data_of(tmp_path / "page.html")["runs"][0]["sides"]["prey"]["generations"] == list(range(24))


@pytest.mark.slow
@pytest.mark.parametrize("generations", [1, 2, 3])
def test_a_short_run_has_a_page_too(
    generations: int, runs: list[Path], report: Callable[..., int], tmp_path: Path, open_page: Callable[..., Any]
) -> None:
    place = tmp_path / "run"
    assert main(["train", "smoke", "--generations", str(generations), "--out", str(place), "--quiet"]) == 0
    assert report(place) == 0
    assert "Nobody can say who improved: that takes at least 20 generations." in story(place / "report.html")
    tab = open_page(place / "report.html")
    tab.until("predprey.player.match.length > 0")
    tab.assert_quiet()


@pytest.mark.slow
def test_a_run_against_a_script_has_a_page_too(
    report: Callable[..., int], tmp_path: Path, open_page: Callable[..., Any]
) -> None:
    place = tmp_path / "run"
    options = ["--predators.policy", "surround", "--generations", "20", "--out", str(place), "--quiet"]
    assert main(["train", "smoke", *options]) == 0
    assert report(place) == 0
    assert "Against the script surround: " in story(place / "report.html")
    tab = open_page(place / "report.html")
    assert tab.page.locator(".choice .predators legend").inner_text() == "Predators by the script surround"
    assert "as its script surround says" in tab.page.locator("#thoughts").inner_text()
    tab.assert_quiet()


def refusal(capsys: Any, *arguments: object) -> str:
    assert main(["report", *map(str, arguments)]) != 0
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    return str(line)


def test_mistakes_are_one_line(run: Path, tmp_path: Path, capsys: Any) -> None:
    assert "holds no run" in refusal(capsys, tmp_path)
    assert "runs must be different ones" in refusal(capsys, run, run)
    copy = shutil.copytree(run, tmp_path / "copy")
    assert refusal(capsys, run, copy) == f"esp-trainer: runs must have different seeds, got {run} and {copy} with 0"


def test_a_run_whose_networks_are_not_found_is_refused(run: Path, capsys: Any) -> None:
    config = run / "config.json"
    config.write_text(config.read_text().replace('"network": "feedforward"', '"network": "nowhere:Mine"'))
    assert refusal(capsys, run) == (
        f"esp-trainer: {run}: network nowhere:Mine cannot be imported: ModuleNotFoundError: No module named 'nowhere'"
    )
    assert not (run / "report.html").exists()


def test_runs_of_one_name_are_told_apart_by_their_places(
    runs: list[Path], report: Callable[..., int], tmp_path: Path
) -> None:
    places = [Path(shutil.copytree(run, tmp_path / run.name / "run")) for run in runs]
    assert report(*places, "--out", tmp_path / "page.html") == 0
    assert str(places[1]) in (tmp_path / "page.html").read_text("utf-8")


def test_a_place_that_cannot_be_written_to_is_refused_before_anything_is_played(
    run: Path, tmp_path: Path, capsys: Any
) -> None:
    place = tmp_path / "no/such/page.html"
    assert refusal(capsys, run, "--out", place) == f"esp-trainer: {place}: No such file or directory"


@pytest.mark.slow
def test_the_page_of_captures_speaks_of_clicks(page_file: Path, open_page: Callable[..., Any]) -> None:
    shown = open_page(page_file).page.locator("body").inner_text()
    assert "A click on a cell plays that match." in shown
    assert "is progress. A click on a point plays that generation against the last of the other side." in shown
