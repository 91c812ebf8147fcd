"""The pictures of the page on optimal play."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from optimal.learners import Torus


def exploitability(torus: Torus, file: Path) -> None:
    """Prey answered optimally: while they learn, and, of the last ones, by time."""
    mpl.use("agg")
    import matplotlib.pyplot as plt

    figure, (learning, last) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    steps = np.arange(1, torus.size + 1)
    for course in torus.courses:
        shares = course.looks / course.looks[-1]
        found = [course.at("prey", look, torus.early) for look in range(len(course.looks))]
        (line,) = learning.plot(shares, [each.mean for each in found], label=course.learner.name)
        low, high = [each.low for each in found], [each.high for each in found]
        learning.fill_between(shares, low, high, color=line.get_color(), alpha=0.2, linewidth=0)
        last.plot(steps, course.prey[:, -1].mean(axis=0), color=line.get_color())
    for (script, role), curve in torus.scripts.items():
        if role == "prey":
            learning.axhline(curve[torus.early - 1], linestyle=":", color="grey")
            learning.annotate(script, (0, curve[torus.early - 1]), fontsize=8, color="grey", va="bottom")
            last.plot(steps, curve, ":", color="grey")
    learning.axhline(torus.optimal[torus.early - 1], color="k", label="optimal prey")
    last.plot(steps, torus.optimal, "k")
    within = f"caught within {torus.early} steps by who knows them"
    learning.set(xlabel="share of the training", ylabel="share of prey", title=f"Prey {within}", ylim=(0, 1))
    last.set(xlabel="steps", title="The last of them, by time", ylim=(0, 1.02))
    learning.legend(fontsize=8)
    figure.suptitle(f"Three predators and a prey on {torus.size} x {torus.size}")
    figure.savefig(file, dpi=120)
    plt.close(figure)
