"""Draw the figure of ``docs/optimal_play.md`` from the tables of that page: how exploitable prey are on 6 x 6.

python scripts/optimal_figure.py [--out FILE]
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from esp_trainer.analysis import plots

PAGE = Path("docs/optimal_play.md")
FIGURE = Path("docs/optimal_play/exploitability.png")
LEARNER = "6 x 6, "
NUMBER = re.compile(r"[\d.]+")
Rows = list[list[str]]


def tables(text: str) -> dict[str, Rows]:
    """Return the rows of each table of a page, its heads first, by the first head; cells are without backticks."""
    found: dict[str, Rows] = {}
    for lines in re.findall(r"(?:^\|.*\n)+", text.replace("`", ""), re.MULTILINE):
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines.splitlines()]
        found[rows[0][0]] = [rows[0], *rows[2:]]
    return found


def numbers(cell: str) -> list[float]:
    """Return the figure of a cell, and the ends of its interval if it has one."""
    return [float(part) for part in NUMBER.findall(cell)]


def draw_learning(axes: Axes, name: str, rows: Rows, number: int) -> None:
    """Draw the fraction of a learner's prey caught within the fewest steps, with its interval, as it learns."""
    looks = np.array([float(head) for head in rows[0][1:]])
    mean, low, high = np.array([numbers(cell) for cell in rows[1][1:]]).T
    trained, colour = looks / looks[-1], plots.COLOURS[number]
    axes.plot(trained, mean, color=colour, linestyle=plots.dash_of(number), label=name)
    axes.fill_between(trained, low, high, color=colour, alpha=0.2, linewidth=0)


def draw(page: str, out: Path) -> None:
    """Draw the prey of every learner as they learn, and the last of each by the number of steps."""
    found = tables(page)
    heads, *rows = found["policy"]
    steps = [int(numbers(head)[0]) for head in heads[1:]]
    caught = {row[0]: [numbers(cell)[0] for cell in row[1:]] for row in rows}
    figure, (learning, last) = plots.panels(2, width=4.6, height=3.2, columns=2)
    for number, head in enumerate(head for head in found if head.startswith(LEARNER)):
        name = head.removeprefix(LEARNER)
        draw_learning(learning, name, found[head], number)
        last.plot(steps, caught[f"prey, {name}"], color=plots.COLOURS[number], linestyle=plots.dash_of(number))
    fixed = {"random": "prey, random", "flee_nearest": "prey, flee_nearest", "optimal": "both sides play optimally"}
    for label, row in fixed.items():
        colour = "black" if label == "optimal" else "grey"
        learning.axhline(caught[row][0], color=colour, linewidth=0.9)
        last.plot(steps, caught[row], color=colour, linewidth=0.9)
        place = ("axes fraction", "data")
        learning.annotate(label, (1.01, caught[row][0]), xycoords=place, fontsize=8, va="center")
    learning.set(title=f"within {steps[0]} steps, during training", xlabel="fraction of the training", ylim=(0, 1))
    last.set(title="after training", xlabel="steps", xticks=steps, ylim=(0, 1.02))
    learning.set_ylabel("fraction of prey caught")
    handles, labels = learning.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    figure.savefig(out, dpi=160, metadata={"Software": None})  # its data are the tables


def main() -> None:
    """Draw it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=FIGURE, help=f"by default {FIGURE}")
    draw(PAGE.read_text(), parser.parse_args().out)


if __name__ == "__main__":
    main()
