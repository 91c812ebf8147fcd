"""The figure of optimal play: what it reads from the tables of its page."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from optimal_figure import LEARNER, PAGE, POLICY, draw, numbers  # noqa: E402


def test_a_cell_is_a_number_and_its_interval() -> None:
    assert numbers("0.827 [0.792, 0.862] | 0.5 [0.4, 0.6]").tolist() == [[0.827, 0.792, 0.862], [0.5, 0.4, 0.6]]
    assert numbers("within 2 | within 10").tolist() == [[2], [10]]


def test_learners_and_policies_are_found_in_their_tables() -> None:
    page = "| 6 x 6, 5 | 0.8 |\n\n| 6 x 6, x, y | 0 | 64 |\n| --- | ---: |\n| within 2 (optimal) | 0.9 | 0.7 |\n\n"
    assert LEARNER.findall(page) == [("x, y", "0 | 64", "0.9 | 0.7")]
    page = "| policy | within 2 |\n| --- | ---: |\n| predators, x | 0.1 |\n| prey, x, y | 0.5 | 0.9 |\n"
    assert POLICY.findall(page) == [("policy", "within 2"), ("prey, x, y", "0.5 | 0.9")]


def test_the_page_has_what_the_figure_needs(tmp_path: Path) -> None:
    page = (ROOT / PAGE).read_text()
    assert len(LEARNER.findall(page)) == 6
    draw(page, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")
