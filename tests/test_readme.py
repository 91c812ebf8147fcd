"""The README's snippets run as they stand, in order, in one place."""

import re
from pathlib import Path

import pytest

from esp_trainer.cli import main
from esp_trainer.sweep.plan import read_plan

README = (Path(__file__).parent.parent / "README.md").read_text()
ECOSYSTEM = Path(__file__).parent / "ecosystem"
# Those of a tool are run where that tool is installed: in tests/ecosystem.
SNIPPETS = re.findall(r"(?<!-->\n)```python\n(.*?)```", README, re.DOTALL)

SMALL = [
    *("--env.max_cycles", "10", "--esp.subpopulation_size", "8", "--esp.n_trials", "8"),
    *("--esp.block_size", "1", "--esp.exploiters_every", "0"),
]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the run that the README speaks of, made small."""
    place = tmp_path_factory.mktemp("readme")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        assert main(["train", "race-3v1", "--generations", "400", "--quiet", *SMALL]) == 0
    return place


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_a_snippet_of_the_readme_runs(snippet: str, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    exec(compile(snippet, "README.md", "exec"), {})


def test_the_readme_has_a_snippet_for_each_use() -> None:
    assert len(SNIPPETS) >= 3


@pytest.mark.parametrize("block", ["run", "test"])
def test_the_readme_marks_the_two_commands(block: str) -> None:
    assert re.search(rf"<!-- newcomer: {block} -->\n```bash\n.+?```", README, re.DOTALL)


def test_commands_of_the_readme_exist() -> None:
    commands = set(re.findall(r"^esp-trainer (\w+)", README, re.MULTILINE))
    assert commands
    assert commands <= {
        "train",
        "resume",
        "sweep",
        "evaluate",
        "show",
        "replay",
        "presets",
        "analyse",
        "behaviours",
        "report",
        "compare",
        "watch",
        "exploitability",
        "solve",
        "teams",
        "benchmark",
    }


def test_the_sweep_of_the_readme_is_as_many_runs_as_it_says(tmp_path: Path) -> None:
    (declared,) = re.findall(r"```toml\n(.*?)```", README, re.DOTALL)
    (tmp_path / "sweep.toml").write_text(declared)
    plan = read_plan(tmp_path / "sweep.toml")
    assert f"# {len(plan)} runs in runs/sweep" in README
    assert {run.config.generations for run in plan} == {100}


def test_every_tool_that_is_tried_has_tests_a_snippet_and_a_row() -> None:
    tools = sorted(file.stem for file in (ECOSYSTEM / "requirements").glob("*.txt"))
    assert tools == sorted({file.stem.split("_")[1] for file in ECOSYSTEM.glob("test_*.py")})
    assert tools == sorted(re.findall(r"^<!-- tool: (\w+) -->$", README, re.MULTILINE))
    table = re.search(r"^\| tool .*?\n\n", README, re.DOTALL | re.MULTILINE)
    assert table is not None
    for tool, pinned in [(tool, (ECOSYSTEM / f"requirements/{tool}.txt").read_text()) for tool in tools]:
        version = re.search(r"==(\d+\.\d+)", pinned)
        assert version is not None
        assert f"{version[1]} |" in table[0], tool
