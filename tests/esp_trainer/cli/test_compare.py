"""``esp-trainer compare``: its figures are those of the analysis, and what cannot be compared is refused in a line."""

from __future__ import annotations

import csv
import html
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.comparison import measures
from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.history import History
from esp_trainer.analysis.inference import over_seeds
from esp_trainer.analysis.progress import progress
from esp_trainer.cli import main
from esp_trainer.cli.compare import runs_in
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import ROLES, ScriptedTeams
from predprey_env.agents import other_team
from predprey_env.policies import SCRIPTS

N = 8
FEW = ["--generations", "6", "--episodes", "8"]
SMALL = [
    *("--esp.subpopulation_size", "8", "--esp.n_trials", "10", "--esp.hof_mates", "1", "--env.max_cycles", "12"),
    *("--champion.n_candidates", "2", "--champion.n_held_out", "8"),
]


def train(path: Path, *options: str, generations: int = N) -> Path:
    length = ["--generations", str(generations)]
    assert main(["train", "smoke", "--out", str(path), "--quiet", *SMALL, *length, *options]) == 0
    return path


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory of two conditions, of three seeds each, and beside it runs that are needed or do not belong."""
    place = tmp_path_factory.mktemp("runs")
    for share in ("0", "0.5"):
        for seed in ("0", "1", "2"):
            train(place / "both" / f"past-{share}-{seed}", "--esp.past_share", share, "--seed", seed)
    train(place / "held out", "--seed", "9", generations=7)
    train(place / "longer", "--seed", "10", generations=N + 3)
    train(place / "fleeing", "--prey.policy", "flee_nearest")
    train(place / "elsewhere", "--env.size", "14", generations=3)
    train(place / "short", "--esp.n_trials", "9", generations=2)
    return place


@pytest.fixture
def both(place: Path, tmp_path: Path) -> Path:
    """A copy of the directory of both conditions, to be written to."""
    return Path(shutil.copytree(place / "both", tmp_path / "both"))


def rows_of(file: Path) -> list[dict[str, str]]:
    with file.open(newline="") as lines:
        return list(csv.DictReader(lines))


def notes_of(outcome: Any) -> list[str]:
    return [line.removeprefix("note: ") for line in outcome.err.splitlines() if line.startswith("note: ")]


NOBODY = (
    "There are no held-out opponents: the zoo has no team for this world, and no run was given by --panel. Progress is "
    "against scripts."
)


def test_a_directory_of_runs_is_compared_by_condition(esp_trainer: Callable[..., Any], both: Path) -> None:
    outcome = esp_trainer("compare", both, *FEW, "--csv", "runs.csv")
    assert outcome.code == 0
    rows = rows_of(Path("runs.csv"))
    assert [(row["run"], row["condition"], row["seed"], row["generations"]) for row in rows] == [
        (str(both / f"past-{share}-{seed}"), f"esp.past_share={share}", str(seed), str(N))
        for share in ("0", "0.5")
        for seed in range(3)
    ]
    lines = outcome.out.splitlines()
    assert max(map(len, lines)) <= 120
    assert lines[0] == "predators, fraction of prey caught: mean over seeds [95% interval]"
    assert lines[1].split("   ")[0] == "predators"
    for share, line in (("0", lines[2]), ("0.5", lines[3])):
        mine = [row for row in rows if row["condition"] == f"esp.past_share={share}"]
        level, late = (
            over_seeds([float(row[f"predators_scripts_{kind}"]) for row in mine]) for kind in ("level", "late_progress")
        )
        assert re.split(r"\s{2,}", line) == [f"esp.past_share={share}", "3", str(level), str(late)]
    assert "esp.past_share=0.5 against esp.past_share=0" in lines
    assert lines[-3:-1] == ["", "No difference from esp.past_share=0 is significant."]
    assert lines[-1].startswith(f"open {both / 'compare.html'} in a browser (")
    least = "With so few seeds no p can be below 0.05: corrected over 4 differences, the least possible is 0.4."
    assert notes_of(outcome) == [NOBODY, least]


def test_the_numbers_of_a_run_are_those_of_its_cross_play(
    esp_trainer: Callable[..., Any], place: Path, tmp_path: Path
) -> None:
    run, panel = place / "both/past-0-1", place / "held out"
    assert esp_trainer("compare", run, "--panel", panel, *FEW, "--csv", "a.csv", "--out", "a.html").code == 0
    (row,) = rows_of(tmp_path / "a.csv")
    history, other = History.of_run(run), History.of_run(panel)
    evaluator = FusedEvaluator(history.config.env, threads=1)
    generations = history.sample(6)
    expected = {}
    for role in ROLES:
        mine, theirs = history.entrants(role, generations), other_team(role)
        held_out, scripts = [other.entrants(theirs, other.sample(6))], map(ScriptedTeams, SCRIPTS[theirs])
        for name, panel in (("held_out", held_out), ("scripts", scripts)):
            if role == "predators":
                won = np.hstack([cross_play(mine, each, evaluator, n_episodes=8).caught for each in panel])
            else:
                won = 1 - np.vstack([cross_play(each, mine, evaluator, n_episodes=8).caught for each in panel]).T
            expected[f"{role}_{name}_level"] = won.mean(axis=1)[-1]
            expected[f"{role}_{name}_progress"] = progress(won).strength
            expected[f"{role}_{name}_late_progress"] = progress(won[3:]).strength
    metrics = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    expected["caught"] = np.mean([line["held_out"]["caught"]["rate"] for line in metrics[-(N // 3) :]])
    for role in ("predators", "prey"):
        signals = [line["subpopulations"][role]["signal"] for line in metrics]
        expected[f"{role}_signal"] = np.mean([signal for signal in signals if signal is not None])
    assert set(expected) == set(measures())
    for name, value in expected.items():
        assert float(row[name]) == pytest.approx(value, rel=1e-5, abs=1e-9), name


def test_the_page_holds_every_condition_and_asks_for_nothing(esp_trainer: Callable[..., Any], both: Path) -> None:
    assert esp_trainer("compare", both, *FEW).code == 0
    page = (both / "compare.html").read_text("utf-8")
    assert "default-src 'none'" in page
    assert "<script" not in page
    assert not re.search(r"""(src|href)=["'](?!#|data:)""", page)
    assert "@import" not in page
    legend = html.unescape(page[page.index('<ul class="legend">') : page.index('<ul class="notes">')])
    assert re.findall(r"</svg>\s*([^<]+)</li>", legend) == ["esp.past_share=0", "esp.past_share=0.5"]
    assert NOBODY in page
    assert '<p class="answer">No difference from esp.past_share=0 is significant.</p>' in page
    figures = re.findall(r'<svg role="img" aria-label="([^"]+)"', page)
    assert len(figures) == 4 + 2 + 2  # curves and dots of both sides against scripts, of success, dots of both signals
    for words in figures:
        assert re.search(r"esp\.past_share=0 .+; esp\.past_share=0\.5 ", words), words
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert not re.search("#0072b2", page[page.index("</style>") :])  # colours that are the same by night
    assert esp_trainer("compare", both, *FEW).code == 0
    assert (both / "compare.html").read_text("utf-8") == page


def test_names_are_text_on_the_page(esp_trainer: Callable[..., Any], place: Path, tmp_path: Path) -> None:
    run = Path(shutil.copytree(place / "both/past-0-1", tmp_path / "<b>&amp;"))
    outcome = esp_trainer("compare", run, *FEW, "--out", "a.html")
    assert "difference" not in outcome.out, "there is nothing to compare"
    assert "<h1>Comparison of &lt;b&gt;&amp;amp;</h1>" in Path("a.html").read_text("utf-8")


def test_others_are_compared_with_the_condition_that_is_asked_for(esp_trainer: Callable[..., Any], both: Path) -> None:
    outcome = esp_trainer("compare", both, *FEW, "--against", "esp.past_share=0.5")
    assert "esp.past_share=0 against esp.past_share=0.5" in outcome.out.splitlines()


def test_of_few_seeds_means_are_told(esp_trainer: Callable[..., Any], place: Path) -> None:
    runs = [place / "both" / name for name in ("past-0-0", "past-0-1", "past-0.5-0")]
    outcome = esp_trainer("compare", *runs, *FEW, "--csv", "a.csv", "--out", "a.html")
    first, second, third = (float(row["prey_scripts_level"]) for row in rows_of(Path("a.csv")))
    blocks = [block.splitlines() for block in outcome.out.split("\n\n")]
    assert blocks[1][2].split()[:3] == ["esp.past_share=0", "2", f"{(first + second) / 2:.3f}"]
    (line,) = [line for line in blocks[2] if line.startswith("prey, level, scripts")]
    assert line.split()[3:] == [f"{third - (first + second) / 2:+.3f}", "-", "-"]
    assert notes_of(outcome)[1:] == [
        "Of fewer than 3 seeds only means are shown, without intervals and tests: esp.past_share=0; esp.past_share=0.5."
    ]


def test_a_scripted_side_has_no_figures(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("compare", place / "fleeing", *FEW, "--csv", "a.csv", "--out", "a.html")
    assert outcome.code == 0
    assert not re.search("^prey", outcome.out, re.MULTILINE)
    (row,) = rows_of(Path("a.csv"))
    assert {name for name, value in row.items() if not value} >= {name for name in row if name.startswith("prey_")}
    assert row["predators_scripts_level"]


def test_a_condition_beside_one_with_a_scripted_side(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("compare", place / "both/past-0-0", place / "fleeing", *FEW, "--out", "a.html")
    assert outcome.code == 0
    _, prey, *_ = outcome.out.split("\n\n")
    assert prey.splitlines()[3].split() == ["prey.policy=flee_nearest", "1", "-", "-"]
    assert not re.search("^prey, level", outcome.out, re.MULTILINE)


def test_runs_of_a_condition_are_cut_to_the_shortest(esp_trainer: Callable[..., Any], place: Path) -> None:
    runs = [place / "both/past-0-0", place / "longer", place / "both/past-0.5-0"]
    outcome = esp_trainer("compare", *runs, *FEW, "--csv", "a.csv", "--out", "a.html")
    assert [row["generations"] for row in rows_of(Path("a.csv"))] == [str(N)] * 3
    cut = f"esp.past_share=0: The runs have {N} to {N + 3} generations: the first {N} of each are measured."
    assert notes_of(outcome)[0] == cut


def test_conditions_of_other_lengths_are_said_to_be(esp_trainer: Callable[..., Any], place: Path) -> None:
    outcome = esp_trainer("compare", place / "longer", place / "both/past-0.5-0", *FEW, "--out", "a.html")
    assert f"The conditions have {N} to {N + 3} generations: each is measured to its end." in notes_of(outcome)


def test_runs_that_are_not_whole_are_left_out_with_a_note(esp_trainer: Callable[..., Any], both: Path) -> None:
    config = json.loads((both / "past-0-0/config.json").read_text())
    config["config"]["generations"] = 20
    (both / "past-0-0/config.json").write_text(json.dumps(config))
    (both / "past-0-1/config.json").write_text("{")
    outcome = esp_trainer("compare", both, *FEW, "--csv", "a.csv")
    assert outcome.code == 0
    assert [Path(row["run"]).name for row in rows_of(Path("a.csv"))] == [
        f"past-{name}" for name in ("0-2", "0.5-0", "0.5-1", "0.5-2")
    ]
    damaged, unfinished = notes_of(outcome)[:2]
    assert damaged.startswith(f"Left out: {both / 'past-0-1/config.json'} is damaged")
    assert unfinished == f"Left out: {both / 'past-0-0'} has {N} of its 20 generations."
    refusal = esp_trainer("compare", both / "past-0-0", *FEW).refusal
    assert refusal == f"esp-trainer: no run is complete: {both / 'past-0-0'} has {N} of its 20 generations"


def test_a_log_without_signal_is_compared_without(esp_trainer: Callable[..., Any], both: Path) -> None:
    log = both / "past-0-0/metrics.jsonl"
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    for line in lines:
        for role in ("predators", "prey"):
            del line["subpopulations"][role]["signal"]
    log.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert esp_trainer("compare", both, *FEW, "--csv", "a.csv").code == 0
    first, second, *_ = rows_of(Path("a.csv"))
    assert (first["prey_signal"], first["predators_signal"]) == ("", "")
    assert second["prey_signal"]


def test_names_that_are_too_long_stand_above_their_rows(esp_trainer: Callable[..., Any], place: Path) -> None:
    fields = {
        "predators.controller": "monolithic",
        "predators.output": "linear",
        "prey.input_scale": "0.25",
        "esp.init_range": "5.125",
        "esp.mutation_scale": "0.123456",
        "esp.mutation_limit": "3.75",
    }
    other = train(Path("other"), *(word for name, value in fields.items() for word in (f"--{name}", value)))
    outcome = esp_trainer("compare", place / "both/past-0-0", other, *FEW, "--out", "a.html")
    assert max(map(len, outcome.out.splitlines())) <= 120
    named = ", ".join(f"{name}={value}" for name, value in fields.items())
    block = " ".join(outcome.out.split("\n\n")[0].split())
    assert re.search(re.escape(named) + r" 1 0\.\d+ -?0\.\d+$", block)


REFUSED: dict[str, tuple[list[str], str]] = {
    "another world": (
        ["{place}/both", "{place}/elsewhere"],
        "their teams can meet, got {place}/both/past-0-0 with env.size=12 and {place}/elsewhere with env.size=14",
    ),
    "a panel of another world": (
        ["{place}/both", "--panel", "{place}/elsewhere"],
        "{place}/elsewhere with env.size=14",
    ),
    "no such condition": (
        ["{place}/both", "--against", "esp.past_share=1"],
        "unknown condition esp.past_share=1; did you mean esp.past_share=0 or esp.past_share=0.5?",
    ),
    "a run twice": (
        ["{place}/both", "{place}/both/past-0-1"],
        "runs must be different ones, got {place}/both/past-0-1, {place}/both/past-0-1",
    ),
    "one file for both": (["{place}/both", "--csv", "a.html"], "--csv and --out must be different files, got a.html"),
    "a seed twice": (["{place}/both", "{place}/again"], "runs must have different seeds, got "),
    "a run that is in the panel": (["{place}/both", "--panel", "{place}/both/past-0-0"], "runs must be different ones"),
    "a panel that is no run": (["{place}/both", "--panel", "nowhere"], "nowhere holds no run"),
    "no run": (["nowhere"], "nowhere holds no run: there is no config.json"),
    "nothing": ([], "required: RUN"),
    "two generations": (["{place}/short"], "progress takes at least 3 generations, got 2 of smoke"),
    "two sampled": (["{place}/both", "--generations", "2"], "progress takes at least 3 generations, got 2 of esp.past"),
    "a place that is none": (["{place}/both", "--out", "no/where.html"], "no/where.html: No such file or directory"),
    "a table nowhere": (["{place}/both", "--csv", "no/where.csv"], "no/where.csv: No such file or directory"),
    "no episodes": (["{place}/both", "--episodes", "0"], "at least 1, got "),
}


@pytest.mark.parametrize(("words", "says"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_compared_is_refused_in_one_line_and_nothing_is_written(
    words: list[str], says: str, esp_trainer: Callable[..., Any], place: Path, tmp_path: Path, contents: Any
) -> None:
    if not (place / "again").exists():
        shutil.copytree(place / "both/past-0-1", place / "again")
    before = contents(place)
    out = [] if "--out" in words else ["--out", "a.html"]
    refusal = esp_trainer("compare", *(word.format(place=place) for word in words), *out).refusal
    assert refusal.startswith("esp-trainer")
    assert says.format(place=place) in refusal
    assert not list(tmp_path.iterdir())
    assert contents(place) == before


def test_the_runs_of_a_sweep_are_in_its_order_with_the_names_of_its_conditions(both: Path) -> None:
    """A run that the file does not name comes last."""
    conditions = "[conditions.pool]\nesp.past_share = 0.5\n[conditions.alone]\n"
    (both / "sweep.toml").write_text(f'preset = "smoke"\nseeds = [1, 0]\n{conditions}')
    for name in ("past-0-0", "past-0-1", "past-0.5-0"):
        share, seed = ("alone", "pool")["0.5" in name], name[-1]
        (both / name).rename(both / f"{share}-seed{seed}")
    found = {path.name: name for path, name in runs_in([both]).items()}
    assert found == {"pool-seed0": "pool", "alone-seed1": "alone", "alone-seed0": "alone"} | dict.fromkeys(
        ["past-0-2", "past-0.5-1", "past-0.5-2"]
    )
    assert list(found)[:3] == ["pool-seed0", "alone-seed1", "alone-seed0"]
