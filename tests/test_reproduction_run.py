"""The whole reproduction once, in small."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from once import made_once
from waiting import PATIENCE

SCRIPTS = Path(__file__).parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from reproduction.settings import read_settings, small  # noqa: E402

SETTINGS = small(read_settings())


def reproduce(place: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPTS / "reproduce_paper.py"), "--quick", "--workers", "1", *options]
    where = ["--out", str(place / "out"), "--runs", str(place / "runs")]
    return subprocess.run([*command, *where], capture_output=True, text=True, check=False, timeout=PATIENCE, cwd=place)


def times(place: Path) -> dict[str, int]:
    """When each file was last written."""
    return {str(p.relative_to(place)): p.stat().st_mtime_ns for p in sorted(place.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    def make(place: Path) -> None:
        done = reproduce(place)
        assert done.returncode == 0, done.stderr
        assert done.stdout.endswith(f"reproduction.md: {len(SETTINGS) - 2} of {len(SETTINGS) - 2} settings\n")

    return made_once(tmp_path_factory, "reproduction", make)


@pytest.mark.slow
def test_the_report_links_to_figures_with_their_data(reproduced: Path):
    page = (reproduced / "out" / "reproduction.md").read_text()
    supplement = (reproduced / "out" / "reproduction" / "supplement.md").read_text()
    links = set(re.findall(r"\]\((reproduction/[^)]+)\)", page))
    assert {"reproduction/data", "reproduction/supplement.md"} <= links
    assert "](reproduction/" not in supplement
    links |= {f"reproduction/{link}" for link in re.findall(r"\]\(([^)/#]+)\)", supplement)}
    figures = {link for link in links if link.endswith(".png")}
    assert {Path(link).stem for link in figures} == {
        *(
            "success",
            "ciao",
            "master",
            "global",
            "ablations",
            "sensitivity",
            "parity",
            "behaviours",
            "moments",
            "scripts",
        )
    }
    for figure in figures:
        assert (reproduced / "out" / figure).read_bytes().startswith(b"\x89PNG")
        header, *rows = (reproduced / "out" / figure).with_suffix(".csv").read_text().splitlines()
        assert header
        assert rows
    names = {name for name, each in SETTINGS.items() if each.part != "panel"}
    kept = {path.stem for path in (reproduced / "out" / "reproduction" / "data").iterdir()}
    assert names <= kept <= {*names, "moments"}
    assert "nan" not in re.findall(r"[a-z]+", page + supplement)


@pytest.mark.slow
def test_a_report_can_be_made_from_what_is_kept_alone(reproduced: Path, tmp_path: Path):
    place = tmp_path / "place"
    shutil.copytree(reproduced, place, ignore=shutil.ignore_patterns("runs", "*.png", "*.md"))
    done = reproduce(place, "--report")
    assert done.returncode == 0, done.stderr
    assert not (place / "runs").exists()
    for path in (reproduced / "out").rglob("*.csv"):
        assert path.read_text() == (place / path.relative_to(reproduced)).read_text()
    page = (reproduced / "out" / "reproduction.md").read_text()
    assert _without_command((place / "out" / "reproduction.md").read_text()) == _without_command(page)
    shutil.rmtree(place / "out")
    done = reproduce(place, "--report")
    assert done.returncode == 2
    assert "there is nothing to report on" in done.stderr


@pytest.mark.slow
def test_what_is_done_is_not_done_again_and_what_is_lost_is(reproduced: Path, tmp_path: Path):
    place = tmp_path / "place"
    shutil.copytree(reproduced, place)
    runs, kept = place / "runs", place / "out" / "reproduction" / "data"
    before, kept_before = times(runs), times(kept)
    page = (place / "out" / "reproduction.md").read_text()
    csvs = {path.name: path.read_text() for path in (place / "out" / "reproduction").glob("*.csv")}
    lost = runs / "paper-3v1-seed1"
    run, measured = (lost / "metrics.jsonl").read_bytes(), runs / "measured/paper-3v1-seed1.npz"
    arrays = dict(np.load(kept / "paper-3v1.npz"))
    shutil.rmtree(lost)
    measured.unlink()
    (kept / "paper-3v1.npz").unlink()
    done = reproduce(place)
    assert done.returncode == 0, done.stderr
    after, kept_after = times(runs), times(kept)
    assert {name.split("/")[0] for name in after if after[name] != before.get(name)} == {lost.name, "measured"}
    assert [name for name in after if name.startswith("measured") and after[name] != before[name]] == [
        "measured/paper-3v1-seed1.npz"
    ]
    assert set(after) == set(before)
    assert (lost / "metrics.jsonl").read_bytes() == run
    changed = {name for name in kept_after if kept_after[name] != kept_before[name]}
    assert changed - {"moments.npz"} == {"paper-3v1.npz"}
    for name, array in np.load(kept / "paper-3v1.npz").items():
        np.testing.assert_array_equal(array, arrays[name])
    assert _without_command((place / "out" / "reproduction.md").read_text()) == _without_command(page)
    assert {path.name: path.read_text() for path in (place / "out" / "reproduction").glob("*.csv")} == csvs


def _without_command(page: str) -> str:
    """Without where it was made and by what command."""
    return re.sub(r"^`python scripts/reproduce_paper\.py .*$", "", page, flags=re.MULTILINE)
