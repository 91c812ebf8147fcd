"""Benchmark evaluators, environments and the trainer side by side, in one run, as one Markdown table.

    python scripts/bench_throughput.py > docs/throughput.md

CPU seconds are medians on one thread; contenders take turns, each warmed up in its turn. Before anything is timed, the
results of every evaluator are compared with the fused kernel's. It takes some minutes; run it on an idle machine.
"""

from __future__ import annotations

import os

# Before NumPy is imported: its matrix products would use as many threads as there are cores.
os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))

from bench import evaluators, replaced, single, training
from bench.page import measure_and_print
from bench.workload import FULL, PRESET, QUICK

SECTIONS = {
    "evaluators": evaluators.rows,
    "replaced": replaced.rows,
    "environments": single.own_rows,
    "phases": training.phase_rows,
    "process": training.process_rows,
}
ANSWER = """\
On one thread the compiled evaluator (`fused`) plays the 6,000 episodes of a generation in {figure of `fused`,}.
The same through PettingZoo's API takes {figure of `reference`} ({ratio of `reference`}). `parallel_env` makes \
{figure of `parallel_env()`} with random actions.
A network of your own costs {ratio of trials with networks of a user} for the same work."""
ABOUT = f"""\
The evaluators play the trials of the first generation of `{PRESET}`: teams drawn from random subpopulations. Their
times are medians of CPU seconds, taken in turns, warm; ratios are to `fused` on one thread. The results of the
reference were checked to agree.
"""

if __name__ == "__main__":
    measure_and_print("Throughput", ABOUT, ("numpy", "numba", "pettingzoo"), SECTIONS, FULL, QUICK, ANSWER)
