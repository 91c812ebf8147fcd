from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest
from waiting import PATIENCE

from esp_trainer.tasks import WORLDS
from esp_trainer.teams import zoo
from predprey_env.policies import SCRIPTS as SCRIPTED

SCRIPTS = Path(__file__).parents[1] / "scripts"

ROWS = (
    "`fused`, 64 episodes",
    "the same with linear outputs",
    "`fused`, two threads",
    "`reference`, extrapolated",
    "- of `fused`: scripts instead of networks",
    "- of `fused`: one hidden neuron",
    "- of a step of `reference`: the environment",
    "- of a step of `reference`: five agents' networks",
    *(f"trials with `{name}` controllers" for name in ("monolithic", "combiner", "double", "central")),
    "trials with `elman` networks",
    "trials with networks of a user",
    "trials with everything seen",
    "trials with an observation of a user",
    "the first trials with",
    *(f"a generation by `{name}`" for name in ("esp", "cosyne", "ga", "openai_es", "cma_es")),
    "`parallel_env()`",
    "a generation of `paper-3v2`",
    "- trials",
    "- champions",
    "- held_out",
    "- breeding",
    "- files",
    "- rest",
    "champions, breeding, files and rest",
    "the same without champions",
    "450 generations at that rate",
    "`esp-trainer train paper-3v2",
    "its first generation, compiled anew",
    "its first generation, from the cache",
    "`import predprey_env`",
)


PEER_ROWS = (
    *(f"`vector_env({n_worlds}, ...)`, predators against random prey" for n_worlds in (1, 16, 128, 1024, 4096)),
    "`vector_env(1024, ...)`, predators against prey that `run_straight`",
    "`vector_env(1024, ...)`, predators against evolved prey",
    "`vector_env(1024, ...)`, prey against predators that `parity_chase`",
    "`vector_env(1024, ...)`, prey against evolved predators",
    "JaxMARL `simple_tag`, 1024 worlds, 3 v 2, a call for each step",
    "JaxMARL `simple_tag`, 1024 worlds, 3 v 2, `lax.scan`",
    "`parallel_vector_env(1024)`, both teams",
    "JaxMARL `simple_tag`, 1024 worlds, 3 v 2, a call for each step",
    "JaxMARL `simple_tag`, 1024 worlds, 3 v 2, `lax.scan`",
    "`parallel_vector_env(16)`, both teams",
    "a Python loop over `parallel_env()`s, 16 worlds, both teams",
    "AgileRL `AsyncPettingZooVecEnv`, 16 worlds, both teams",
    "`parallel_env()`, 3 v 2",
    "MPE `simple_tag_v3`, 3 v 2",
    "`team_view()` of 3 predators",
    "SISL `pursuit",
    *(
        f"{what}, 128 worlds, predators against {prey}"
        for prey in ("prey that `run_straight`", "evolved prey")
        for what in (
            "`vector_env()`",
            "SuperSuit `concat_vec_envs_v1` over `team_view()`s",
            "a Python loop over `team_view()`s",
        )
    ),
)
PEERS = ("JaxMARL", "AgileRL", "SISL", "SuperSuit")


def script(name: str, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPTS / name), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE)


def table_of(document: str) -> list[list[str]]:
    header, _, *lines = [line for line in document.splitlines() if line.startswith("|")]
    assert header.startswith("| what | figure | ratio |")
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.slow
def test_throughput_benchmark_fills_every_row_of_its_table() -> None:
    done = script("bench_throughput.py", "--quick")
    assert done.returncode == 0, done.stderr
    for (what, figure, ratio, *_), beginning in zip(table_of(done.stdout), ROWS, strict=True):
        assert what.startswith(beginning)
        assert any(character.isdigit() for character in figure + ratio)


@pytest.mark.slow
def test_peers_benchmark_fills_every_row_or_says_who_is_not_installed() -> None:
    done = script("bench_peers.py", "--quick")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("# Speed beside other environments\n")
    for (what, figure, *_), beginning in zip(table_of(done.stdout), PEER_ROWS, strict=True):
        assert what.startswith(beginning)
        missing = figure == "not installed" and what.startswith(PEERS)
        assert missing or any(character.isdigit() for character in figure)


@pytest.mark.slow
def test_games_benchmark_fills_every_row_of_its_table() -> None:
    done = script("bench_games.py", "--quick")
    assert done.returncode == 0, done.stderr
    rows = table_of(done.stdout)
    assert [what for what, *_ in rows] == [
        "`ReferenceEvaluator`",
        "the environment alone, random actions",
        "`GameEvaluator`, one process",
        "`GameEvaluator`, two processes",
        "`GameEvaluator`, `many()` in one process",
    ]
    assert all(float(figure.split()[0]) > 0 for _, figure, _ in rows), "no column for targets where none is set"


@pytest.mark.slow
@pytest.mark.usefixtures("only_cluster")
def test_scaling_benchmark_fills_every_table() -> None:
    done = script("bench_scaling.py", "--quick")
    assert done.returncode == 0, done.stderr
    tables = re.findall(r"(?:^\|.*\n)+", done.stdout, re.MULTILINE)
    assert [len(table.splitlines()) - 2 for table in tables] == [3, 6]
    cells = re.findall(r"\| 1,000 \| (\S+) ms \| (\d+) \| (\S+) ms \| (\S+) ms \|", done.stdout)
    assert [shards for _, shards, _, _ in cells] == ["2", "8", "32"]
    assert all(float(wall) > 0 and float(driver) > 0 for _, _, wall, driver in cells)
    assert float(re.search(r"A trial is (\d+) bytes", done.stdout)[1]) > 100


@pytest.mark.slow
def test_the_study_of_optimal_play_finds_what_is_known() -> None:
    done = script("optimal_play.py", "--quick")
    assert done.returncode == 0, done.stderr
    known = re.findall(r"^\| 6 x 6, .*? \| (\d.*?) \| (\d.*?) \|", done.stdout, re.MULTILINE)
    assert len(known) == 2
    assert all(found == said for found, said in known)
    assert len(re.findall(r"(?:^\|.*\n)+", done.stdout, re.MULTILINE)) == 2 + 4
    answered = re.findall(r"^\| prey, .*? \| (\S+)", done.stdout, re.MULTILINE)
    optimal = float(re.search(r"both sides play optimally \| (\S+)", done.stdout)[1])
    assert len(answered) == 2 + 4
    assert min(map(float, answered)) >= optimal, "nobody escapes a best response better than optimal prey"


@pytest.mark.parametrize("name", ["bench_throughput.py", "bench_peers.py"])
def test_benchmarks_refuse_a_part_that_does_not_exist(name: str) -> None:
    done = script(name, "--only", "nothing")
    assert done.returncode == 2
    assert "invalid choice: 'nothing'" in done.stderr


def test_every_scripted_team_meets_every_other() -> None:
    done = script("scripted_teams.py", "--episodes", "40")
    assert done.returncode == 0, done.stderr
    tables = re.findall(r"^\| predators \|(.*?) \|\n.*?\n((?:\|.*\n)+)", done.stdout, re.MULTILINE)
    assert len(tables) == len(WORLDS)
    for columns, rows in tables:
        assert [name.strip() for name in columns.split("|")] == list(SCRIPTED["prey"])
        names, cells = zip(*(line.strip("| ").split(" | ", 1) for line in rows.splitlines()), strict=True)
        assert [name.strip("`") for name in names] == list(SCRIPTED["predators"])
        assert all(len(re.findall(r"[01]\.\d{3} \[[01]\.\d{3}, [01]\.\d{3}\]", line)) == 4 for line in cells)


@pytest.mark.slow
def test_a_zoo_is_made_from_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of one task: the paper's worlds have teams of the first zoo too."""
    shipped = {name for name, team in zoo.known_teams().items() if team.task == "3v1"}
    where = ["--runs", str(tmp_path / "runs"), "--out", str(tmp_path / "zoo")]
    done = script("make_zoo.py", "--quick", "--tasks", "3v1", "--workers", "1", *where)
    assert done.returncode == 0, done.stderr
    monkeypatch.setattr(zoo, "PLACE", tmp_path / "zoo")
    caches = (zoo.load_zoo, zoo._index)
    try:
        for cache in caches:
            cache.cache_clear()
        teams = zoo.known_teams()
        assert set(teams) == shipped, "as many as are in the package, and by the same names"
        for name in list(teams)[::6]:
            zoo.load_team(name).check_fits(teams[name].role, WORLDS[teams[name].task])
        assert zoo.load_zoo("3v1").n_episodes == 16
    finally:
        for cache in caches:
            cache.cache_clear()


def test_what_selection_sees_is_a_row_for_each_way_to_score() -> None:
    found = script("selection_signal.py", "--quick")
    assert found.returncode == 0, found.stderr
    rows = [line for line in found.stdout.splitlines() if line.startswith("| ")]
    page = (SCRIPTS.parent / "docs" / "selection.md").read_text()
    for row in rows:
        assert row.split("|")[1] in page, "the page has this row"
    assert len(rows) == 2 + 7


@pytest.mark.parametrize("name", ["throughput", "peers", "games"])
def test_what_a_benchmark_answers_is_in_rows_of_its_page(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Or a page would silently be written without its answer."""
    monkeypatch.syspath_prepend(SCRIPTS)
    for library in ("OMP", "OPENBLAS", "MKL"):
        monkeypatch.setenv(f"{library}_NUM_THREADS", "1")  # as a benchmark does where it is imported
    page = (SCRIPTS.parent / f"docs/{name}.md").read_text()
    rows = [what for what, *_ in table_of(page)]
    named = re.findall(r"\{(?:figure|ratio) of (.+?)\}", importlib.import_module(f"bench_{name}").ANSWER)
    assert len(named) >= 4
    for beginning in named:
        assert any(what.startswith(beginning) for what in rows), beginning


def test_prose_says_units_in_words() -> None:
    sys.path.insert(0, str(SCRIPTS))
    from bench.page import in_words

    assert in_words("7,866,313 steps/CPU-s") == "7,866,313 steps a CPU-second"
    assert in_words("0.08 CPU-s") == "0.08 CPU-seconds"
    assert in_words("1,134.1 x fused") == "1,134.1 times fused"
