"""Measure how fast PPO learns each task, the effect of its options, and the cost of evolution; write docs/learning.md.

    nice python scripts/learning_curves.py            # some 70 CPU-minutes; runs that are kept are not made again
    python scripts/learning_curves.py --only long     # only the runs whose name begins so, and the page
    python scripts/learning_curves.py --report        # only the page and the figures, from docs/learning/curves.json
    python scripts/learning_curves.py --quick         # small runs that mean nothing, into runs/learning-quick

The learner is that of examples/ppo_one_team.py. Needs PyTorch.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # workers of the pools import it too

from learning import page
from learning.runs import PLAN, small
from study import StudyParser

from esp_trainer.files import write_text
from esp_trainer.jobs import in_processes


def main() -> None:
    """Make the runs that are not kept, keep them, and write the page."""
    parser = StudyParser(__doc__, "runs/learning", "runs/learning-quick")
    parser.add_argument("--only", default="", help="only runs whose name begins so")
    options = parser.read()
    kept, planned = options.out / "learning" / "curves.json", small() if options.quick else PLAN
    curves = json.loads(kept.read_text()) if kept.exists() else {}
    if not options.report:
        files = {name: options.runs / f"{name}.json" for name in planned if name not in curves}
        files = {name: file for name, file in files.items() if name.startswith(options.only)}
        for work in dict.fromkeys(function for function, _ in planned.values()):
            todo = [name for name, file in files.items() if planned[name][0] is work and not file.exists()]
            in_processes(work, [(files[name], planned[name][1]) for name in todo], options.workers, work.__name__)
        curves |= {name: json.loads(file.read_text()) for name, file in files.items()}
        kept.parent.mkdir(parents=True, exist_ok=True)
        curves = {name: curves[name] for name in planned if name in curves}
        write_text(kept, json.dumps(curves))
    page.write(page.by_kind(curves), options.out)


if __name__ == "__main__":
    main()
