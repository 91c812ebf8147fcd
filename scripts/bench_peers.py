"""Benchmark the environments and those of others side by side, in one run, as one Markdown table.

    pip install supersuit "pettingzoo[sisl]" mpe2 jaxmarl agilerl
    python scripts/bench_peers.py > docs/peers.md

A peer that is not installed is reported as such; all are optional.

CPU seconds are medians of the process and of those that it starts, with one thread; contenders take turns, each warmed
up in its turn. Before anything is timed, each is seen to end episodes, and those of many worlds to catch. It takes some
minutes; run it on an idle machine.
"""

from __future__ import annotations

import os

# Before NumPy and JAX are imported: they would use as many threads as there are cores.
os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
os.environ["JAX_PLATFORMS"] = "cpu"

from bench import peers_batched, peers_both, peers_vectorised, single
from bench.contenders import FULL, QUICK
from bench.page import measure_and_print

SECTIONS = {
    "batched": peers_batched.rows,
    "both": peers_both.rows,
    "parallel": single.rows,
    "vectorised": peers_vectorised.rows,
}
PACKAGES = ("numpy", "numba", "gymnasium", "pettingzoo", "mpe2", "supersuit", "agilerl", "jax", "jaxmarl")

JAX = "JaxMARL `simple_tag`, 1024 worlds, 3 v 2, `lax.scan`"
ANSWER = f"""\
In 1,024 worlds `vector_env` makes {{figure of `vector_env(1024, ...)`, predators against random prey}}, and JaxMARL's \
`simple_tag` {{figure of {JAX}}} ({{ratio of {JAX}}} as fast).
One world through PettingZoo's API makes {{figure of `parallel_env()`}}, and one of MPE's `simple_tag` \
{{figure of MPE}} ({{ratio of MPE}} as fast).
128 worlds through SuperSuit make {{figure of SuperSuit}} ({{ratio of SuperSuit}} as fast, in `vector_env` and for the \
same work)."""
ABOUT = """\
All figures are of this run. A step is a time step of one world, with random actions drawn before; observations, rewards
and infos are given back, and resets are part of it. Times are medians of CPU seconds of the whole process and of those
that it starts, taken in turns, warm. `ours` is how many times as fast the project's own row is: the nearest one above,
and for JaxMARL beside `vector_env` the one of 1,024 worlds against random prey.

Only `team_view()` and `parallel_env()` in SuperSuit, in AgileRL and in loops do the same work, and were checked to.
Other games do other work: MPE and JaxMARL integrate forces among two obstacles; `pursuit` has a small grid with a
wall. Agents see 16 to 20 numbers in tag, 147 in `pursuit`, 4 or 6 here.

PufferLib's `Target`, in C, was measured once, on a faster machine, beside these (pufferlib 3.0.0;
`scripts/bench/peers_compiled.py` of commit af98edc). In 1,024 worlds of 3 agents and 2 goals it makes 6,841,335 steps a
CPU-second (ours was 1.15 x), of 5 agents and 2 goals 3,781,172 (2.08 x), and in its default size, 8 agents and 4 goals,
1,936,843. Its goals stand still and nobody ends; its agents see 14 to 28 numbers.
"""

if __name__ == "__main__":
    measure_and_print("Speed beside other environments", ABOUT, PACKAGES, SECTIONS, FULL, QUICK, ANSWER)
