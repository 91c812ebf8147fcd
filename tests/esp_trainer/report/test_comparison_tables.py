"""The answer of a comparison, from differences made up by hand."""

from __future__ import annotations

import pytest

from esp_trainer.analysis.comparison import Condition, Contrast
from esp_trainer.analysis.inference import Comparison
from esp_trainer.report.comparison_tables import answer

BASELINE = Condition("old", [])


def contrast(condition: str, measure: str, difference: float, p: float | None) -> Contrast:
    comparison = None if p is None else Comparison(difference, difference - 0.1, difference + 0.1, 0.5, p / 2)
    return Contrast(condition, measure, difference, comparison, p)


@pytest.mark.parametrize(
    ("found", "told"),
    [
        ([], ""),
        (
            [contrast("race", "prey_held_out_level", 0.3, None)],
            "No verdict: a test takes at least 3 seeds of each condition.",
        ),
        ([contrast("race", "prey_held_out_level", 0.3, 0.05)], "No difference from old is significant."),
        (
            [
                contrast("a", "prey_scripts_level", 0.312, 0.049),
                contrast("race", "predators_scripts_level", -0.2, 0.5),
                contrast("b", "prey_held_out_level", -0.204, 0.001),
                contrast("few", "prey_held_out_level", 0.9, None),
            ],
            "Significant differences from old: a in prey, level, scripts (+0.31); b in prey, level, held-out (-0.20).",
        ),
    ],
)
def test_the_answer_names_every_significant_difference(found: list[Contrast], told: str) -> None:
    assert answer(found, BASELINE) == told
