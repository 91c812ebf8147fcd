"""The chart of a champion's ancestry, with values worked out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.genealogy import Leading
from esp_trainer.report import ancestry


def leading(*neurons: list[int], share: float = 0.75, from_past: float = 0.5) -> Leading:
    """Neurons of which these are the leading founders by generation."""
    founder = np.array(neurons).T
    return Leading(founder, np.full(founder.shape, share), np.full(founder.shape, from_past))


def test_the_founders_that_lead_longest_have_colours() -> None:
    eight = [9, 5, 5, 8, 8, 1, 1, 1, 7, 7, 0, 0, 4, 4, 3]  # eight founders: 1 leads longest, 9 and 3 once
    assert ancestry.colours(leading(eight, [2] * 15).founder).T.tolist() == [
        [0, 2, 2, 3, 3, 1, 1, 1, 4, 4, 5, 5, 6, 6, 0],
        [1] * 15,
    ]


def test_the_caption_counts_the_founders_that_stay() -> None:
    # Changes in generations 1 and 5 of the first neuron, in 2 of the second, in 4 of the third.
    three = leading([2, 1, 1, 1, 1, 2], [0, 0, 4, 4, 4, 4], [3, 3, 3, 3, 1, 1])
    assert three.takeovers().sum() == 4
    assert ancestry.caption(three).endswith(
        "2 of 3 neurons kept theirs from generation 4 on; the last takeover is in generation 5."
    )
    assert ancestry.caption(leading([3, 3, 3])).endswith(": 1 of 1 neuron kept theirs from generation 2 on.")
    assert ancestry.caption(leading([3])).endswith(": 1 of 1 neuron kept theirs from generation 0 on.")


def test_a_cell_says_its_founder_its_share_and_what_came_through_a_past_champion() -> None:
    heat: Any = ancestry._heat_map(leading([2, 1, 1], [0, 0, 4]))
    assert (heat["x"], heat["y"]) == ([0, 1, 2], [0, 1])
    assert heat["z"] == [[2, 1, 1], [1, 1, 2]]
    assert heat["customdata"] == [[[2, 75, 50], [1, 75, 50], [1, 75, 50]], [[0, 75, 50], [0, 75, 50], [4, 75, 50]]]
    assert heat["colorscale"][:3] == [[0, "@line"], [pytest.approx(1 / 7), "@line"], [pytest.approx(1 / 7), "@0"]]
    assert heat["colorscale"][-1] == [1, "@5"]


def test_of_many_generations_some_are_drawn_and_all_are_counted() -> None:
    founders = [generation % 2 for generation in range(1000)]
    heat: Any = ancestry._heat_map(leading(founders))
    assert len(heat["x"]) == ancestry.COLUMNS
    assert (heat["x"][0], heat["x"][-1]) == (0, 999)
    assert "the last takeover is in generation 999." in ancestry.caption(leading(founders))
