"""How fast it is: everything side by side, in one run, as one Markdown table.

    python scripts/bench_throughput.py > docs/throughput.md

CPU seconds are medians on one thread; contenders take turns, each warmed up in its turn. Before anything is timed, the
results of every evaluator are compared with the fused kernel's. It takes some minutes; run it on an idle machine.
"""

from __future__ import annotations

import argparse
import os
import sys

# Before NumPy is imported: its matrix products would use as many threads as there are cores.
os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))

from bench import environments, evaluators, training
from bench.report import machine, table
from bench.workload import FULL, PRESET, QUICK

SECTIONS = {
    "evaluators": evaluators.rows,
    "environments": environments.rows,
    "phases": training.phase_rows,
    "process": training.process_rows,
}


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description="Measure the throughput of the environment and of the trainer.")
    parser.add_argument("--quick", action="store_true", help="only see that everything runs")
    parser.add_argument("--only", choices=SECTIONS, nargs="+", default=list(SECTIONS), help="parts of the table")
    options = parser.parse_args()
    scale = QUICK if options.quick else FULL

    rows = []
    for name in options.only:
        print(f"measuring {name} ...", file=sys.stderr, flush=True)
        rows += SECTIONS[name](scale)
    print("# Throughput\n")
    print(f"Written by `scripts/bench_throughput.py`. {machine()}.\n")
    if options.quick:
        print("A smoke run: the work is too small for its figures to mean anything, so nothing is judged.\n")
        rows = [row._replace(met=None) for row in rows]
    print(
        f"The evaluators play the trials of the first generation of `{PRESET}`: teams drawn from random "
        "subpopulations. Their times are medians of CPU seconds, taken in turns, warm; ratios are to `fused` on one "
        "thread. All but the reference use 32-bit floats, and their results were checked to agree.\n"
    )
    print(table(rows))


if __name__ == "__main__":
    main()
