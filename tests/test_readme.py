"""The README and the pages of ``docs``: their snippets run as they stand, and their links lead somewhere."""

import re
from pathlib import Path

import pytest

import predprey_env
from esp_trainer.cli import main
from esp_trainer.cli.commands import COMMANDS
from esp_trainer.sweep.plan import read_plan

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "examples/README.md")]
PAGES += sorted((ROOT / "docs").rglob("*.md"))
ECOSYSTEM = Path(__file__).parent / "ecosystem"


def _name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


# A marker stands before a snippet that is run elsewhere: of a tool in tests/ecosystem, of the tutorial in its own test.
# The page on players has a test of its own too.
SNIPPETS = [
    pytest.param(file, snippet, id=f"{_name(file)}-{number}")
    for file in PAGES
    if file.name != "players.md"
    for number, snippet in enumerate(re.findall(r"(?<!-->\n)```python\n(.*?)```", file.read_text(), re.DOTALL))
]

SMALL = [
    *("--env.max_cycles", "10", "--esp.subpopulation_size", "8", "--esp.n_trials", "8"),
    *("--esp.block_size", "1", "--esp.exploiters_every", "0"),
]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the run that the README speaks of, made small: its last champions are called as there."""
    place = tmp_path_factory.mktemp("readme")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        assert main(["train", "race-3v1", "--generations", "40", "--quiet", *SMALL]) == 0
    for team in place.glob("runs/*/champions/*-00039.safetensors"):
        team.rename(team.with_name(team.name.replace("00039", "00399")))
    return place


@pytest.mark.parametrize(("file", "snippet"), SNIPPETS)
def test_a_snippet_of_a_page_runs(file: Path, snippet: str, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place)
    exec(compile(snippet, _name(file), "exec"), {})


def test_the_readme_is_short_and_shows_the_environment() -> None:
    assert len(README.splitlines()) <= 150
    assert "```python" in README


@pytest.mark.parametrize("block", ["run", "test"])
def test_the_readme_marks_the_two_commands(block: str) -> None:
    assert re.search(rf"<!-- newcomer: {block} -->\n```bash\n.+?```", README, re.DOTALL)


@pytest.mark.parametrize("file", PAGES, ids=_name)
def test_commands_of_a_page_exist(file: Path) -> None:
    assert set(re.findall(r"^esp-trainer (\w+)", file.read_text(), re.MULTILINE)) <= set(COMMANDS)


def test_every_command_is_shown_on_a_page() -> None:
    assert set(re.findall(r"^esp-trainer (\w+)", _all_text(), re.MULTILINE)) == set(COMMANDS)


def test_the_sweep_is_as_many_runs_as_its_page_says(tmp_path: Path) -> None:
    page = (ROOT / "docs/training.md").read_text()
    (declared,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "sweep.toml").write_text(declared)
    plan = read_plan(tmp_path / "sweep.toml")
    assert f"# {len(plan)} runs in runs/sweep" in page
    assert {run.config.generations for run in plan} == {100}


def test_every_tool_that_is_tried_has_tests_a_snippet_and_a_row() -> None:
    tools = sorted(file.stem for file in (ECOSYSTEM / "requirements").glob("*.txt"))
    assert tools == sorted({file.stem.split("_")[1] for file in ECOSYSTEM.glob("test_*.py")})
    tools.remove("pyribs")  # breeds teams through the trainer: docs/experiment.md
    snippets = re.findall(r"^<!-- tool: (\w+) -->$", (ROOT / "docs/tools.md").read_text(), re.MULTILINE)
    assert tools == sorted(snippets)
    table = re.search(r"^\| tool .*?\n\n", README, re.DOTALL | re.MULTILINE)
    assert table is not None
    listing = (ROOT / "docs/pettingzoo-listing.md").read_text()
    for tool, pinned in [(tool, (ECOSYSTEM / f"requirements/{tool}.txt").read_text()) for tool in tools]:
        version = re.search(r"==(\d+\.\d+)", pinned)
        assert version is not None
        assert f"{version[1]} |" in table[0], tool
        assert f" {version[1]}" in listing, tool


@pytest.mark.parametrize("file", PAGES, ids=_name)
def test_links_of_a_page_lead_to_files_and_headings(file: Path) -> None:
    for target in _links(file.read_text()):
        path, _, anchor = target.partition("#")
        found = (file.parent / path).resolve() if path else file
        assert found.exists(), f"{target} of {_name(file)}"
        assert not anchor or anchor in _anchors(found.read_text()), f"{target} of {_name(file)}"


def test_a_link_that_leads_nowhere_is_found() -> None:
    assert _links("[a](b.md#c) ![d](e.png) [f](https://g.example) <img src='h.gif'>") == ["b.md#c", "e.png", "h.gif"]
    assert _links("```\n[a](b.md)\n```\n`[c](d.md)`") == []
    assert _anchors("# A *b*, `c_d`?\n## E\n## E\n```bash\n# f\n```") == {"a-b-c_d", "e", "e-1"}


@pytest.mark.parametrize("file", PAGES, ids=_name)
def test_every_picture_has_an_alternative_text(file: Path) -> None:
    text = file.read_text()
    assert "![](" not in text
    assert all(re.search(r'alt="[^"]+"', picture) for picture in re.findall(r"<img [^>]*>", text))


def test_the_table_of_pages_has_every_page() -> None:
    index = ROOT / "docs/README.md"
    listed = {target.partition("#")[0] for target in _links(index.read_text())}
    pages = {str(file.relative_to(index.parent)) for file in index.parent.rglob("*.md")}
    assert pages - {"README.md"} == {target for target in listed if target.endswith(".md") and target[:2] != ".."}


def test_the_citation_names_the_version_of_the_package() -> None:
    citation = (ROOT / "CITATION.cff").read_text()
    assert re.findall(r"^version: (.+)$", citation, re.MULTILINE) == [predprey_env.__version__]


def _all_text() -> str:
    return "\n".join(file.read_text() for file in PAGES)


def _without_code(text: str) -> str:
    return re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)


def _links(text: str) -> list[str]:
    """Return the relative targets of links and pictures, in order."""
    prose = re.sub(r"`[^`\n]*`", "", _without_code(text))
    found = re.findall(r"\]\(([^)\s]+)\)|<img [^>]*src=[\"']([^\"']+)", prose)
    return [target for pair in found for target in pair if target and "://" not in target]


def _anchors(text: str) -> set[str]:
    """Return the anchors of the headings, as GitHub makes them."""
    anchors: list[str] = []
    for heading in re.findall(r"^#+ (.+)$", _without_code(text), re.MULTILINE):
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower()
        slug = re.sub(r"[^\w\- ]", "", plain).strip().replace(" ", "-")
        count = anchors.count(slug)
        anchors.append(f"{slug}-{count}" if count else slug)
    return set(anchors)
