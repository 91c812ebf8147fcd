"""Attackers, blockers, and what is nearly one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.detection import detected
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.thresholds import Thresholds

T = Thresholds()


def attacks(paths: Paths, x: Thresholds = T) -> np.ndarray:
    """Who attacks whom."""
    return np.asarray(detected(paths, x).episodes.attacks)


def blocks(paths: Paths) -> np.ndarray:
    """Who blocks whom."""
    return np.asarray(detected(paths, T).episodes.blocks)


def first(predator: np.ndarray) -> list[int]:
    """Rows at which the first predator does it to the first prey."""
    return np.flatnonzero(predator[0, :, 0, 0]).tolist()


def test_all_rows_of_a_chase_count(positives: dict[str, Any]):
    assert first(attacks(positives["attacker"].paths())) == list(range(25))


@pytest.mark.parametrize(
    ("case", "predator", "prey", "attack"),
    [
        ("one idle step mends the parity", ((45, 50), "E" * 5 + "." + "E" * 9), ((50, 50), "E" * 15), True),
        ("two are more than a slip", ((46, 50), "E" * 5 + ".." + "E" * 9), ((50, 50), "E" * 16), False),
        ("fourteen steps are too few", ((46, 50), "E" * 14), ((50, 50), "E" * 14), False),
        ("too far behind", ((39, 50), "E" * 20), ((50, 50), "E" * 20), False),
        ("straight past in the next row", ((30, 51), "E" * 18), ((66, 50), "W" * 18), False),
        ("straight at it in its own row", ((30, 50), "E" * 17), ((66, 50), "W" * 17), True),
        ("past it, but it turned into the next row", ((30, 52), "E" * 9 + "S" + "E" * 7), ((66, 50), "W" * 17), True),
        ("straight, always near, to the side", ((47, 53), "E" * 16), ((50, 50), "E" * 16), True),
    ],
)
def test_what_is_a_chase(case: str, predator: Any, prey: Any, attack: bool, scene: Any):
    assert bool(first(attacks(scene([predator], [prey]).paths()))) == attack, case


def test_a_chase_that_ends_with_the_capture_counts_to_the_end(scene: Any):
    paths = scene([((30, 50), "E" * 18)], [((66, 50), "W" * 18)], n_rows=30).paths()
    assert paths.capture_times.tolist() == [[18]]
    assert first(attacks(paths)) == list(range(19))


def test_nobody_attacks_the_caught(scene: Any):
    """The prey is caught in row 2 and the predator circles around where it lies."""
    paths = scene([((48, 50), "E." + "ENWS" * 6)], [((51, 50), "WW"), ((20, 20), "NS" * 13)]).paths()
    assert paths.capture_times[0, 0] == 2
    assert first(attacks(paths)) == []


@pytest.mark.parametrize(
    ("case", "predator", "prey", "block"),
    [
        ("two to the side", ((70, 52), ""), ((50, 50), "E" * 16), True),
        ("three to the side", ((70, 53), ""), ((50, 50), "E" * 16), False),
        ("eleven ahead", ((77, 50), ""), ((50, 50), "E" * 16), False),
        ("behind", ((45, 50), ""), ((50, 50), "E" * 16), False),
        ("on a beat of four cells", ((69, 51), "EEEWWW" * 3), ((50, 50), "E" * 18), True),
        ("on one of five", ((68, 51), "EEEEWWWW" * 2), ((50, 50), "E" * 16), False),
        ("just arrived", ((70, 62), "S" * 12 + "...."), ((50, 50), "E" * 16), False),
        ("the prey dithers", ((56, 50), ""), ((50, 50), "EEEEW" * 4), False),
    ],
)
def test_what_is_a_block(case: str, predator: Any, prey: Any, block: bool, scene: Any):
    assert bool(first(blocks(scene([predator], [prey]).paths()))) == block, case


def test_a_switch_is_seen_when_the_other_role_begins(positives: dict[str, Any]):
    """It blocks until row 16, where the prey turns; from row 15 on its window of a chase may begin."""
    paths = positives["role switch"].paths()
    rows = np.flatnonzero(BEHAVIOURS["role switch"].rows(paths)[0]).tolist()
    assert rows == [first(attacks(paths))[0]]
    assert 14 <= rows[0] <= 16
    assert first(blocks(paths))[0] == 0


def test_an_attacker_that_takes_a_post_switches_too(scene: Any):
    prey = "E" * 16 + "N" * 12 + "W" * 4 + "S" * 12
    paths = scene([((46, 50), "E" * 18)], [((50, 50), prey)]).paths()
    assert BEHAVIOURS["role switch"](paths).tolist() == [1.0]


def test_two_who_come_from_the_same_side_do_not_oppose(scene: Any, positives: dict[str, Any]):
    west = positives["opposing attack"].predators[0]
    beside = ((30, 50), west[1])
    paths = scene([west, beside], [((50, 50), "NS" * 8)]).paths()
    assert first(attacks(paths))
    assert BEHAVIOURS["opposing attack"](paths).tolist() == [0.0]


@pytest.mark.parametrize(
    ("case", "third", "surrounded"),
    [
        ("from the south", ((50, 34), "N" * 14), 1.0),
        ("from the north: none in the south", ((50, 68), "S" * 14), 0.0),
        ("not near", ((50, 24), "N" * 14), 0.0),
    ],
)
def test_three_surround_where_no_half_plane_is_free(
    case: str, third: Any, surrounded: float, scene: Any, positives: dict[str, Any]
):
    others = positives["encirclement"].predators[:2]
    paths = scene([*others, third], [((50, 50), "NS" * 7)]).paths()
    assert BEHAVIOURS["encirclement"](paths).tolist() == [surrounded], case


def test_three_who_stand_around_do_not_close_in(scene: Any):
    around = [((45, 52), ""), ((55, 52), ""), ((50, 46), "")]
    paths = scene(around, [((50, 50), "NS" * 10)]).paths()
    assert BEHAVIOURS["encirclement"](paths).tolist() == [0.0]


def test_narrower_thresholds_find_less(wander: Callable[..., np.ndarray]):
    paths = Paths.of_trace(wander(100, 1, straight=True), 3, 100)
    wide, narrow = (attacks(paths, Thresholds(near=near)) for near in (20, 5))
    assert (wide | ~narrow).all()
    assert wide.sum() > narrow.sum()
