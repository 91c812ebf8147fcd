"""The comparison of learners: its intervals, its tables, and who is trained; tests/ecosystem runs it whole."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from learners import curves, report, train  # noqa: E402
from learners.contestants import CONTESTANTS, TeamKind, small  # noqa: E402
from learners.matrix import Matrix, _spent  # noqa: E402

from esp_trainer import preset  # noqa: E402
from esp_trainer.teams.zoo import known_teams  # noqa: E402
from predprey_env.policies import SCRIPTS as SCRIPTED  # noqa: E402


def matrix() -> Matrix:
    """Two seeds of `ppo`, three of `paper` as predators and two as prey, and a script on each side."""
    caught = np.array(
        [
            [0.1, 0.3, 0.5, 0.7, 0.9],
            [0.3, 0.5, 0.7, 0.9, 0.9],
            [0.2, 0.2, 0.2, 0.2, 0.6],
            [0.2, 0.2, 0.2, 0.2, 0.6],
            [0.2, 0.2, 0.2, 0.2, 0.6],
            [0.0, 0.0, 1.0, 1.0, 0.5],
        ]
    )
    return Matrix(
        predators=np.array(["ppo", "ppo", "paper", "paper", "paper", "intercept"]),
        prey=np.array(["ppo", "ppo", "paper", "paper", "flee_nearest"]),
        caught=caught,
        predators_held_out=np.array([[0.2, 0.4], [0.4, 0.6], [0.5, 0.5], [0.5, 0.5], [0.5, 0.5], [0.1, 0.1]]),
        prey_held_out=np.array([[0.1, 0.1, 0.2, 0.2, 0.0], [0.3, 0.3, 0.4, 0.4, 0.0]]),
        predators_spent=np.array([[100.0, 2e6], [110, 2e6], [20, 3e6], [20, 3e6], [20, 3e6], [np.nan, np.nan]]),
        prey_spent=np.array([[90.0, 2e6], [100, 2e6], [20, 3e6], [20, 3e6], [np.nan, np.nan]]),
        meanings=np.array(
            [["ppo", "learned"], ["paper", "evolved"], ["intercept", "a script"], ["flee_nearest", "one"]]
        ),
        n_episodes=512,
    )


def two_runs() -> Matrix:
    """The same with as many seeds of predators as of prey."""
    names = np.array(["ppo", "ppo", "paper", "paper", "greedy_chase", "intercept"])
    return Matrix(**(vars(matrix()) | {"predators": names}))


def cells(page: str, beginning: str) -> list[str]:
    """Those of a table's row behind its first."""
    (line,) = [line for line in page.splitlines() if line.startswith(beginning)]
    return [cell.strip() for cell in line.strip("| ").split("|")][1:]


def means(found: list[str]) -> list[float | None]:
    return [None if cell == "-" else float(cell.split()[0]) for cell in found]


@pytest.fixture
def page(tmp_path: Path) -> str:
    return report.write(matrix(), tmp_path).read_text()


def test_what_a_run_cost_is_its_mean_over_seeds(page: str) -> None:
    assert cells(page, "| `ppo` | learned") == ["learned", "2", "100.0", "2 M"]
    assert cells(page, "| `paper` | evolved") == ["evolved", "3", "20.0", "3 M"]
    assert cells(page, "| `intercept` | a script") == ["a script", "1", "-", "-"]


def test_strength_is_told_of_both_sides_against_each_kind_of_opponent(page: str) -> None:
    strengths = page.split("## How strong")[1].split("## Who catches")[0]
    # Of predators: held-out prey, scripted prey, learners of another name; then the same of prey, by what escapes.
    assert means(cells(strengths, "| `ppo` |")) == [0.4, 0.9, 0.7, 0.8, 1.0, 0.8]
    assert means(cells(strengths, "| `paper` |")) == [0.5, 0.6, 0.2, 0.7, 0.0, 0.3]
    assert means(cells(strengths, "| `intercept` |")) == [0.1, 0.5, 0.5, None, None, None]
    assert means(cells(strengths, "| `flee_nearest` |")) == [None, None, None, 1.0, 0.5, 0.28]


def test_a_cell_is_the_mean_over_the_seeds_of_both(page: str, tmp_path: Path) -> None:
    assert means(cells(page, "| **ppo** |")) == [0.3, 0.7, 0.9]
    assert means(cells(page, "| **intercept** |")) == [0.0, 1.0, 0.5]
    rows = (tmp_path / "benchmark/matrix.csv").read_text().splitlines()
    assert rows[0] == "predators,prey,caught,low,high"
    assert rows[1].startswith("ppo,ppo,0.3,")
    assert len(rows) == 1 + 3 * 3


def test_at_equal_compute_the_difference_is_between_seeds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(report, "EQUAL", (("ppo", "paper"),))
    page = report.write(two_runs(), tmp_path).read_text()
    found = cells(page, "| `ppo` less `paper` |")
    assert found[0] == "200 and 20", "two runs of PPO, one of evolution"
    # Held out: 0.3 and 0.5 against two of 0.5; what escapes: 0.8 against 0.7; scripts: 0.9 less 0.6, 0.9 less 0.4.
    assert [float(cell.split()[0]) for cell in found[1:5]] == [-0.1, 0.1, 0.3, 0.5]
    assert "Of these 4 differences 0 are wholly below 0, where evolution is ahead, and 0 wholly above." in page


def test_head_to_head_is_who_catches_more_of_the_others() -> None:
    assert report._head_to_head(two_runs(), "ppo", "paper").mean == pytest.approx(0.7 - 0.2)


def test_a_matrix_is_kept_and_read_back(tmp_path: Path) -> None:
    matrix().save(tmp_path / "kept" / "matrix.npz")
    found = Matrix.load(tmp_path / "kept" / "matrix.npz")
    assert found.n_episodes == 512
    for name, value in vars(matrix()).items():
        np.testing.assert_array_equal(getattr(found, name), value)


# Who is compared.


def test_contestants_are_named_once_and_made_of_what_there_is() -> None:
    names = [each.name for each in CONTESTANTS]
    assert len(set(names)) == len(names)
    for each in CONTESTANTS:
        if each.method == "script":
            assert all(each.name in SCRIPTED[role] for role in each.roles)
        if each.preset:
            assert preset(each.preset).env.n_prey == 2
    scripts = {each.name for each in CONTESTANTS if each.method == "script"}
    assert scripts == {*SCRIPTED["predators"], *SCRIPTED["prey"]}


def test_their_seeds_are_not_those_of_the_zoo() -> None:
    theirs = {seed for each in CONTESTANTS if each.method != "script" for seed in each.seeds}
    assert len(theirs) >= 5
    assert not theirs & {team.seed for team in known_teams().values()}


def test_runs_that_contestants_share_are_made_once(tmp_path: Path) -> None:
    jobs: dict[str, object] = {}
    for each in map(small, CONTESTANTS):
        if each.method == "ppo":
            jobs |= train._jobs(each, tmp_path)
    apart = [
        f"apart-{reward}, {role}, {seed}"
        for reward in ("dense", "terminal")
        for role in ("predators", "prey")
        for seed in (700, 701)
    ]
    assert sorted(jobs) == sorted([*apart, "together-dense, 700", "together-dense, 701"])


def test_what_is_there_is_not_made_again(tmp_path: Path) -> None:
    each = TeamKind("ppo", "", "ppo", seeds=(1,))
    file = train.team_file(tmp_path, each, "predators", 1)
    file.parent.mkdir(parents=True)
    file.touch()
    assert list(train._jobs(each, tmp_path)) == ["apart-dense, prey, 1"]


def test_what_ppo_spent_until_a_checkpoint_is_read_from_its_curve(tmp_path: Path) -> None:
    each = TeamKind("ppo", "", "ppo", seeds=(1,), part=5, trained="together")
    file = train.spent_file(tmp_path, each, "prey", 1)
    file.parent.mkdir(parents=True)
    lines = [f"{role},{100 * i},{10 * i}" for i in range(1, 11) for role in ("predators", "prey")]
    file.write_text("\n".join(["role,steps,cpu_seconds", *lines]))
    assert _spent(each, tmp_path, "prey", 1) == (50.0, 1000.0)


def test_what_evolution_spent_is_read_from_beside_its_team(tmp_path: Path) -> None:
    each = TeamKind("paper", "", "evolved", seeds=(1,))
    file = train.spent_file(tmp_path, each, "prey", 1)
    file.parent.mkdir(parents=True)
    file.write_text(json.dumps({"cpu_seconds": 12.5, "steps": 7}))
    assert _spent(each, tmp_path, "prey", 1) == (12.5, 7)
    assert re.search(r"paper/seed-1/prey\.json$", str(file))


def test_curves_are_read_side_by_side_and_drawn_with_their_data(tmp_path: Path) -> None:
    each = TeamKind("ppo, self-play", "", "ppo", seeds=(1, 2), trained="together")
    for seed in each.seeds:
        file = train.curve_file(tmp_path, each, "prey", seed)
        file.parent.mkdir(parents=True)
        lines = [
            f"{role},{i * 100},{i},{level}" for i in range(1, 21) for role, level in (("predators", 0.4), ("prey", 0.2))
        ]
        file.write_text("\n".join(["role,steps,cpu_seconds,caught", *lines]))
    found = curves.gather([each], tmp_path)
    assert found.roles.tolist() == ["predators", "predators", "prey", "prey"]
    np.testing.assert_allclose(found.caught[:2], 0.4)
    np.testing.assert_allclose(found.caught[2:], 0.2)
    assert found.steps[0, [0, -1]].tolist() == [100, 2000]
    found.save(tmp_path / "curves.npz")
    curves.draw(curves.Curves.load(tmp_path / "curves.npz"), tmp_path / "curves.png")
    header = (tmp_path / "curves.csv").read_text().splitlines()[0]
    assert "ppo, self-play, prey: million steps" in header
