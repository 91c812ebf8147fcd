"""Policies that are asked about rows, with stand-ins for the libraries; tests/ecosystem has the real ones."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete

from esp_trainer.benchmark.batched import BatchedPolicy, SB3Policy, TorchPolicy, WeighingPolicy
from predprey_env import EnvConfig
from predprey_env.policies import Policy

SHAPE = EnvConfig().team("predators")


class Sums(BatchedPolicy):
    def choose(self, rows: np.ndarray) -> np.ndarray:
        return rows.sum(axis=1).astype(int) % 5


class Model:
    """What Stable-Baselines3's models have, and a note of how it was asked."""

    def __init__(self, n_seen: int = 4, n_actions: int = 5) -> None:
        self.observation_space = Box(-50, 49, (n_seen,))
        self.action_space: Any = Discrete(n_actions)
        self.asked: list[Any] = []

    def set_random_seed(self, seed: int | None) -> None:
        self.asked.append(seed)

    def predict(self, rows: np.ndarray, deterministic: bool) -> tuple[np.ndarray, None]:
        self.asked.append(deterministic)
        return rows[:, 0].astype(int), None


def test_one_by_one_and_all_at_once_are_the_same():
    policy, seen = Sums(), np.random.default_rng(0).integers(0, 50, (6, 3, 4)).astype(np.float32)
    all_at_once = policy.act_batch(seen)
    assert all_at_once.shape == (6, 3)
    for world, actions in zip(seen, all_at_once, strict=True):
        chosen = policy.act({f"predator_{i}": row for i, row in enumerate(world)})
        assert chosen == {f"predator_{i}": action for i, action in enumerate(actions.tolist())}
        assert all(type(action) is int for action in chosen.values())
    assert policy.act({}) == {}


def test_it_is_a_policy_for_the_environments():
    assert isinstance(Sums(), Policy)


@pytest.mark.parametrize("drawn", [False, True])
def test_a_model_is_asked_for_likely_actions_or_for_drawn_ones(drawn: bool):
    model = Model()
    policy = SB3Policy(model, SHAPE, drawn=drawn)
    policy.reset(7)
    assert policy.act_batch(np.full((2, 3, 4), 3, np.float32)).tolist() == [[3] * 3] * 2
    assert model.asked == ([7, False] if drawn else [True])


@pytest.mark.parametrize("model", [Model(n_seen=6), Model(n_actions=4), Model(n_seen=2)])
def test_a_model_with_other_spaces_is_refused(model: Model):
    expected = (
        f"the model must observe 4 numbers and have 5 actions, got {model.observation_space} and {model.action_space}"
    )
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        SB3Policy(model, SHAPE)
    assert str(refused.value) == expected


def test_a_model_whose_actions_are_not_discrete_is_refused():
    model = Model()
    model.action_space = SimpleNamespace(shape=(2,))
    with pytest.raises(ValueError, match=r"^the model must observe 4 numbers and have 5 actions"):
        SB3Policy(model, SHAPE)


@pytest.mark.parametrize("drawn", [False, True])
def test_a_model_answers_one_by_one_as_all_at_once(drawn: bool):
    policy, seen = SB3Policy(Model(), SHAPE, drawn=drawn), np.random.default_rng(1).integers(0, 5, (6, 3, 4))
    all_at_once = policy.act_batch(seen.astype(np.float32))
    assert all_at_once.tolist() == seen[..., 0].tolist()
    for world, actions in zip(seen.astype(np.float32), all_at_once.tolist(), strict=True):
        assert list(policy.act({f"predator_{i}": row for i, row in enumerate(world)}).values()) == actions


class Module:
    """What PyTorch's modules have before they are asked."""

    training = True

    def eval(self) -> Module:
        self.training = False
        return self


def test_a_module_is_set_to_play_and_is_not_random_unless_drawn(monkeypatch: pytest.MonkeyPatch):
    """Or layers that are random in training, such as dropout, would be here too."""
    monkeypatch.setitem(sys.modules, "torch", None)
    module = Module()
    policy = TorchPolicy(module, SHAPE)
    assert not module.training
    policy.reset(3)  # needs no library


def test_what_a_module_draws_follows_from_the_seed(monkeypatch: pytest.MonkeyPatch):
    seeds: list[int] = []
    monkeypatch.setitem(sys.modules, "torch", SimpleNamespace(manual_seed=seeds.append))
    policy = TorchPolicy(Module(), SHAPE, drawn=True)
    policy.reset(3)
    policy.reset()
    assert seeds == [3]


class Weighs(WeighingPolicy):
    def choose(self, rows: np.ndarray) -> np.ndarray:
        return rows[:, 0].astype(int)

    def weigh(self, rows: np.ndarray) -> np.ndarray:
        return np.eye(5, dtype=np.float32)[rows[:, 1].astype(int)]


def test_chances_are_those_it_draws_with():
    seen = np.random.default_rng(2).integers(0, 5, (6, 3, 4)).astype(np.float32)
    chances = Weighs(SHAPE, drawn=True).chances_batch(seen)
    assert chances.dtype == np.float64
    assert (chances == np.eye(5)[seen[..., 1].astype(int)]).all()


def test_a_model_without_chances_cannot_be_measured_when_it_draws():
    model = Model()
    model.policy = SimpleNamespace()  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match="Model does not give the probabilities of its actions"):
        SB3Policy(model, SHAPE, drawn=True).chances_batch(np.zeros((1, 3, 4), np.float32))


class Chances(BatchedPolicy):
    """Returns a number for each action, not an action."""

    def choose(self, rows: np.ndarray) -> np.ndarray:
        return np.zeros((len(rows), 4))


def test_actions_of_another_shape_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^choose\(\) must return 6 actions, got shape \(6, 4\)$"):
        Chances().act_batch(np.zeros((3, 2, 4), np.float32))
