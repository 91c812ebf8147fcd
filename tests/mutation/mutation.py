"""Mutation testing: change the rules, the fitness and the operators of ESP in one place at a time, and see which tests
notice.

    pip install cosmic-ray
    python tests/mutation/mutation.py                  # all modules, an hour on two busy cores; then the page
    python tests/mutation/mutation.py torus network    # some
    python tests/mutation/mutation.py --page           # the page alone, from what was run

Cosmic Ray makes the mutants, as mutmut passes over decorated functions, and all rules are decorated. Tests meet them in
copies of the project in .mutation, in two stages: in a fork with NUMBA_DISABLE_JIT, about a second a mutant, and what
lives there and is not in mutation.toml again with compiled rules, half a minute a mutant. Tests that take over a second
in plain Python wait for the second stage. Whoever needs longer than five times what the tests need otherwise, and 20 s,
counts as killed. It forks, so it needs Linux or macOS.

Stop it as you like: what was run is in .mutation/*.sqlite, and only mutants that live are run again, as a new test may
kill them. An edited module starts anew. Those that live were read: mutation.toml says why each may.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from mutants.modules import COMPILED, NAMES, PLACE, ROOT
from mutants.page import write
from mutants.readings import Reading, read_known, reading
from mutants.session import KILLED, SURVIVED, Mutant, Session, session
from mutants.suites import Suite, copies, measured, outcomes, plain

# Imported once, and found there by each fork. Nothing of the project is: that is what changes.
WARM = ("numba.extending", "numba.core.caching", "hypothesis.strategies", "scipy.stats", "pydantic", "gymnasium.vector")
WARM += ("pettingzoo.test", "matplotlib.figure")


def test(module: str, session: Session, known: Sequence[Reading], places: Sequence[Path]) -> None:
    """Run the tests of a module against those of its mutants that none has killed, in both stages."""
    suite = plain(module)
    stage(module, session, session.those(None, SURVIVED), suite, places)
    left = [mutant for mutant in session.those(SURVIVED) if not reading(module, mutant, known)]
    stage(module, session, left, suite._replace(files=(*suite.files, COMPILED), compiled=True), places)


def stage(module: str, session: Session, mutants: Sequence[Mutant], suite: Suite, places: Sequence[Path]) -> None:
    """Run a suite against mutants, and say what becomes of them."""
    if not mutants:
        return
    start, n_killed, how = time.perf_counter(), 0, "compiled" if suite.compiled else "plain"
    suite = measured(suite, places[0])
    for n, (mutant, outcome, why) in enumerate(outcomes(suite, module, mutants, places), start=1):
        session.record(mutant, outcome, f"{how}: {why}")
        n_killed += outcome == KILLED
        if n % 50 == 0 or n == len(mutants):
            took = time.perf_counter() - start
            said = f"{module}, {how}: {n} of {len(mutants)}, {n_killed} killed, {took:.0f} s"
            print(said, file=sys.stderr, flush=True)


def main() -> int:
    """Run the mutants, and write the page."""
    parser = argparse.ArgumentParser(description="Change the rules in one place at a time, and see which tests notice.")
    parser.add_argument(
        "modules", nargs="*", metavar="MODULE", help=f"modules to change (default: all): {' '.join(NAMES)}"
    )
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time (default: 2)")
    parser.add_argument("--page", action="store_true", help="only write the page, from what was run")
    parser.add_argument("--quick", action="store_true", help="only see that everything runs; writes no page")
    options = parser.parse_args()
    if unknown := sorted(set(options.modules) - set(NAMES)):
        parser.error(f"modules must be among {', '.join(NAMES)}, got {', '.join(unknown)}")
    known = read_known()
    if options.page:
        return write(known)
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # before Numba is imported, as it asks only once
    for name in WARM:
        importlib.import_module(name)
    gc.freeze()  # pytest collects garbage at its end, and would go through all of this
    if options.quick:
        with TemporaryDirectory() as place, session(ROOT / NAMES["torus"], Path(place)) as of:
            stage(NAMES["torus"], of, of.mutants[:10], plain(NAMES["torus"]), copies(Path(place), options.jobs))
        return 0
    places = copies(PLACE, options.jobs)
    for name in options.modules or NAMES:
        with session(ROOT / NAMES[name], PLACE) as of:
            test(NAMES[name], of, known, places)
    return write(known)


if __name__ == "__main__":
    sys.exit(main())
