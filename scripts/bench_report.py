"""Benchmark ``esp-trainer report``: its time, the size of its page, and when a browser shows it: ``docs/report.md``.

    python scripts/bench_report.py RUN [RUN ...]
    python scripts/bench_report.py RUN --pictures   # only take the pictures, which are those of the tutorial's run

Prints a row for the first run by itself, and one for all of them. Needs Chromium, and the extra ``test``.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from playwright.sync_api import Page, sync_playwright
from study import table

# The last predators and prey, a little before the end of the chase that the page begins with.
NEAR_THE_END = "() => { predprey.player.pause(); predprey.player.seek(predprey.player.match.length - 9); }"
# The moment of the rarest behaviour that is seen with a capture, as it happens.
RAREST = """() => {
  const { player, data: { moments } } = predprey;
  const rare = ["encirclement", "herding", "simultaneous capture", "opposing attack"];
  const moment = moments.findLast(({ behaviour }) => rare.includes(behaviour)) ?? moments[0];
  const team = { run: moment.run, generation: moment.generation };
  player.show({ predators: team, prey: team, start: moment.start, name: "of this moment", step: moment.step + 3 });
  document.getElementById("play").scrollIntoView();
}"""
OPENED = 5  # times each page is opened
# The last thing that the page's script does is to make itself known; then a frame shows what it drew.
READY = """() => new Promise((done) => {
  const look = () => (window.predprey ? requestAnimationFrame(() => done(performance.now())) : setTimeout(look, 5));
  look();
})"""


def report(runs: list[Path], out: Path) -> float:
    """Make the page of some runs; return the seconds that it took."""
    begun = time.perf_counter()
    command = [sys.executable, "-m", "esp_trainer", "report", *map(str, runs), "--out", str(out)]
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begun


@contextmanager
def opened(page: Path) -> Iterator[Page]:
    """Open a page in Chromium, without a network."""
    flags = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]
    installed = shutil.which("chromium") or shutil.which("chromium-headless-shell")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=installed, args=flags)
        tab = browser.new_context(viewport={"width": 1240, "height": 860}, offline=True).new_page()
        tab.goto(page.resolve().as_uri(), wait_until="commit")
        yield tab
        browser.close()


def shown(page: Path) -> float:
    """Return the milliseconds from the start of loading to a page that is drawn and ready."""
    with opened(page) as tab:
        return float(tab.evaluate(READY))


def pictures(page: Path, out: Path) -> None:
    """Take pictures of a page: as it opens, at its rarest behaviour, and of its moments."""
    with opened(page) as tab:
        tab.set_viewport_size({"width": 1240, "height": 1000})  # the whole matrix below the verdict
        tab.evaluate(READY)
        tab.locator("#moments").screenshot(path=out / "moments.png")
        tab.evaluate("scrollTo(0, 0)")
        tab.evaluate(NEAR_THE_END)
        tab.wait_for_timeout(1000)  # until it is drawn
        tab.screenshot(path=out / "page.png")
        tab.evaluate(RAREST)
        tab.wait_for_timeout(1000)  # until it has scrolled there
        tab.screenshot(path=out / "player.png")


def main() -> None:
    """Make pages, open them, and print the table; or take pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--pictures", action="store_true", help="measure nothing, and take pictures of the first run")
    parser.add_argument("--out", type=Path, default=Path("docs/report"), help="where pictures go")
    options = parser.parse_args()
    with TemporaryDirectory() as place:
        page = Path(place) / "page.html"
        runs = [Path(shutil.copytree(run, Path(place) / run.resolve().name)) for run in options.runs]
        report(runs[:1], page)  # compiles
        if options.pictures:
            options.out.mkdir(parents=True, exist_ok=True)
            pictures(page, options.out)
            return
        rows = []
        for chosen in [runs[:1], runs] if len(runs) > 1 else [runs]:
            for run in chosen:
                shutil.rmtree(run / "analysis", ignore_errors=True)
            first, again = report(chosen, page), report(chosen, page)
            opening = median(shown(page) for _ in range(OPENED)) / 1000
            size = page.stat().st_size / 1e6
            rows.append([len(chosen), f"{first:.1f} s", f"{again:.1f} s", f"{size:.1f} MB", f"{opening:.2f} s"])
        print(table(["runs", "made in", "with the cross-play kept", "size", "opened in"], rows))


if __name__ == "__main__":
    main()
