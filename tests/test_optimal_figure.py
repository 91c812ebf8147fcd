"""The figure of optimal play: what it reads from the tables of its page."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from optimal_figure import LEARNER, PAGE, draw, numbers, tables  # noqa: E402


def test_a_cell_is_a_figure_and_its_interval() -> None:
    assert numbers("0.827 [0.792, 0.862]") == [0.827, 0.792, 0.862]
    assert numbers("within 2") == [2]


def test_tables_are_found_by_their_first_heads() -> None:
    text = "| a | b |\n| --- | ---: |\n| `x`, y | 0.5 |\n\nprose\n\n| c |\n| --- |\n| 1 |\n"
    assert tables(text) == {"a": [["a", "b"], ["x, y", "0.5"]], "c": [["c"], ["1"]]}


def test_the_page_has_what_the_figure_needs(tmp_path: Path) -> None:
    page = (ROOT / PAGE).read_text()
    assert sum(head.startswith(LEARNER) for head in tables(page)) == 6
    draw(page, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")
