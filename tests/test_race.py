"""The endpoints of ``scripts/prove_race.py``, by hand."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from waiting import PATIENCE

from esp_trainer import Subpopulations, preset
from esp_trainer.coevolution.sides import side_controller
from esp_trainer.config import EspConfig
from esp_trainer.sweep.plan import read_plan

SCRIPTS = Path(__file__).parents[1] / "scripts"
TASKS = ["3v1", "3v2", "steppe"]
sys.path.insert(0, str(SCRIPTS))

from race import courses, endpoints, exploitability, late, long, tables  # noqa: E402
from race.alive import Alive  # noqa: E402
from race.measure import gather, kept_rows, measured_file  # noqa: E402
from race.report import write  # noqa: E402


def measured(caught: list[list[list[float]]], role: str = "predators") -> dict[str, np.ndarray]:
    """Measurements of runs by generation and opponent."""
    return {f"panel.{role}": np.array(caught)}


def test_a_gain_is_the_last_sixth_less_the_first_against_the_same_opponent() -> None:
    """Six generations, two opponents."""
    curve = [[0.1, 0.5], [0.2, 0.5], [0.3, 0.5], [0.5, 0.5], [0.6, 0.5], [0.9, 0.0]]
    np.testing.assert_allclose(endpoints.gains(measured([curve]), "predators"), [[0.8, -0.5]])
    np.testing.assert_allclose(endpoints.gains(measured([curve]), "predators", half=True), [[0.4, -0.5]])
    np.testing.assert_allclose(endpoints.gains(measured([curve], "prey"), "prey"), [[-0.8, 0.5]])
    np.testing.assert_allclose(endpoints.level(measured([curve], "prey"), "prey", "panel"), [0.55])


def test_late_prey_are_also_met_by_the_others_late_predators(tmp_path: Path) -> None:
    """Two runs of six generations: late predators catch 0.7 of the other's late prey, and 0.5."""
    own = np.full(6, np.nan)
    first, second = np.linspace(0.2, 0.7, 6), np.linspace(0.0, 0.5, 6)
    file = tmp_path / "late-steppe.npz"
    assert late.caught_by_others(file, "long") is None
    np.savez(file, **{"long.predators": np.array([np.stack([own, first], axis=1), np.stack([second, own], axis=1)])})
    assert late.caught_by_others(file, "long") == pytest.approx(0.6)
    assert late.caught_by_others(file, "race") is None


def test_a_contrast_is_a_condition_less_the_race() -> None:
    """Four runs of each; in the race the predators catch 0.5 and the prey escape 0.9, in the other 0.3 and 0.9."""
    levels = {"race": 0.5, "paper": 0.3}
    found = {
        name: measured(np.full((4, 12, 6), level).tolist())
        | measured(np.full((4, 12, 6), 0.1).tolist(), "prey")
        | {"config": np.arange(4)}
        for name, level in levels.items()
    }
    cells = tables.contrasts(found).splitlines()[-1].split(" | ")
    assert cells[0] == "| `paper` †"
    assert [cell.split()[0] for cell in cells[1:]] == ["-0.200", "+0.000", "+0.000", "+0.000"]


def test_behaviours_that_grow_are_told_from_the_first_sixth_to_the_last() -> None:
    """Three runs of twelve generations. Blockers rise by 0.06 in each, from 0.2; chance is 0.1. Herding stays."""
    rates = {"blocker": np.linspace(0.2, 0.86, 12), "herding": np.full(12, 0.3)}
    race = {
        f"behaviour.{name}": np.stack([rate, np.full(12, 0.1)], axis=-1)[None].repeat(3, axis=0)
        for name, rate in rates.items()
    }
    assert courses.in_short({"race": race}).endswith("of the run: blocker 0.13 to 0.73.")
    assert courses.in_short({"race": {"behaviour.herding": race["behaviour.herding"]}}) == ""


def test_long_runs_are_named_by_the_rules_of_the_protocol() -> None:
    """Four runs of 20 generations, twelve of them measured: the last tenth is generations 18 and 19."""
    caught = np.full((4, 20), 0.5)
    caught[0, 18:], caught[1, 18:] = 0.04, 0.96
    caught[2, :18], caught[2, 18:] = 0.0, (0.04, 0.08)
    rising, level = np.linspace(0.2, 0.6, 12), np.full(12, 0.6)
    predators = np.stack([rising, rising, rising, rising])[..., None].repeat(6, axis=2)
    escaped = np.stack([level, level, rising, level])[..., None].repeat(6, axis=2)
    arrays = measured(predators.tolist()) | measured((1 - escaped).tolist(), "prey")
    arrays |= {"caught": caught, "config": np.array([json.dumps({"seed": seed}) for seed in (7, 8, 9, 10)])}
    frozen = np.array([[[0.1, 0.9], [0.2, 0.8], [0.3, 0.7]]]).repeat(4, axis=0)  # by contemporaries, by fresh teams
    arrays |= {"response.predators": frozen, "response.prey": 1 - frozen, "exploited.generations": np.arange(4)}
    falling, rising_at_last = np.array([[0.9, 0.9, 0.8, 0.8, 0.5, 0.5]]), np.array([[0.4] * 5 + [0.8]])
    arrays |= {"exploited.predators": falling.repeat(4, axis=0), "exploited.prey": 1 - rising_at_last.repeat(4, axis=0)}
    assert long.outcomes(arrays) == ["won by the prey", "won by the predators", "goes on", "levels off"]
    told = long.tell(arrays, "long.png")
    assert "won by the prey 1, won by the predators 1, goes on 1, levels off 1." in long.in_short(arrays)
    assert "they catch 0.39. That" in long.in_short(arrays), "mean of 0.04, 0.96, 0.06 and 0.5 in the last tenth"
    assert "of the last prey, and late predators of the other runs catch 0.44 of them. In" in long.in_short(
        arrays, 0.44
    )
    assert "one time in four" in told, "a run is said to go on"
    assert "| 10 | levels off | 0.50 -> 0.50 -> 0.50 -> 0.50 -> 0.50 | 0.24 -> 0.35 ->" in told
    assert (
        told.count("| 0.90 -> 0.80 -> 0.50 | 0.40 -> 0.40 -> 0.60 | 0.90 -> 0.80 -> 0.70 | 0.90 -> 0.80 -> 0.70 |") == 4
    )
    assert "it was for exploiting predators in 4 of 4, and for exploiting prey in 0 of 4." in told


def test_exploiters_are_told_by_thirds_and_fresh_teams_beside_contemporaries() -> None:
    """Three runs with six exploiters a side, two in each third; predators catch, and prey are caught by, so much."""
    caught = np.array([[0.9, 0.7, 0.6, 0.6, 0.5, 0.3]]).repeat(3, axis=0)
    arrays = {"exploited.predators": caught, "exploited.prey": caught, "exploited.generations": np.arange(6)[None]}
    frozen = np.array([[[0.1, 0.9], [0.2, 0.8], [0.3, 0.7]]]).repeat(3, axis=0)
    arrays |= {"response.predators": frozen, "response.prey": frozen, "config": np.arange(3)}
    told = "\n".join(exploitability.tell("steppe", {"race": arrays}))
    assert (
        "| `race` † | 0.80 -> 0.60 -> 0.40; -0.400 [-0.400, -0.400] | 0.20 -> 0.40 -> 0.60; +0.400 [+0.400, +0.400] |"
    ) in told
    fresh_and_contemporary_predators = "0.90 -> 0.80 -> 0.70; -0.200 [-0.200, -0.200] | 0.10 -> 0.20 -> 0.30; +0.200"
    assert fresh_and_contemporary_predators in told
    assert told.endswith("+0.200 [+0.200, +0.200] | 0.10 -> 0.20 -> 0.30; +0.200 [+0.200, +0.200] |")
    short = exploitability.in_short(arrays)
    assert "for 60 generations catch 0.70 of the last prey (the run's own 0.30)" in short
    assert "0.30 of such prey escape the last predators (the run's own 0.70)." in short
    splitting = exploitability.of_splitting({"race": arrays, "race-monolithic": arrays})
    assert splitting.endswith(
        "catch 0.40 and 0.40 in the last third of the run, "
        "-0.400 [-0.400, -0.400] and -0.400 [-0.400, -0.400] since the first."
    )


def test_without_measurements_there_is_nothing_to_report(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="nothing to report on"):
        write(tmp_path, tmp_path)


def test_runs_are_added_to_those_that_are_kept(tmp_path: Path) -> None:
    """Seeds 101 and 100 are kept, from before two fields existed and from runs that are gone; seed 102 is new."""
    runs = [run for run in read_plan(SCRIPTS / "race" / "conditions-3v1.toml") if run.cell == "paper"][:3]
    told = [run.config.model_dump() for run in runs]
    for each in told[:2]:
        del each["prey"]["network"], each["genealogy"]
    kept, file = tmp_path / "kept", measured_file(tmp_path / "runs", runs[2])
    kept.mkdir()
    np.savez(kept / "paper.npz", config=[json.dumps(told[i]) for i in (1, 0)], own=[[[0.1]], [[0.2]]], gone=[1, 2])
    file.parent.mkdir(parents=True)
    np.savez(file, config=np.array(runs[2].config.model_dump_json()), own=[[0.3]])
    (tmp_path / "runs" / runs[2].name).mkdir()
    for _ in range(2):
        gather(tmp_path / "runs", runs, kept)
        rows = kept_rows(kept / "paper.npz")
        assert list(rows) == [run.config.model_dump_json() for run in runs]
        assert [row["own"].tolist() for row in rows.values()] == [[[0.2]], [[0.1]], [[0.3]]]
        assert all(row.keys() == {"config", "own"} for row in rows.values()), "what all of them have"


@pytest.mark.parametrize("task", TASKS)
def test_conditions_are_what_the_protocol_says(task: str) -> None:
    plan = read_plan(SCRIPTS / "race" / f"conditions-{task}.toml")
    configs = {run.cell: run.config.replace(preset="custom", seed=0) for run in plan}
    names = (f"race-{task}", "paper-3v1" if task == "3v1" else "paper-3v2")
    race, paper = (preset(name).replace(preset="custom", generations=1500) for name in names)
    paper = paper.replace(env=paper.env.replace(size=race.env.size))
    assert (configs["race"], configs["paper"]) == (race, paper)
    assert {run.config.seed for run in plan if run.cell == "race"} == set(range(100, 120))
    both = configs["bias"].replace(esp=configs["pool"].esp)
    assert configs["bias-pool"] == both
    if "race-matched" in configs:
        agents = [{r: side_controller(configs[c], r) for r in ("predators", "prey")} for c in ("race", "race-matched")]
        split, whole = ({r: each.n_hidden * sum(each.used_genes) for r, each in side.items()} for side in agents)
        assert (split, whole) == ({"predators": 160, "prey": 210}, {"predators": 160, "prey": 209})
    assert configs["no-memory"].esp == race.esp.replace(memory=0.0, prior_trials=0.0)
    protocol = (SCRIPTS.parent / "docs" / "race-protocol.md").read_text()
    assert all(f"`{name}`" in protocol for name in configs)


def test_long_runs_are_the_recommended_preset_on_seeds_of_their_own() -> None:
    runs = read_plan(SCRIPTS / "race" / "long-steppe.toml")
    steppe = preset("race-steppe").replace(generations=10_000)
    assert [run.config for run in runs] == [steppe.replace(seed=seed) for seed in range(120, 125)]
    assert {run.cell for run in runs} == {long.CONDITION}


def test_conditions_keep_genes_small_after_breeding_as_esp_does() -> None:
    config, controller = (
        EspConfig(subpopulation_size=8, n_trials=20, hof_mates=0),
        side_controller(preset("smoke"), "prey"),
    )

    def bred(algorithm: type[Subpopulations], **options: float) -> Subpopulations:
        found = algorithm.start(config, controller, 1, np.random.default_rng(0), **options)
        found.ask(np.random.default_rng(1))
        fitness, champions = np.arange(20.0)[:, None], np.empty((0, 1, *controller.shape))
        found.tell(fitness, champions, np.random.default_rng(2))
        return found

    esp = bred(Subpopulations)
    scale = Subpopulations.start(config, controller, 1, np.random.default_rng(0)).spread().scale
    assert abs(esp.genomes).max() > 5
    np.testing.assert_array_equal(bred(Alive).genomes, esp.genomes)
    np.testing.assert_array_equal(bred(Alive, bound=5.0).genomes, esp.genomes.clip(-5, 5))
    np.testing.assert_allclose(bred(Alive, decay=0.25).genomes, 0.75 * esp.genomes)
    grown = bred(Alive, step=0.5)
    assert grown.config.mutation_scale == pytest.approx(0.5 * scale)
    assert (grown.genomes != esp.genomes).any()


@pytest.mark.parametrize("task", TASKS)
def test_nobody_trains_on_the_panel(task: str) -> None:
    panel = read_plan(SCRIPTS / "race" / f"panel-{task}.toml")
    trained = read_plan(SCRIPTS / "race" / f"conditions-{task}.toml")
    assert len(panel) == 20
    assert not {run.config.seed for run in panel} & {run.config.seed for run in trained}
    assert {run.config.prey.bias for run in panel} == {False, True}


def test_the_page_is_made_of_the_measurements_that_are_kept(tmp_path: Path) -> None:
    docs = SCRIPTS.parent / "docs"
    shutil.copytree(docs / "race" / "data", tmp_path / "race" / "data")
    write(tmp_path / "race" / "data", tmp_path)
    assert (tmp_path / "race.md").read_text() == (docs / "race.md").read_text()


def test_a_page_of_one_condition_has_no_empty_table_and_says_that_runs_are_few(tmp_path: Path) -> None:
    """Two runs of twelve generations, in which both sides gain in each half against the only run of the panel."""
    rising = np.repeat(np.linspace(0.1, 0.3, 12), 2).reshape(12, 2)[None].repeat(2, axis=0)
    arrays = {
        f"{panel}.{role}": c
        for role, c in (("predators", rising), ("prey", 1 - rising))
        for panel in ("panel", "scripts")
    }
    arrays = {name: np.repeat(values, 3, axis=2) for name, values in arrays.items()}
    for role in ("predators", "prey"):
        arrays |= {f"scale.{role}": np.ones((2, 12)), f"response.{role}": np.zeros((2, 3, 2))}
    arrays |= {"config": np.array(["a", "b"]), "generations": np.arange(12)[None].repeat(2, axis=0)}
    arrays |= {"response.generations": np.arange(3)[None].repeat(2, axis=0)}
    (tmp_path / "race/data/steppe").mkdir(parents=True)
    np.savez(tmp_path / "race/data/steppe/race.npz", **arrays)
    write(tmp_path / "race/data", tmp_path)
    page = (tmp_path / "race.md").read_text()
    assert "that both gain in the second half, it **holds** for these 2 seeds." in page
    assert "Intervals from so few" in page
    assert page.count("improve for the whole run (second half +0.091 [+0.091, +0.091])") == 2
    assert "less each other condition" not in page


@pytest.mark.slow
def test_the_whole_once_in_small(tmp_path: Path) -> None:
    """Three runs of each condition; a second call does nothing but the page, whatever became of the runs."""
    command = [sys.executable, str(SCRIPTS / "prove_race.py"), "--quick", "--tasks", "3v1", "--workers", "1"]
    command += ["--only", "race", "paper"]
    where = ["--runs", str(tmp_path / "runs"), "--out", str(tmp_path / "out")]
    first = subprocess.run([*command, *where], capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert first.returncode == 0, first.stderr
    assert first.stdout.endswith("race.md: 3v1 2 conditions\n")
    page = (tmp_path / "out" / "race.md").read_text()
    for name in ("race", "paper"):
        assert f"| `{name}` † | 3 |" in page, "few runs are marked"
    links = re.findall(r"!\[[^]]+\]\(([^)]+)\)", page)
    assert len(links) == 4  # in nine generations there is no exploiter
    for link in links:
        assert (tmp_path / "out" / link).exists()
        assert (tmp_path / "out" / link).with_suffix(".csv").exists()
    shutil.rmtree(tmp_path / "runs")
    again = subprocess.run([*command, *where], capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert "done" not in again.stderr
    assert (tmp_path / "out" / "race.md").read_text() == page
