"""How long ``esp-trainer report`` takes, how large its page is, and how soon a browser shows it: ``docs/report.md``.

    python scripts/bench_report.py RUN [RUN ...] [--moments RUN]

Prints a row for the first run by itself, and one for all of them. Takes pictures of the first, and of the moments of
another run too if one is named. Needs Chromium, and the extra ``test``.
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

# The moment of the rarest behaviour that is seen with a capture, as it happens.
SHOW = """() => {
  const { player, data: { moments } } = predprey;
  const rare = ["encirclement", "herding", "simultaneous capture", "opposing attack"];
  const moment = moments.find(({ behaviour }) => rare.includes(behaviour)) ?? moments[0];
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
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=flags)
        tab = browser.new_context(viewport={"width": 1240, "height": 860}, offline=True).new_page()
        tab.goto(page.resolve().as_uri(), wait_until="commit")
        yield tab
        browser.close()


def shown(page: Path) -> float:
    """Return the milliseconds from the start of loading to a page that is drawn and ready."""
    with opened(page) as tab:
        return float(tab.evaluate(READY))


def main() -> None:
    """Make pages, open them, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--moments", type=Path, metavar="RUN", help="take a picture of its moments too")
    parser.add_argument("--out", type=Path, default=Path("docs/report"), help="where pictures go")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as place:
        page = Path(place) / "page.html"
        runs = [Path(shutil.copytree(run, Path(place) / run.resolve().name)) for run in options.runs]
        report(runs[:1], page)  # compiles
        rows = []
        for chosen in [runs[:1], runs] if len(runs) > 1 else [runs]:
            for run in chosen:
                shutil.rmtree(run / "analysis", ignore_errors=True)
            first, again = report(chosen, page), report(chosen, page)
            opening = median(shown(page) for _ in range(OPENED)) / 1000
            size = page.stat().st_size / 1e6
            rows.append([len(chosen), f"{first:.1f} s", f"{again:.1f} s", f"{size:.1f} MB", f"{opening:.2f} s"])
        print(table(["runs", "made in", "with the cross-play kept", "size", "opened in"], rows))
        for number, run in enumerate([runs[0], *([options.moments] if options.moments else [])], 1):
            report([run], page)
            with opened(page) as tab:
                tab.evaluate(READY)
                tab.locator("#moments").screenshot(path=options.out / f"moments-{number}.png")
                if number == 1:
                    tab.evaluate(SHOW)
                    tab.wait_for_timeout(1000)  # until it has scrolled there
                    tab.screenshot(path=options.out / "player.png")


if __name__ == "__main__":
    main()
