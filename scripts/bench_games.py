"""Benchmark another game: MPE's simple_tag by every evaluator, in one run, as one Markdown table.

    pip install mpe2
    python scripts/bench_games.py > docs/games.md

CPU seconds are medians on one thread, for two processes they are wall seconds; contenders take turns, each warmed up in
its turn. Before anything is timed, all are seen to pay the same. It takes some minutes; run it on an idle machine.
"""

from __future__ import annotations

import os

# Before NumPy is imported: its products would use as many threads as there are cores.
os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))

from bench import games
from bench.page import measure_and_print

ANSWER = """\
Most of the time goes to the game's own Python: of the {figure of `ReferenceEvaluator`} that the reference evaluator
takes for an episode of MPE's `simple_tag`, the game's steps take {figure of the environment alone}. So no evaluator
that calls them can be much faster in one process, and two processes are {ratio of `GameEvaluator`, two processes}.
A game that steps many episodes at once as arrays, by a method `many()`, is
played {ratio of `GameEvaluator`, `many()`}."""
ABOUT = """\
Teams of the preset `game` play episodes of 25 steps. Ratios are to the reference evaluator, which plays a step at a
time; they compare CPU time, and for two processes wall time. `many()` is that of
`esp_trainer/games/simple_tag.py`, whose rewards equal those of `mpe2` to the bit.
"""

if __name__ == "__main__":
    packages = ("numpy", "numba", "pettingzoo", "mpe2")
    sections = {"games": games.rows}
    measure_and_print("Other games", ABOUT, packages, sections, games.FULL, games.QUICK, ANSWER)
