"""The costs of larger populations, and of shards of a generation: the central tables of ``docs/scaling.md``.

    python scripts/bench_scaling.py [--quick]

Needs the extra ``ray``. Takes some five minutes on two cores that nobody else uses; ``--quick`` only shows that it
works.
"""

from __future__ import annotations

import argparse
import json
import pickle
import statistics
import subprocess
import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from bench.timing import Seconds, measure
from bench.workload import first_generation
from study import machine, table

from esp_trainer import cluster
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.sharded import ShardedEvaluator
from esp_trainer.presets import preset

PAPER_CONFIG = preset("paper-3v2")
SHARDS = (2, 8, 32)
# A process of its own for each size, as a peak of memory is never forgotten.
MEMORY_SCRIPT = """
import json, resource, sys
from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset

n_trials, size, generations = map(int, sys.argv[1:])
config = preset("paper-3v2").with_fields({"esp.n_trials": n_trials, "esp.subpopulation_size": size})
evaluator = FusedEvaluator(config.env)
evaluator.compile()
run = Coevolution(config, new_sides(config), evaluator)
seconds = [run.step(number).seconds for number in range(generations)]
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
print(json.dumps({"seconds": seconds[1:], "peak": peak}))
"""
# Linux counts the memory of the process that starts another as the other's, so a small one starts it.
STARTS_A_PROCESS = "import subprocess, sys; subprocess.run(sys.argv[1:], check=True)"


class Shared(NamedTuple):
    """The trials of a generation in shards on a cluster of this machine."""

    n_trials: int
    shards: int
    here: float
    """Wall seconds in one process with a thread for each core."""
    wall: float
    """Wall seconds on as many workers as there are cores."""
    driver: float
    """CPU seconds of the driver."""


def grow(n_trials: int, size: int, at_most: int) -> list[str]:
    """Return a row: median wall seconds of a generation's trials and of the rest but files, and the peak of memory."""
    generations = min(at_most, max(6, 200_000 // n_trials))
    child = [sys.executable, "-c", MEMORY_SCRIPT, str(n_trials), str(size), str(generations)]
    done = subprocess.run([sys.executable, "-c", STARTS_A_PROCESS, *child], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"a generation of {n_trials} trials failed: {done.stderr.strip()}")
    found = json.loads(done.stdout)
    trials = statistics.median(each["trials"] for each in found["seconds"])
    rest = statistics.median(sum(each.values()) - each["trials"] for each in found["seconds"])
    return [f"{n_trials:,}", f"{size:,}", f"{trials:.3f} s", f"{rest:.3f} s", f"{found['peak'] / 1e6:.0f} MB"]


def share(scales: Sequence[int], times: int) -> tuple[list[Shared], float]:
    """Return the trials of a generation of ``paper-3v2``, times each scale, in shards; and the round trip of a task."""
    here = FusedEvaluator(PAPER_CONFIG.env)
    here.compile()

    def median(work: object) -> Seconds:
        taken = [measure(work) for _ in range(1 + times)][1:]  # type: ignore[arg-type]  # the first wakes everybody
        return Seconds(*(statistics.median(each) for each in zip(*taken, strict=True)))

    found = []
    with cluster.connected("local"):
        for scale in scales:
            batch = first_generation(PAPER_CONFIG.with_fields({"esp.n_trials": 1000 * scale}))
            expected, alone = here.evaluate(batch), median(lambda batch=batch: here.evaluate(batch))
            for shards in SHARDS:
                evaluator = ShardedEvaluator(PAPER_CONFIG.env, shards, least_episodes=1)
                if not np.array_equal(evaluator.evaluate(batch).fitness, expected.fitness):
                    raise AssertionError("shards gave other results")
                taken = median(lambda batch=batch, evaluator=evaluator: evaluator.evaluate(batch))
                found.append(Shared(len(batch.starts), shards, alone.wall, taken.wall, taken.cpu))
        trip = median(lambda: cluster.gather([cluster.submit(abs, -1)])).wall
    return found, trip


def driver_seconds(batches: Sequence[Shared]) -> np.ndarray:
    """Return the driver's CPU seconds for a batch, for each shard and for each trial, by least squares."""
    design = np.array([[1.0, each.shards, each.n_trials] for each in batches])
    weights = 1 / np.sqrt([each.n_trials for each in batches])  # or the largest batches alone would decide
    driver = np.array([each.driver for each in batches])
    return np.asarray(np.linalg.lstsq(design * weights[:, None], driver * weights, rcond=None)[0])


def bytes_of_a_trial() -> tuple[float, float]:
    """Return what goes over the wire for a trial: to a worker, and from it."""
    batch = first_generation(PAPER_CONFIG)
    sent = (batch.predators.indices, batch.prey.indices, batch.starts)  # type: ignore[union-attr]
    returned = FusedEvaluator(PAPER_CONFIG.env).evaluate(batch)
    to, back = (len(pickle.dumps(each, protocol=5)) / len(batch.starts) for each in (sent, returned))
    return to, back


def main() -> None:
    """Measure, and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small, to see that it works")
    quick = parser.parse_args().quick
    scales, population, at_most, times = ((1, 2), 200, 4, 1) if quick else ((1, 10, 100), 10_000, 60, 7)
    sizes = [(1000 * scale, 100) for scale in scales] + [(1000 * scales[-1], population)]
    heads = ["trials", "neurons a subpopulation", "trials, wall", "the rest, wall", "peak memory"]
    print(f"{machine(['numpy', 'numba', 'ray'])}.\n")
    print(table(heads, [grow(*size, at_most) for size in sizes], "---:"), end="\n\n")
    found, trip = share(scales, times)
    rows = [
        [f"{b.n_trials:,}", f"{1e3 * b.here:.1f} ms", b.shards, f"{1e3 * b.wall:.1f} ms", f"{1e3 * b.driver:.1f} ms"]
        for b in found
    ]
    print(table(["trials", "one process, wall", "shards", "on Ray, wall", "driver, CPU"], rows, "---:"))
    fixed, per_shard, per_trial = driver_seconds(found)
    to, back = bytes_of_a_trial()
    print(f"\nThe driver's CPU time for a batch: {1e3 * fixed:.1f} ms + {1e3 * per_shard:.2f} ms x shards", end="")
    print(f" + {1e6 * per_trial:.2f} us x trials. An empty task there and back takes {1e3 * trip:.1f} ms.")
    print(f"A trial is {to:.0f} bytes to a worker and {back:.0f} bytes from it.")


if __name__ == "__main__":
    main()
