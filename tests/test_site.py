"""The site: built strictly, whole, readable on a phone, and at work from disk without a network."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from markdown_it import MarkdownIt
from once import made_once

from esp_trainer.cli.commands import COMMANDS
from esp_trainer.config import RunConfig
from esp_trainer.presets import PRESETS
from predprey_env import TASKS
from predprey_env.settings import field_names

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ROOT = Path(__file__).parents[1]
MOVED = {f"{name}.md": f"{name.lower()}.html" for name in ("CONTRIBUTING", "CHANGELOG")}
MOVED |= {"README.md": "index.html", "examples/README.md": "examples.html", "docs/README.md": "pages.html"}

pytestmark = pytest.mark.slow


def build(place: Path, *, config: Path = ROOT / "mkdocs.yml") -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "--config-file",
        str(config),
        "--site-dir",
        str(place),
    ]
    found = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(command, cwd=config.parent, env=found, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as CI builds it: a broken link or anchor is an error."""
    pytest.importorskip("mkdocstrings_handlers.python", reason='needs pip install -e ".[docs]"')

    def make(place: Path) -> None:
        done = build(place)
        assert done.returncode == 0, done.stderr

    return made_once(tmp_path_factory, "site", make)


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A tab of a phone's width without a network."""
    context = browser.new_context(viewport={"width": 360, "height": 740})
    context.set_offline(True)
    yield context.new_page()
    context.close()


def test_the_reference_has_every_public_name(site: Path) -> None:
    public = ("predprey_env", "predprey_env.policies", "predprey_env.jit", "predprey_env.rendering")
    for name in (*public, "esp_trainer", "esp_trainer.algorithms", "esp_trainer.networks"):
        module, text = importlib.import_module(name), (site / f"reference/{name}.html").read_text()
        made = {"parallel_env", "env", "raw_env"} if name == "predprey_env" else set()  # of the specification's module
        for each in set(module.__all__) | made:
            assert f'id="{name}.{each}"' in text, f"{name}.{each}"
    assert 'id="predprey_env.sb3.SB3VecEnv"' in (site / "reference/predprey_env.sb3.html").read_text()


def test_the_reference_has_every_command_field_preset_and_task(site: Path) -> None:
    headings = re.findall(r'<h2 id="(\w+)"', (site / "reference/command-line.html").read_text())
    assert headings == list(COMMANDS)
    fields = set(re.findall(r"<tr>\n<td><code>([\w.]+)</code></td>", (site / "reference/config.html").read_text()))
    assert fields == set(field_names(RunConfig))
    named = set(re.findall(r"<tr>\n<td><code>([\w-]+)</code></td>", (site / "reference/presets.html").read_text()))
    assert named == {*PRESETS, *TASKS}
    assert "Version history" in (site / "reference/predprey_v0.html").read_text()


def test_the_reference_names_arguments_first_and_leaves_out_what_says_nothing(site: Path) -> None:
    rows = (site / "reference/command-line.html").read_text().partition('<h2 id="evaluate"')[2]
    assert re.findall(r"<tr>\n<td><code>(.+?)</code>", rows)[:3] == ["TEAM", "--against TEAM", "--episodes N"]
    reference = (site / "reference/esp_trainer.html").read_text()
    assert 'id="esp_trainer.Coevolution.step"' in reference
    assert 'id="esp_trainer.Coevolution.sides"' not in reference
    assert "__getstate__" not in reference
    assert "_MONOLITHIC" not in reference  # the value of PRESETS, which has a page of its own
    assert 'href="../race.html">docs/race.md</a>' in (site / "reference/presets.html").read_text()


def test_a_figure_its_interval_and_its_p_stay_on_one_line(site: Path) -> None:
    text = (site / "race.html").read_text()
    assert "\N{NO-BREAK SPACE}[" in text
    assert "], p\N{NO-BREAK SPACE}0" in text
    assert not re.search(r"\d \[[+-]?[\d.]+, |\], p \d", text.partition("<article")[2])


def test_docstrings_are_shown_without_the_marks_of_another_language(site: Path) -> None:
    for file in (site / "reference").glob("*.html"):
        assert not re.search(r":(class|func|meth|mod|data|attr):|::</p>", file.read_text()), file.name


class Elements(HTMLParser):
    """Counts what a page consists of, inside its article."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: Counter[str] = Counter()
        self.feed(text.partition("<article")[2].partition("</article>")[0])

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found[tag] += tag in ("h1", "h2", "h3", "ul", "ol", "li", "tr", "td", "pre", "blockquote", "em", "strong")
        if tag == "img":
            assert dict(attrs).get("alt"), f"a picture without an alternative text: {attrs}"
            self.found[tag] += 1


def test_a_page_has_the_same_parts_as_on_a_code_host(site: Path) -> None:
    host = MarkdownIt("commonmark").enable("table")
    sources = [*map(ROOT.joinpath, MOVED), *(ROOT / "docs").rglob("*.md")]
    for file in sources:
        name = file.relative_to(ROOT).as_posix()
        shown = site / MOVED.get(name, name.removeprefix("docs/").replace(".md", ".html"))
        expected = Elements(f"<article>{host.render(file.read_text())}</article>").found
        assert Elements(shown.read_text()).found == expected, name


def test_every_picture_of_the_site_has_an_alternative_text(site: Path) -> None:
    assert sum(Elements(file.read_text()).found["img"] for file in site.rglob("*.html")) > 20


def test_the_search_works_from_disk_and_nothing_asks_the_network(site: Path, page: Page) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.set_viewport_size({"width": 1280, "height": 900})
    for start in ("index.html", "reference/predprey_env.html"):
        page.goto((site / start).as_uri())
        page.locator("input[name=query]").press_sequentially("best response")
        page.wait_for_selector(".md-search-result__item")
        assert "measure.html" in "".join(page.locator(".md-search-result__link").evaluate_all("all => all.map(String)"))
    assert [url for url in asked if not url.startswith((site.as_uri(), "data:", "about:"))] == []


def test_no_page_scrolls_sideways_on_a_phone(site: Path, page: Page) -> None:
    wide = []
    for file in sorted(site.rglob("*.html")):
        page.goto(file.as_uri())
        if page.evaluate("document.documentElement.scrollWidth") > 360:
            wide.append(file.relative_to(site).as_posix())
    assert wide == []
