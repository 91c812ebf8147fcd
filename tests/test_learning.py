"""The page of learning curves: its figures are those of the runs that are kept."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from learning import page  # noqa: E402
from learning.runs import PLAN, small  # noqa: E402

STEPPE = [
    [[0, 0.0, 0.0, 0.0, 0.1], [1_000_000, 10.0, 0.4, 0.3, 0.5], [2_000_000, 22.0, 0.8, 0.5, 0.7]],
    [[0, 0.0, 0.0, 0.0, 0.1], [2_000_000, 20.0, 0.6, 0.3, 0.9]],
]


def test_the_page_is_what_the_kept_runs_give(tmp_path: Path) -> None:
    kept = json.loads((ROOT / "docs/learning/curves.json").read_text())
    assert set(kept) == set(PLAN)
    page.write(page.by_kind(kept), tmp_path)
    assert (tmp_path / "learning.md").read_text() == (ROOT / "docs/learning.md").read_text()


def test_a_fraction_has_an_interval_between_0_and_1() -> None:
    assert page.fraction([0.25, 0.5]) == "0.375"
    # Student's, with two degrees of freedom: 0.4 -+ 4.303 * 0.1 / sqrt(3); and one that would pass 1.
    assert page.fraction([0.3, 0.4, 0.5]) == "0.400 [0.152, 0.648]"
    assert page.fraction([0.8, 0.9, 1.0]) == "0.900 [0.652, 1.000]"


def test_a_level_is_reached_at_the_first_point_that_has_it() -> None:
    assert page.first(STEPPE[0], 0.4, page.AT_STEPS) == 1_000_000
    assert page.first(STEPPE[0], 0.5, page.AT_SECONDS) == 22.0
    assert page.first(STEPPE[1], 0.7, page.AT_STEPS) == np.inf


def test_a_row_tells_means_over_seeds() -> None:
    beside = {"standing, steppe, intercept": [[[0, 0.0, 0.3, 0.3, 0.4]]]}
    rows = page.long({"long, steppe, predators": STEPPE, **beside}).splitlines()
    assert rows[2:] == [
        "| steppe, predators | PPO | 2 | 2.0 M | 21 | 0.700 | 0.800 |",
        "| steppe, predators | `intercept` | - | - | - | 0.300 | 0.400 |",
    ]


def test_the_quick_form_has_some_run_of_every_kind() -> None:
    def kinds(names: object) -> set[str]:
        return {str(name).split(",")[0] for name in names}  # type: ignore[attr-defined]

    assert kinds(small()) == kinds(PLAN) - {"meadow", "steppe"}
