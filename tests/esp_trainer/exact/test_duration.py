"""How long it will take, by a sample of positions whose time is made up."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from esp_trainer.exact import duration
from esp_trainer.exact.chances import chances
from esp_trainer.exact.duration import sample_of, seconds_to_answer, seconds_to_solve
from esp_trainer.types import ScriptedTeams
from predprey_env import EnvConfig


@pytest.fixture(autouse=True)
def _a_second_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """Any part of a turn takes a second, on two cores."""
    monkeypatch.setattr(duration, "_timed", lambda work, *arguments: (work(*arguments), 1.0)[1])
    monkeypatch.setattr(duration, "cores", lambda: 2)
    monkeypatch.setattr(duration, "_SAMPLE", 10)


@pytest.mark.parametrize(("order", "n_turns"), [("simultaneous", 1), ("prey_first", 2)])
def test_it_grows_with_positions_steps_and_turns(order: str, n_turns: int) -> None:
    config = EnvConfig(size=4, n_prey=1, move_order=order)  # 124 states for 4096 keys; 10 of them take a second a turn
    assert seconds_to_solve(config, 7) == pytest.approx(12.4 * 7 * n_turns / 2)
    fixed = chances(ScriptedTeams("random"), "prey", config)
    assert seconds_to_answer(fixed, "prey", config, 7) == pytest.approx(409.6 * 7 * n_turns / 2)


def test_several_prey_are_answered_too() -> None:
    config = EnvConfig(size=3, n_predators=1, n_prey=2)  # 9 keys of either prey alone, 81 of both
    fixed = chances(ScriptedTeams("random"), "predators", config)
    assert fixed.shape[0] == 99
    assert seconds_to_answer(fixed, "predators", config, 1) == pytest.approx(9.9 / 2)
    assert np.isfinite(seconds_to_solve(config, 1))


class Goer:
    """Goes east, and counts in how many positions it was asked."""

    n_asked = 0

    def reset(self, seed: int | None = None) -> None:
        pass

    def act(self, observations: dict[str, np.ndarray]) -> dict[str, int]:
        self.n_asked += 1
        return dict.fromkeys(observations, 0)


def taking(seconds: Callable[[int], float]) -> Callable[..., float]:
    """A clock by which a policy takes a time that follows from the number of positions."""

    def timed(work: Callable[..., Any], *arguments: Any) -> float:
        work(*arguments)
        return seconds(len(arguments[1]))

    return timed


def test_a_policy_that_takes_a_second_a_position_is_asked_in_few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(duration, "_timed", taking(float))
    policy = Goer()
    sample, seconds = sample_of(policy, "prey", EnvConfig(size=4, n_prey=1))
    assert (sample.tolist(), seconds) == ([[[1, 0, 0, 0]]] * 2, 4096)
    assert policy.n_asked == 1 + 2 + 2, "to be timed, twice, and for its answer"


def test_a_policy_that_answers_many_positions_in_the_time_of_one_is_not_taken_for_slow(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(duration, "_timed", taking(lambda n: 0.4 + 0.01 * n))
    sample, seconds = sample_of(Goer(), "prey", EnvConfig(size=4, n_prey=1))
    assert len(sample) == 10
    assert seconds == pytest.approx(0.5 * 409.6), "0.41 s for one position alone would make 1,679 s"


def test_a_quick_policy_is_asked_in_a_whole_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(duration, "_timed", taking(lambda n: 0.001 * n))
    sample, seconds = sample_of(Goer(), "prey", EnvConfig(size=4, n_prey=1))
    assert len(sample) == 10
    assert seconds == pytest.approx(4.096)
