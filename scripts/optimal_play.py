"""Optimal play on small tori, and how far everybody is from it: ``docs/optimal_play.md``.

    python scripts/optimal_play.py [--quick] [--seeds N] [--work DIR]

Some two hours on two cores. What is found in ``--work`` is not measured again. Needs PyTorch and TensorBoard for PPO;
``--quick`` only shows that it works, without PPO, and writes nothing but there.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from optimal import figures, play
from optimal.learners import LEARNERS, measure
from optimal.page import GAMES, page
from optimal.values import KNOWN, SIZES, TEAMS, by_size, values


def main() -> None:
    """Measure, draw, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small, to see that it works; writes nothing to --out")
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="of each learner")
    parser.add_argument("--work", type=Path, default=Path("runs/optimal-play"), help="where what is measured is kept")
    parser.add_argument("--out", type=Path, default=Path("docs/optimal_play.md"))
    options = parser.parse_args()
    if options.quick:
        with tempfile.TemporaryDirectory() as place:
            print(_quick(Path(place)))
        return
    work, pictures = options.work, options.out.with_suffix("")
    pictures.mkdir(parents=True, exist_ok=True)
    tori = measure(LEARNERS, options.seeds, 450, work)
    figures.exploitability(tori[0], pictures / "exploitability.png")
    play.animate(8, GAMES, pictures)
    seen = (12, 400, play.behaviours(12, 400))
    text = page(values(KNOWN, work), values(TEAMS, work), by_size(SIZES, work), play.watch(8, 2000), seen, tori)
    options.out.write_text(text, encoding="utf-8")
    print(text)


def _quick(place: Path) -> str:
    small = [learner._replace(size=4, looks=2) for learner in LEARNERS[:4]]
    tori = measure(small, 2, 4, place)
    figures.exploitability(tori[0], place / "exploitability.png")
    play.animate(4, GAMES[:1], place)
    seen = (4, 20, play.behaviours(4, 20))
    teams = [game for game in TEAMS if game.size == 4]
    return page(values(KNOWN[:2], place), values(teams, place), by_size((4, 5), place), play.watch(4, 20), seen, tori)


if __name__ == "__main__":
    main()
