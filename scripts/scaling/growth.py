"""Generations with more trials and larger subpopulations on one machine: seconds by phase, and memory."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
from collections.abc import Sequence
from typing import NamedTuple

# A process of its own for each, as a peak of memory is never forgotten.
_CHILD = """
import json, resource, sys
from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset

n_trials, size, generations = map(int, sys.argv[1:])
config = preset("paper-3v2")
config = config.replace(esp=config.esp.replace(n_trials=n_trials, subpopulation_size=size))
evaluator = FusedEvaluator(config.env)
evaluator.compile()
run = Coevolution(config, new_sides(config), evaluator)
seconds = [run.step(number).seconds for number in range(generations)]
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
print(json.dumps({"seconds": seconds[1:], "peak": peak, "threads": evaluator.threads}))
"""
# Linux counts the memory of the process that starts another as the other's, so a small one starts it.
_SMALL = "import subprocess, sys; subprocess.run(sys.argv[1:], check=True)"


class Grown(NamedTuple):
    """A generation of a size."""

    n_trials: int
    subpopulation_size: int
    threads: int
    trials: float
    """Wall seconds of its trials, the median of several generations."""
    rest: float
    """Of everything else but the files."""
    peak: float
    """Megabytes of memory of the process at its peak."""


def measure(scales: Sequence[int], population: int, at_most: int) -> list[Grown]:
    """The paper's trials times each scale; the last once more with subpopulations of ``population`` neurons.

    Args:
        scales: By how much the paper's trials are multiplied.
        population: Neurons of the last subpopulations.
        at_most: Generations of a size, of which there are fewer where they are long.
    """
    sizes = [(1000 * scale, 100) for scale in scales] + [(1000 * scales[-1], population)]
    return [_measure(*size, at_most) for size in sizes]


def _measure(n_trials: int, size: int, at_most: int) -> Grown:
    generations = min(at_most, max(6, 200_000 // n_trials))
    child = [sys.executable, "-c", _CHILD, str(n_trials), str(size), str(generations)]
    done = subprocess.run([sys.executable, "-c", _SMALL, *child], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"a generation of {n_trials} trials failed: {done.stderr.strip()}")
    found = json.loads(done.stdout)
    trials = statistics.median([each["trials"] for each in found["seconds"]])
    rest = statistics.median([sum(each.values()) - each["trials"] for each in found["seconds"]])
    return Grown(n_trials, size, found["threads"], trials, rest, found["peak"] / 1e6)
