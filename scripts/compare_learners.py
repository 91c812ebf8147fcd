"""PPO, evolution and scripts against each other, from nothing to ``docs/benchmark.md``.

Trains PPO (``train_ppo.py``) for each side against the zoo, with dense and with terminal rewards, and against itself;
evolves the presets ``paper`` and ``modern`` as long as usual and longer, and fresh teams against frozen PPO; then lets
all predators meet all prey. Everything with several seeds. It can be stopped and started again: what is finished is not
done again. The teams of the first seed of each kind are kept beside the page. Needs PyTorch; an hour on two cores.

    python scripts/compare_learners.py
    python scripts/compare_learners.py --report  # only the page again, from the matrix that is kept
    python scripts/compare_learners.py --quick   # small and meaningless, to see that it works, into runs/quick
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # workers of the pools import it too

from learners import report
from learners.contestants import CONTESTANTS, small
from learners.curves import Curves, draw, gather
from learners.matrix import Matrix, play
from learners.train import publish, train
from study import StudyParser


def main() -> None:
    """Do what is still to do."""
    parser = StudyParser(__doc__, "runs/learners", "runs/quick")
    options = parser.read()
    runs, out = options.runs, options.out
    kept = out / "benchmark" / "matrix.npz"
    if not options.report:
        contestants = [small(each) for each in CONTESTANTS] if options.quick else CONTESTANTS
        train(contestants, runs, options.workers)
        publish(contestants, runs, out / "benchmark" / "teams")
        play(contestants, runs, n_episodes=16 if options.quick else 512).save(kept)
        gather(contestants, runs).save(kept.with_name("curves.npz"))
    elif not kept.exists():
        parser.error(f"there is nothing to report on: {kept} is not there")
    draw(Curves.load(kept.with_name("curves.npz")), kept.with_name("curves.png"))
    print(report.write(Matrix.load(kept), out))


if __name__ == "__main__":
    main()
