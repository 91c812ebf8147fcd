"""Small runs, their pages, and a headless browser without a network to open them in."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from once import made_once
from wide_sight import Wide

from esp_trainer import Team
from esp_trainer import report as report_package
from esp_trainer.analysis.watch import episodes
from esp_trainer.cli import main
from esp_trainer.evaluation.kernel import seed_of
from esp_trainer.networks import NETWORKS, network_class
from esp_trainer.report.matches import rules_in_javascript
from esp_trainer.run.directory import RunDirectory
from predprey_env import PredPreyEnv

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

# A world in which prey are caught and behaviours seen all the time, and a run of it that takes two seconds.
SMALL = [
    *("--env.size", "24", "--env.max_cycles", "60", "--esp.n_trials", "80", "--esp.n_episodes", "2"),
    *("--champion.n_candidates", "4", "--champion.n_held_out", "16"),
]


def train(place: Path, preset: str, *options: str) -> Path:
    assert main(["train", preset, *SMALL, "--out", str(place), "--quiet", *options]) == 0
    return place


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two runs of 24 generations that differ in their seed. Not to be changed."""

    def make(place: Path) -> None:
        for seed in (0, 1):
            train(place / f"seed{seed}", "paper-3v2", "--seed", str(seed), "--generations", "24")

    place = made_once(tmp_path_factory, "report-runs", make)
    return [place / f"seed{seed}" for seed in (0, 1)]


@pytest.fixture
def run(runs: list[Path], tmp_path: Path) -> Path:
    """A copy of the first of them, to be changed."""
    return Path(shutil.copytree(runs[0], tmp_path / "run"))


@pytest.fixture(scope="session")
def report() -> Iterator[Callable[..., int]]:
    """``report(*arguments)``: the command in this process, with little to play and to watch."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("esp_trainer.report.measure.episodes", partial(episodes, n_episodes=32))
        yield lambda *arguments: main(["report", *map(str, arguments), "--generations", "8", "--episodes", "8"])


@pytest.fixture(scope="session")
def page_file(runs: list[Path], report: Callable[..., int], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the first run."""
    return _page_of(runs[:1], report, tmp_path_factory)


@pytest.fixture(scope="session")
def pages_file(runs: list[Path], report: Callable[..., int], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of both runs."""
    return _page_of(runs, report, tmp_path_factory)


def _page_of(runs: list[Path], report: Callable[..., int], factory: pytest.TempPathFactory) -> Path:
    def make(place: Path) -> None:
        assert report(*runs, "--out", place / "page.html") == 0

    return made_once(factory, f"page-of-{len(runs)}", make) / "page.html"


@pytest.fixture(scope="session")
def data_of() -> Callable[[Path], dict[str, Any]]:
    """``data_of(page)``: what a page was given."""

    def read(page: Path) -> dict[str, Any]:
        _, _, rest = page.read_text("utf-8").partition('<script type="application/json" id="data">')
        return json.loads(rest.partition("</script>")[0])  # type: ignore[no-any-return]

    return read


@pytest.fixture(scope="session")
def played_by_environment() -> Callable[[Path, int, int, list[list[int]]], list[list[list[int]]]]:
    """``played_by_environment(run, predators, prey, start)``: everybody's cells in a match between two generations."""
    return _played_by_environment


def _played_by_environment(run: Path, predators: int, prey: int, start: list[list[int]]) -> list[list[list[int]]]:
    directory = RunDirectory(run)
    config = directory.read_config()
    hunters = Team.load(directory.champion_file("predators", predators))
    hunted = Team.load(directory.champion_file("prey", prey))
    env = PredPreyEnv(config.env)
    observations, _ = env.reset(options={"starts": start})
    for team in (hunters, hunted):
        team.reset(int(seed_of(np.array(start, np.int32))))
    cells = [start]
    while env.agents:
        observations, *_ = env.step(hunters.act(observations) | hunted.act(observations))
        n, state = config.env.n_agents, env.state().astype(int)
        cells.append(np.stack([state[:n], state[n : 2 * n]], axis=1).tolist())
    return cells


@dataclass
class Tab:
    """A page that is open, and what it did that it must not."""

    page: Page
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def __call__(self, script: str, argument: object = None) -> Any:
        """Evaluate JavaScript in it."""
        return self.page.evaluate(script, argument)

    def until(self, condition: str) -> None:
        """Wait until JavaScript is true. (Playwright's own waiting evaluates strings, which the page forbids.)"""
        for _ in range(400):
            if self.page.evaluate(f"() => Boolean({condition})"):
                return
            self.page.wait_for_timeout(25)
        raise AssertionError(f"never came true: {condition}")

    def draw_charts(self) -> None:
        """Draw all charts, as for a print."""
        self("() => window.dispatchEvent(new Event('beforeprint'))")

    def assert_quiet(self) -> None:
        """It complained of nothing and asked the network for nothing."""
        assert self.complaints == []
        assert self.requests == []


_NOTHING_COMES_NEAR = "window.IntersectionObserver = class { observe() {} unobserve() {} disconnect() {} };"


def _listening(tab: Tab, file: Path, at: str = "") -> Tab:
    tab.page.on("console", lambda message: tab.complaints.append(f"{message.type}: {message.text}"))
    tab.page.on("pageerror", lambda error: tab.complaints.append(str(error)))
    tab.page.on("request", lambda request: None if _inside(request.url, file) else tab.requests.append(request.url))
    tab.page.goto(file.resolve().as_uri() + at)
    return tab


@pytest.fixture(scope="session")
def blank_tab(browser: Browser, page_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    """A page in whose scope games are played, between all kinds of network; what it shows does not matter."""
    floats = (files(report_package) / "assets" / "floats.js").read_text("utf-8")
    page, rules = page_file.read_text("utf-8"), rules_in_javascript(floats)
    assert rules in page
    file = tmp_path_factory.mktemp("blank") / "page.html"
    every = rules_in_javascript(floats, [*map(network_class, NETWORKS), Wide])
    file.write_text(page.replace(rules, every), "utf-8")
    context = browser.new_context()
    context.set_offline(True)
    yield _listening(Tab(context.new_page()), file)
    context.close()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., Tab]]:
    """``open_page(file, at, **context)``: a tab without a network, 1280 by 900 pixels if not told otherwise.

    ``at`` is the hash of its address. The reader asked for little motion, so the chase stands still until it is played.
    What is drawn only near the visible part, as charts are, is drawn only with ``near=True``: Plotly, which draws
    charts, takes three quarters of the CPU time in which a page opens.
    """
    contexts = []

    def go(file: Path, at: str = "", *, near: bool = False, **options: Any) -> Tab:
        usual = {"viewport": {"width": 1280, "height": 900}, "reduced_motion": "reduce"}
        context = browser.new_context(**{**usual, **options})
        context.set_offline(True)
        if not near:
            context.add_init_script(_NOTHING_COMES_NEAR)
        contexts.append(context)
        return _listening(Tab(context.new_page()), file, at)

    yield go
    for context in contexts:
        context.close()


def _inside(url: str, file: Path) -> bool:
    """Whether something comes from the page itself."""
    return url.split("#")[0] == file.resolve().as_uri() or url.startswith(("data:", "blob:"))
