"""How long ``esp-trainer report`` takes, how large its page is, and how soon a browser shows it: ``docs/report.md``.

    python scripts/bench_report.py RUN [RUN ...] [--moments RUN]

The first run by itself, then all of them. Pictures are taken of the first, and of the moments of another run too if one
is named. Needs Chromium, and the extra ``test``.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from playwright.sync_api import sync_playwright

# The moment of the rarest behaviour that is seen with a capture, as it happens.
SHOW = """() => {
  const { player, data } = predprey, moments = data.moments.filter(({ title }) => !title.startsWith("Phase"));
  const rare = ["Encirclement", "Herding", "Simultaneous capture", "Opposing attack"];
  const moment = moments.find(({ title }) => rare.includes(title)) ?? moments[0];
  const team = { run: moment.run, generation: moment.generation };
  player.show({ predators: team, prey: team, start: moment.start, name: "of this moment", step: moment.step + 3 });
  document.getElementById("play").scrollIntoView();
}"""
OPENED = 5  # times each page is opened
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]
# The last thing that the page's script does is to make itself known; then a frame shows what it drew.
READY = """() => new Promise((done) => {
  const look = () => (window.predprey ? requestAnimationFrame(() => done(performance.now())) : setTimeout(look, 5));
  look();
})"""


@dataclass(frozen=True)
class Page:
    """What was measured of a page."""

    what: str
    first: float
    """Seconds to make it, all matches played."""
    again: float
    """Seconds with the cross-play kept from before."""
    size: float
    """Megabytes."""
    shown: float
    """Milliseconds from the start of loading to a page that is drawn and ready, the median of several."""


def main() -> None:
    """Make pages, open them, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--moments", type=Path, metavar="RUN", help="take a picture of its moments too")
    parser.add_argument("--out", type=Path, default=Path("docs/report.md"))
    options = parser.parse_args()
    with TemporaryDirectory() as place:
        runs = [Path(shutil.copytree(run, Path(place) / run.resolve().name)) for run in options.runs]
        subprocess.run(report(runs[:1], Path(place) / "page.html"), check=True, capture_output=True)  # compiles
        pages = []
        several = {f"{len(runs)} runs": runs} if len(runs) > 1 else {}
        for what, chosen in {"one run": runs[:1], **several}.items():
            for run in runs:
                shutil.rmtree(run / "analysis", ignore_errors=True)
            pages.append(measure(what, chosen))
        pictures = options.out.with_suffix("")
        pictures.mkdir(parents=True, exist_ok=True)
        photographed = [runs[0], options.moments] if options.moments else [runs[0]]
        for number, run in enumerate(photographed, 1):
            page = Path(place) / "page.html"
            subprocess.run(report([run], page), check=True, capture_output=True)
            photograph(page, pictures / f"moments-{number}.png", pictures / "player.png" if number == 1 else None)
    options.out.write_text(table(pages, options.runs, options.moments))
    print(options.out.read_text())


def measure(what: str, runs: list[Path]) -> Page:
    """Make a page twice, and open it."""
    out = runs[0].parent / "page.html"
    seconds = []
    for _ in range(2):
        begun = time.perf_counter()
        subprocess.run(report(runs, out), check=True, capture_output=True)
        seconds.append(time.perf_counter() - begun)
    return Page(what, *seconds, out.stat().st_size / 1e6, opened(out))


def report(runs: list[Path], out: Path) -> list[str]:
    """The command for a page."""
    return [sys.executable, "-m", "esp_trainer", "report", *map(str, runs), "--out", str(out)]


def opened(page: Path) -> float:
    """How long Chromium takes until the page is ready, in milliseconds."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        times = []
        for _ in range(OPENED):
            context = browser.new_context(viewport={"width": 1280, "height": 900}, offline=True)
            tab = context.new_page()
            tab.goto(page.resolve().as_uri(), wait_until="commit")
            times.append(tab.evaluate(READY))
            context.close()
        browser.close()
    return float(np.median(times))


def photograph(page: Path, moments: Path, chase: Path | None) -> None:
    """Pictures of a page: of the moments of its phases and behaviours, and of a chase with who catches whom."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        tab = browser.new_context(viewport={"width": 1240, "height": 860}, offline=True).new_page()
        tab.goto(page.resolve().as_uri())
        tab.locator("#moments").screenshot(path=moments)
        if chase:
            tab.evaluate(SHOW)
            tab.wait_for_timeout(1000)  # until it has scrolled there
            tab.screenshot(path=chase)
        browser.close()


def table(pages: list[Page], runs: list[Path], moments: Path | None) -> str:
    """The measurements as Markdown, and the pictures."""
    rows = "\n".join(
        f"| {page.what} | {page.first:.1f} s | {page.again:.1f} s | {page.size:.1f} MB | {page.shown / 1000:.2f} s |"
        for page in pages
    )
    command = " ".join([*(run.name for run in runs), *(["--moments", moments.name] if moments else [])])
    pictures = "\n\n".join(
        f"![Moments of {run.name}](report/moments-{number}.png)"
        for number, run in enumerate([runs[0], moments] if moments else [runs[0]], 1)
    )
    return f"""# What a page costs, and what it shows

Made by `python scripts/bench_report.py {command}`, on two cores.

| page of | made in | with the cross-play kept | size | opened in |
| --- | --- | --- | --- | --- |
{rows}

Making counts the start of Python. Opened: Chromium without a network, from the start of loading to the last chart
drawn, the median of {OPENED}.

The page of the first run, at its rarest behaviour:

![A chase, its time line, and who catches whom](report/player.png)

Moments, as figures 4 and 6 of the paper show them, here picked by the detectors: of each phase the one that sets it
apart, and of each behaviour the one that lasts longest.

{pictures}
"""


if __name__ == "__main__":
    main()
