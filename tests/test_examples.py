"""The examples run as they stand, in their quick form, and print figures that make sense."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from waiting import PATIENCE

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
LONGER = "ppo_one_team.py", "self_play.py", "mappo.py", "openspiel_game.py"
FILES = sorted(file for file in EXAMPLES.iterdir() if file.suffix in (".py", ".toml"))


def printed(name: str, place: Path) -> str:
    command = [sys.executable, str(EXAMPLES / name), "--quick"]
    done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    return done.stdout


def figures(pattern: str, text: str) -> list[float]:
    """Return the numbers that the group of a pattern matches."""
    found = [float(each) for each in re.findall(pattern, text)]
    assert found, text
    return found


def test_a_team_of_the_zoo_catches_most_of_the_prey(tmp_path: Path) -> None:
    told = printed("play_zoo_team.py", tmp_path)
    (caught,) = figures(r"64 episodes: (\S+) \[", told)
    assert 0.6 < caught < 0.95
    assert figures(r"after (\d+) steps", told)[0] <= 150


@pytest.mark.slow
def test_a_policy_of_ones_own_is_measured_against_every_part_of_the_zoo(tmp_path: Path) -> None:
    told = printed("own_policy.py", tmp_path)
    assert [int(n) for n in figures(r"of the prey of (\d+) teams", told)] == [9, 27, 36, 4]
    assert all(0 <= caught <= 1 for caught in figures(r": (\d\.\d\d) of the prey", told))
    assert figures(r"number (\d+) of 78", told)[0] <= 78


@pytest.mark.slow
def test_a_compiled_player_and_the_same_rule_in_python_play(tmp_path: Path) -> None:
    told = printed("compiled_player.py", tmp_path)
    compiled, python = (float(each.replace(",", "")) for each in re.findall(r": ([\d,]+) steps of the prey", told))
    assert min(compiled, python) > 0  # which is faster depends on who else is at work, so a benchmark says it


@pytest.mark.slow
def test_another_selection_scheme_breeds_predators_that_catch_prey(tmp_path: Path) -> None:
    told = printed("own_selection.py", tmp_path)
    assert re.findall(r"^([\w:]+?) *: the", told, re.MULTILINE) == ["esp", "__main__:Tournament"]
    first = figures(r"catch (\d\.\d\d) of the prey at first", told)
    assert first[0] == first[1], "both begin with the same genomes"
    assert all(0 < caught < 1 for caught in figures(r"(\d\.\d\d) in the last ones", told))


@pytest.mark.parametrize(
    ("example", "compared"),
    [
        ("own_algorithm.py", ["own", "esp"]),
        pytest.param("own_network.py", ["leaky", "feedforward"], marks=pytest.mark.slow),
        pytest.param("own_sight.py", ["near", "everywhere"], marks=pytest.mark.slow),
    ],
)
def test_a_part_of_ones_own_evolves_predators_beside_another(example: str, compared: list[str], tmp_path: Path) -> None:
    told = printed(example, tmp_path)
    assert re.findall(r"^(\w+) *: the champions", told, re.MULTILINE) == compared
    assert all(0 <= caught <= 1 for caught in figures(r"(\d\.\d\d) in the end", told))
    if example == "own_sight.py":
        assert "predator_0 observes [-1.  9.  1.]" in told


@pytest.mark.slow
def test_a_game_of_ones_own_is_evolved_and_measured(tmp_path: Path) -> None:
    told = printed("own_game.py", tmp_path)
    assert "against the runner of generation 0 1 2 3\n" in told
    rows = re.findall(r"^ +\d \|(.*)$", told, re.MULTILINE)
    assert len(rows) == 4
    assert all(0 <= float(payoff) <= 20 for row in rows for payoff in row.split())


def test_a_race_is_measured_by_cross_play(tmp_path: Path) -> None:
    told = printed("coevolve.py", tmp_path)
    rows = re.findall(r"^ +\d+ \|(.*)$", told, re.MULTILINE)
    assert len(rows) == 6
    assert all(0 <= float(share) <= 1 for row in rows for share in row.split())


@pytest.mark.slow
def test_hesitant_predators_are_less_exploitable(tmp_path: Path) -> None:
    told = printed("exploitability.py", tmp_path)
    certain, *hesitant = figures(r"hesitant.* exploitability (\d\.\d+)", told)
    assert certain > 0.9, "the prey foresees every move"
    assert all(loss <= certain for loss in hesitant)


@pytest.mark.slow
def test_the_sweep_is_declared_and_runs(tmp_path: Path) -> None:
    declared = (EXAMPLES / "sweep.toml").read_text()
    assert "esp-trainer sweep examples/sweep.toml" in declared
    quick = re.sub(r"generations = \d+", "generations = 2", declared)
    assert quick != declared
    (tmp_path / "sweep.toml").write_text(quick)
    command = [sys.executable, "-m", "esp_trainer", "sweep", "sweep.toml", "--quiet"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "runs/sweep/runs.csv").read_text().splitlines()) == 1 + 4
    assert "past_share=0.5" in done.stdout


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_an_example_is_short_and_says_how_to_run_it(file: Path) -> None:
    text = file.read_text()
    assert len(text.splitlines()) <= (150 if file.name in LONGER else 60)
    assert f"examples/{file.name}" in text, "its command"
    assert f"[`{file.name}`]({file.name})" in (EXAMPLES / "README.md").read_text(), "its row"


def test_there_are_at_least_eight_examples_and_the_readme_points_there() -> None:
    assert len(FILES) >= 8
    assert "[Examples](examples)" in (ROOT / "README.md").read_text()
