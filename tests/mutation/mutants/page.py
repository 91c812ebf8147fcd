"""The page of what lives, and why each may."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import metadata

from mutants.modules import MODULES, PLACE, ROOT
from mutants.readings import READ, Reading, reading
from mutants.session import KILLED, SURVIVED, database_file, session

PAGE = ROOT / "docs" / "reliability" / "mutation.md"

ABOUT = """\
# Mutation testing

The tests notice {killed:,} of {counted:,} small faults ({score:.1%}) that were put one at a time into the rules, the
operators and the fitness. Faults that change nothing are not counted.

Made by `python tests/mutation/mutation.py`; the docstring there says how. Cosmic Ray {version} changes one thing of a
module at a time (an operator, a number, a condition or a loop), and the module's own tests are run. Such a *mutant* is
killed when a test fails, or when the tests take over five times as long as otherwise, and 20 s. Not counted are
mutants of annotations, of decorators, of what errors say, of equality to identity, and those that are not Python. The
score is the fraction killed of the mutants that are not *equivalent*: an equivalent mutant behaves as the original
does. Every mutant that survived was read, and the lists below say why it may live. Cosmic Ray leaves out no single
statement and swaps no arguments, so the score says nothing of such mistakes.
"""


def write(known: Sequence[Reading]) -> int:
    """Write the page on all modules that were run to the end; return 1 unless what lives and what was read agree."""
    rows, lists, unread = [], {"Survived": list[str](), "Equivalent": list[str]()}, 0
    idle = {(read.module, read.function, line) for read in known for line in read.becomes}
    for module in MODULES:
        if not database_file(ROOT / module, PLACE).exists():
            idle = {line for line in idle if line[0] != module}
            continue
        with session(ROOT / module, PLACE) as of:
            if of.those(None):
                idle = {line for line in idle if line[0] != module}
                continue
            alive = [(mutant, reading(module, mutant, known)) for mutant in of.those(SURVIVED)]
            n_killed, n_equivalent = len(of.those(KILLED)), sum(bool(r and r.equivalent) for _, r in alive)
            rows.append([n_killed + len(alive), n_killed, n_equivalent, len(alive) - n_equivalent, f"`{module}`"])
        for title, equivalent in (("Survived", False), ("Equivalent", True)):
            items: dict[tuple[str, str, str], list[str]] = {}
            for mutant, read in alive:
                if bool(read and read.equivalent) == equivalent:
                    why = read.why if read else "**not read**"
                    items.setdefault((mutant.function, mutant.line, why), []).append(f"`{mutant.becomes}`")
            lines = [f"- {at}: `{line}` as {', '.join(becomes)}: {why}" for (at, line, why), becomes in items.items()]
            lists[title] += ["", f"`{module}`", "", *lines] if lines else []
        unread += sum(read is None for _, read in alive)
        idle -= {(module, mutant.function, mutant.becomes) for mutant, _ in alive}
    rows.append([*(sum(column) for column in list(zip(*rows, strict=True))[:4]), "all"])
    heads = ["module", "mutants", "killed", "equivalent", "survived", "score"]
    cells = [[name, n, killed, same, left, f"{killed / (n - same):.1%}"] for n, killed, same, left, name in rows]
    table = [f"| {' | '.join(map(str, line))} |" for line in [heads, ["---"] * len(heads), *cells]]
    n, killed, same, *_ = rows[-1]
    answer = {"killed": killed, "counted": n - same, "score": killed / (n - same)}
    parts = [ABOUT.format(version=metadata.version("cosmic-ray"), **answer), *table]
    for title, lines in lists.items():
        parts += ["", f"## {title}", *lines]
    PAGE.write_text("\n".join(parts) + "\n")
    print(f"{PAGE.relative_to(ROOT)}: {unread} mutants live and were not read", file=sys.stderr)
    for module, function, line in sorted(idle):
        print(f"{READ.name}, {module}, {function}: no such mutant lives: {line}", file=sys.stderr)
    return int(bool(unread or idle))
