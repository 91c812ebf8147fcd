"""What larger populations and more machines cost and bring: ``docs/scaling.md``.

    python scripts/bench_scaling.py [--quick]

Needs the extra ``ray``. Takes some five minutes on two cores that nobody else uses; ``--quick`` only shows that it
works.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.report import machine
from scaling import bounded, growth, sharding, sweeps
from scaling.page import page


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small, to see that it works; writes nothing")
    parser.add_argument("--out", type=Path, default=Path("docs/scaling.md"))
    options = parser.parse_args()
    scales = (1, 2) if options.quick else (1, 10, 100)
    population, at_most = (200, 4) if options.quick else (10_000, 60)
    grown = growth.measure(scales, population, at_most)
    shared = sharding.measure(scales)
    many = sweeps.measure(n_runs=2 if options.quick else 8, generations=3 if options.quick else 100)
    kept = bounded.measure(20 if options.quick else 10_000)
    text = page(grown, shared, many, kept, machine(["numpy", "numba", "ray"]))
    if not options.quick:
        options.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
