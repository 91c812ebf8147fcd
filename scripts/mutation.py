"""Mutation testing: change the rules, the fitness and the operators of ESP in one place at a time, and see which tests
notice.

    pip install cosmic-ray
    python scripts/mutation.py                  # all modules, an hour on two busy cores; then the page
    python scripts/mutation.py torus network    # some
    python scripts/mutation.py --plain          # without the second stage
    python scripts/mutation.py --page           # the page alone, from what was run

Cosmic Ray makes the mutants, as mutmut passes over decorated functions, and all rules are decorated. Tests meet them in
copies of the project in .mutation, in two stages: in a fork with NUMBA_DISABLE_JIT, about a second a mutant, and what
lives there and is not in scripts/mutants/read.toml again with compiled rules, half a minute a mutant. Tests that take
over a second in plain Python wait for the second stage. Whoever needs longer than five times what the tests need
otherwise, and 20 s, counts as killed. It forks, so it needs Linux or macOS.

Stop it as you like: what was run is in .mutation/*.sqlite, and only mutants that live are run again, as a new test may
kill them. An edited module, or --fresh, starts anew. Those that live were read: read.toml says why each may.
"""

from __future__ import annotations

import argparse
import sys
import time
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mutants.making import Mutant, Session
    from mutants.page import Reading
    from mutants.running import Suite

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / ".mutation"
READ = ROOT / "scripts" / "mutants" / "read.toml"
PAGE = ROOT / "docs" / "reliability" / "mutation.md"

# Each module, and the files in tests that are meant to hold it.
MODULES = {
    "predprey_env/rules/torus.py": "predprey_env/test_torus",
    "predprey_env/rules/dynamics.py": "predprey_env/test_dynamics predprey_env/test_parallel_env "
    "predprey_env/test_parallel_env_turns predprey_env/test_invariants",
    "predprey_env/rules/fitness.py": "predprey_env/test_fitness predprey_env/test_parallel_env_rewards",
    "predprey_env/rules/observation.py": "predprey_env/test_observation predprey_env/test_parallel_env",
    "predprey_env/rules/starts.py": "predprey_env/test_dynamics predprey_env/test_parallel_env_randomness "
    "predprey_env/test_parallel_env_errors esp_trainer/evaluation/test_starts predprey_env/test_vector_env "
    "predprey_env/test_vector_env_parity",
    "esp_trainer/esp/operators.py": "esp_trainer/esp/test_operators",
    "esp_trainer/esp/subpopulations.py": "esp_trainer/esp/test_subpopulations "
    "esp_trainer/esp/test_subpopulations_of_several_kinds",
    "esp_trainer/esp/network.py": "esp_trainer/esp/test_network esp_trainer/esp/test_teams_of_every_controller "
    "esp_trainer/esp/test_controllers_of_several_networks",
    "esp_trainer/coevolution/champions.py": "esp_trainer/coevolution/test_champions "
    "esp_trainer/coevolution/test_fixed_sides",
    "esp_trainer/coevolution/sharing.py": "esp_trainer/coevolution/test_sharing",
    "esp_trainer/coevolution/opponents.py": "esp_trainer/coevolution/test_opponents",
}
# What holds the compiled faces of the world to the plain ones, beside a module's own tests.
COMPILED = "esp_trainer/evaluation/test_parity"

ABOUT = """\
Made by `python scripts/mutation.py`; the docstring there says how. One thing of a module is changed at a time by Cosmic
Ray {version}, an operator, a number, a condition or a loop, and the module's own tests are run. A mutant is killed when
a test fails, or when the tests take over five times as long as otherwise, and 20 s. Not counted are mutants of
annotations, of decorators, of what errors say, of equality to identity, and those that are not Python. The score is the
share killed of the mutants that are not equivalent, which nobody could tell from the original. All that live were read,
and below is why each may. Cosmic Ray leaves out no single statement and swaps no arguments: of such mistakes the score
says nothing.
"""


def main() -> int:
    """Run the mutants, and write the page."""
    names = {Path(module).stem: module for module in MODULES}
    parser = argparse.ArgumentParser(description="Change the rules in one place at a time, and see which tests notice.")
    parser.add_argument(
        "modules", nargs="*", metavar="MODULE", help=f"modules to change (default: all): {' '.join(names)}"
    )
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time (default: 2)")
    parser.add_argument("--plain", action="store_true", help="leave out the stage with compiled rules")
    parser.add_argument("--page", action="store_true", help="only write the page, from what was run")
    parser.add_argument("--fresh", action="store_true", help="forget what was run")
    parser.add_argument("--quick", action="store_true", help="only see that everything runs; writes no page")
    options = parser.parse_args()
    if unknown := sorted(set(options.modules) - set(names)):
        parser.error(f"modules must be among {', '.join(names)}, got {', '.join(unknown)}")
    try:
        version = metadata.version("cosmic-ray")
    except metadata.PackageNotFoundError:
        parser.error("mutants are made by Cosmic Ray: pip install cosmic-ray")

    from mutants import running
    from mutants.making import session
    from mutants.page import readings

    if not options.page:
        running.warm_up()
    if options.quick:
        with TemporaryDirectory() as place, session(ROOT / names["torus"], Path(place)) as of:
            stage(names["torus"], of, of.mutants[:10], plain(names["torus"]), running.copies(Path(place), options.jobs))
        return 0
    known = readings(READ)
    for name in [] if options.page else options.modules or names:
        if options.fresh:
            for file in PLACE.glob(f"{name}-*.sqlite"):
                file.unlink()
        with session(ROOT / names[name], PLACE) as of:
            test(names[name], of, known, options)
    return write(known, ABOUT.format(version=version))


def write(known: Sequence[Reading], about: str) -> int:
    """Write the page on all modules that were run to the end; whether what lives and what was read are the same."""
    from mutants import page
    from mutants.making import session

    counts = {}
    for module in MODULES:
        with session(ROOT / module, PLACE) as of:
            if not of.those(None):
                counts[module] = page.count(module, of, known)
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(page.page(counts, about))
    unread = sum(read is None for of in counts.values() for _, read in of.survived)
    print(f"{PAGE.relative_to(ROOT)}: {unread} mutants live and were not read", file=sys.stderr)
    idle = page.idle(counts, known)
    for read in idle:
        print(f"read.toml, {read.module}, {read.function}: no such mutant lives: {read.becomes}", file=sys.stderr)
    return int(bool(unread or idle))


def plain(module: str) -> Suite:
    """The tests of a module, in plain Python."""
    from mutants.running import Suite

    return Suite(tuple(f"tests/{file}.py" for file in MODULES[module].split()), compiled=False)


def test(module: str, session: Session, known: Sequence[Reading], options: argparse.Namespace) -> None:
    """Run the tests of a module against those of its mutants that none has killed, in both stages."""
    from mutants.making import SURVIVED
    from mutants.page import reading
    from mutants.running import copies

    suite, places = plain(module), copies(PLACE, options.jobs)
    stage(module, session, session.those(None, SURVIVED), suite, places)
    left = [mutant for mutant in session.those(SURVIVED) if not reading(module, mutant, known)]
    if not options.plain:
        suite = suite._replace(files=(*suite.files, f"tests/{COMPILED}.py"), compiled=True)
        stage(module, session, left, suite, places)


def stage(module: str, session: Session, mutants: Sequence[Mutant], suite: Suite, places: Sequence[Path]) -> None:
    """Run a suite against mutants, and say what becomes of them."""
    from mutants.running import measured, outcomes

    if not mutants:
        return
    start = time.perf_counter()
    suite = measured(suite, places[0])
    how = "compiled" if suite.compiled else "plain"
    n_killed = 0
    for n, (mutant, outcome, why) in enumerate(outcomes(suite, module, mutants, places), start=1):
        session.record(mutant, outcome, f"{how}: {why}")
        n_killed += outcome == "killed"
        if n % 50 == 0 or n == len(mutants):
            took = time.perf_counter() - start
            said = f"{module}, {how}: {n} of {len(mutants)}, {n_killed} killed, {took:.0f} s"
            print(said, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
