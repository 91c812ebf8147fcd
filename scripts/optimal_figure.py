"""Draw the figure of ``docs/optimal_play.md`` from the tables of that page: how exploitable prey are on 6 x 6."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from esp_trainer.analysis import plots

PAGE = Path("docs/optimal_play.md")
FIGURE = Path("docs/optimal_play/exploitability.png")
LEARNER = re.compile(r"^\| 6 x 6, (.+?) \| (.+) \|\n\| ---.*\n\| within 2 .+?\| (.+) \|$", re.MULTILINE)
"""Table of a learner: its name, when it was looked at, and the fraction caught of its prey."""
POLICY = re.compile(r"^\| (policy|prey, .+?|both sides play optimally) \| (.+) \|$", re.MULTILINE)
"""Row of the table of policies: the name, and a cell for each number of steps."""
FIXED = {"random": "prey, random", "flee_nearest": "prey, flee_nearest", "optimal": "both sides play optimally"}


def numbers(cells: str) -> np.ndarray:
    """Return a row for each cell: its number, and the ends of its interval if it has one."""
    return np.array([re.findall(r"[\d.]+", cell) for cell in cells.split("|")], float)


def draw(page: str, out: Path) -> None:
    """Draw the prey of every learner as they learn, and the last of each by the number of steps."""
    page = page.replace("`", "")
    caught = {name: numbers(cells)[:, 0] for name, cells in POLICY.findall(page)}
    steps = caught["policy"].astype(int)
    figure, (learning, last) = plots.panels(2, width=4.6, height=3.2, columns=2)
    for number, (name, looks, cells) in enumerate(LEARNER.findall(page)):
        style = {"color": plots.COLOURS[number], "linestyle": plots.dash_of(number)}
        trained, (mean, low, high) = numbers(looks)[:, 0], numbers(cells).T
        learning.plot(trained / trained[-1], mean, label=name, **style)
        learning.fill_between(trained / trained[-1], low, high, color=style["color"], alpha=0.2, linewidth=0)
        last.plot(steps, caught[f"prey, {name}"], **style)
    for label, row in FIXED.items():
        style = {"color": "black" if label == "optimal" else "grey", "linewidth": 0.9}
        learning.axhline(caught[row][0], **style)
        last.plot(steps, caught[row], **style)
        learning.annotate(label, (1.01, caught[row][0]), xycoords=("axes fraction", "data"), fontsize=8, va="center")
    learning.set(title=f"within {steps[0]} steps, during training", xlabel="fraction of the training", ylim=(0, 1))
    learning.set_ylabel("fraction of prey caught")
    last.set(title="after training", xlabel="steps", xticks=steps, ylim=(0, 1.02))
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    figure.savefig(out, dpi=160, metadata={"Software": None})  # its data are the tables


if __name__ == "__main__":
    draw(PAGE.read_text(), FIGURE)
