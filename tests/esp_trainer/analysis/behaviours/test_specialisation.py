"""Roles that stay with a predator, and roles that do not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer.analysis.behaviours.specialisation import ATTACKER, BLOCKER, NEITHER, main_roles, specialisation
from esp_trainer.analysis.behaviours.thresholds import Thresholds

A, B, O = ATTACKER, BLOCKER, NEITHER  # noqa: E741


def test_the_main_role_is_the_one_of_more_rows(scene: Any):
    attack, block = ((46, 50), "E" * 16), ((70, 50), "")
    paths = scene([attack, block], [((50, 50), "E" * 16)]).paths()
    assert main_roles(paths, Thresholds()).tolist() == [[ATTACKER, BLOCKER, NEITHER]]


def test_one_that_switches_has_the_role_that_it_has_longer(scene: Any):
    moves, run = "." * 16 + "WN" * 6 + "N" * 18, "E" * 16 + "N" * 30
    paths = scene([((72, 50), moves)], [((50, 50), run)]).paths()
    assert main_roles(paths, Thresholds())[0, 0] == ATTACKER


@pytest.mark.parametrize(
    ("roles", "value"),
    [
        ([[A, A, B]] * 5, 1.0),
        ([[A, B, O]] * 5, 1.0),
        ([[A, A, B], [A, B, A], [B, A, A]], 0.0),
        ([[A, B, O], [B, A, O]], 0.0),
        # By hand: of 4 attackers and 4 blockers, H = ln 2; one predator is 3 : 1 and the other 1 : 3, and each has
        # H = 0.75 ln(4/3) + 0.25 ln 4 = 0.5623.
        ([[A, B], [A, B], [A, B], [B, A]], 1 - 0.5623351446 / np.log(2)),
    ],
)
def test_values_by_hand(roles: list[list[int]], value: float):
    assert specialisation(np.array(roles)) == pytest.approx(value, abs=1e-9)


@pytest.mark.parametrize("roles", [[[A, A, A]] * 3, [[O, O, O]] * 3, [[A, O, O], [O, A, O]]])
def test_where_all_have_the_same_role_it_cannot_be_asked(roles: list[list[int]]):
    assert np.isnan(specialisation(np.array(roles)))
