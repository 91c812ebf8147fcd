"""Optimal play on small tori, and how far everybody is from it: ``docs/optimal_play.md``.

    python scripts/optimal_play.py [--quick] [--seeds N] [--jobs N]

Some half an hour on two cores; ``--quick`` only shows that it works, and writes nothing.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from optimal import learners, play, values
from optimal.page import page


def main() -> None:
    """Measure, draw, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small, to see that it works; writes nothing")
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="of each preset")
    parser.add_argument("--out", type=Path, default=Path("docs/optimal_play.md"))
    options = parser.parse_args()
    quick = options.quick
    known = values.confirm(values.KNOWN[:2] if quick else values.KNOWN)
    sizes = values.by_size((4, 5) if quick else (4, 5, 6, 7, 8, 9, 10, 11, 12))
    habits = play.watch(size=4 if quick else 8, n_episodes=20 if quick else 2000)
    races = learners.measure(
        size=4 if quick else 6, seeds=2 if quick else options.seeds, generations=4 if quick else 450
    )
    if quick:
        print(page(known, sizes, habits, races))
        return
    pictures = options.out.with_suffix("")
    pictures.mkdir(parents=True, exist_ok=True)
    learners.draw(races, pictures / "exploitability.png")
    options.out.write_text(page(known, sizes, habits, races), encoding="utf-8")
    print(options.out.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
