"""What nearly is a way to get away, and is not."""

from __future__ import annotations

from typing import Any

import pytest

from esp_trainer.analysis.behaviours.registry import BEHAVIOURS

CASES = {
    "circling": [
        ("a larger circle", [((50, 51), "S" + "EEENNNWWWSSS" * 2)], ((50, 50), "EEENNNWWWSSS" * 2 + "E"), 1.0),
        ("the other way round", [((50, 49), "N" + "ESWN" * 4)], ((50, 50), "ESWN" * 4 + "E"), 1.0),
        ("too large a circle", [((50, 51), "S" + "E" * 8 + "N" * 8 + "W" * 8 + "S" * 8)],
         ((50, 50), "E" * 8 + "N" * 8 + "W" * 8 + "S" * 8 + "E"), 0.0),
        ("loops of a path that leads away", [((49, 50), "E" + "EEEEEENWS" * 3)], ((50, 50), "EEEEEENWS" * 3), 0.0),
        ("to and fro", [((50, 52), "")], ((50, 50), "EW" * 12), 0.0),
        ("one way, then the other", [((50, 51), "S" + "ENWSESWN")], ((50, 50), "ENWSESWNE"), 0.0),
        ("around a predator that idles", [((48, 48), "")], ((50, 50), "ENWS" * 4), 0.0),
    ],
    "baiting": [
        ("one is no two", [((37, 50), "E" * 12)], ((50, 50), "EW" * 5 + "N" * 10), 0.0),
        ("from the same side", [((37, 50), "E" * 12), ((38, 51), "E" * 12)], ((50, 50), "EW" * 5 + "N" * 10), 0.0),
        ("at a right angle, away from both", [((37, 49), "E" * 12), ((51, 37), "N" * 11)],
         ((50, 50), "EW" * 5 + "NE" * 5), 1.0),
        ("past one of them", [((37, 52), "E" * 10), ((63, 48), "W" * 10)], ((50, 50), "EW" * 5 + "E" * 10), 0.0),
        ("it never waited", [((37, 60), "E" * 12), ((63, 60), "W" * 12)], ((50, 50), "N" * 20), 0.0),
        ("it stays", [((37, 50), "E" * 9), ((63, 50), "W" * 9)], ((50, 50), "EW" * 10), 0.0),
        ("it hardly leaves", [((37, 50), "E" * 9), ((63, 50), "W" * 9)], ((50, 50), "EW" * 5 + "NNNN" + "NS" * 3), 0.0),
        ("it waits for two that stand", [((46, 50), ""), ((54, 50), "")], ((50, 50), "EW" * 5 + "N" * 10), 0.0),
        ("it is caught on the way", [((37, 50), "E" * 12), ((63, 50), "W" * 12), ((50, 57), "")],
         ((50, 50), "EW" * 5 + "N" * 7 + "..."), 0.0),
    ],
    "sidestepping": [
        ("to the south", [((70, 50), "")], ((50, 50), "E" * 15 + "S" + "E" * 10), 1.0),
        ("it turns off", [((70, 50), "")], ((50, 50), "E" * 15 + "N" * 11), 0.0),
        ("it runs straight past", [((70, 51), "")], ((50, 50), "E" * 26), 0.0),
        ("it is caught", [((70, 50), "N")], ((50, 50), "E" * 15 + "N" + "E" * 5 + "." * 5), 0.0),
        ("the predator passes it", [((70, 50), "." * 15 + "W" * 11)], ((50, 50), "E" * 15 + "N" + "EW" * 5), 0.0),
        ("the predator comes along its line", [((85, 50), "W" * 26)], ((50, 50), "E" * 15 + "N" + "E" * 10), 0.0),
    ],
    "reversal": [
        ("a sharp turn", [((50, 66), ""), ((53, 46), "N" * 10)], ((50, 50), "N" * 10 + "S" * 12), 1.0),
        ("only one ahead", [((50, 66), "")], ((50, 50), "N" * 10 + "W" + "S" * 12), 0.0),
        ("only one behind", [((50, 46), "N" * 14)], ((50, 50), "N" * 10 + "W" + "S" * 12), 0.0),
        ("a turn by 90 degrees", [((50, 66), ""), ((50, 46), "N" * 10)], ((50, 50), "N" * 10 + "W" * 12), 0.0),
        ("too long a way round", [((50, 66), ""), ((50, 46), "N" * 10)], ((50, 50), "N" * 10 + "WWW" + "S" * 12), 0.0),
        ("nothing gained", [((50, 68), ""), ((53, 46), "N" * 10 + "S" * 12)], ((50, 50), "N" * 10 + "S" * 12), 0.0),
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "case"), [pytest.param(name, case, id=f"{name}: {case[0]}") for name in CASES for case in CASES[name]]
)
def test_what_is_it_and_what_is_not(name: str, case: Any, scene: Any):
    _, predators, prey, seen = case
    assert BEHAVIOURS[name](scene(predators, [prey]).paths()).tolist() == [seen]
