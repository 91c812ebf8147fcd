"""What is measured of a run, against whom, and what the seeds say of a difference."""

from __future__ import annotations

import numpy as np
import pytest

from esp_trainer.analysis import comparison
from esp_trainer.analysis.comparison import (
    HELD_OUT,
    SCRIPTED,
    Condition,
    MeasuredRun,
    caught_by_each,
    contrasts,
    held_out_opponents,
    measure_history,
    measures,
    script_panel,
)
from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.history import History
from esp_trainer.analysis.inference import compare
from esp_trainer.analysis.late_panel import meet_late
from esp_trainer.coevolution.sides import side_controller
from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.types import ROLES, EvolvedTeams, Role
from predprey_env import EnvConfig
from predprey_env.policies import SCRIPTS

ENV = EnvConfig(size=8, max_cycles=16)
N = 12


def random_history(n: int = N, prey: str = "esp", seed: int = 0) -> History:
    """Champions that nobody evolved, and a success of 0, 1 / n, 2 / n and so on."""
    config = RunConfig(env=ENV, seed=seed, predators=SideConfig(n_hidden=3), prey=SideConfig(n_hidden=3, policy=prey))  # type: ignore[arg-type]
    generator = np.random.default_rng(seed)
    champions: dict[Role, np.ndarray] = {}
    for role in ROLES if prey == "esp" else ROLES[:1]:
        shape = (n, ENV.team(role).n_agents, *side_controller(config, role).shape)
        champions[role] = generator.uniform(-6, 6, shape).astype(np.float32)
    return History(config, champions, {"caught": np.arange(n) / n})


@pytest.fixture(scope="module")
def evaluator() -> FusedEvaluator:
    return FusedEvaluator(ENV, threads=1)


def test_levels_and_progress_by_hand(evaluator: FusedEvaluator, monkeypatch: pytest.MonkeyPatch) -> None:
    # Generation g catches g / 12 of one opponent's prey and nothing of the other's, in either role.
    caught = np.column_stack([np.arange(N) / N, np.zeros(N)])
    monkeypatch.setattr(comparison, "caught_by_each", lambda *_, **__: caught)
    found = measure_history(random_history(), {SCRIPTED: script_panel()}, evaluator)
    assert found.generations.tolist() == list(range(N))
    assert found.curves["predators_scripts"] == pytest.approx(np.arange(N) / 24)
    assert found.curves["prey_scripts"] == pytest.approx(1 - np.arange(N) / 24)
    # The last sixth are generations 10 and 11, the first 0 and 1; of the second half, 11 and 6.
    assert found.values["predators_scripts_level"] == pytest.approx(10.5 / 24)
    assert found.values["predators_scripts_progress"] == pytest.approx(10 / 24)
    assert found.values["predators_scripts_late_progress"] == pytest.approx(5 / 24)
    assert found.values["prey_scripts_level"] == pytest.approx(1 - 10.5 / 24)
    assert found.values["prey_scripts_progress"] == pytest.approx(-10 / 24)
    assert found.values["prey_scripts_late_progress"] == pytest.approx(-5 / 24)
    assert found.values["caught"] == pytest.approx((8 + 9 + 10 + 11) / 4 / N)
    unknown = {name for name, value in found.values.items() if np.isnan(value)}
    assert unknown == {name for name in measures() if HELD_OUT in name or "signal" in name}


def test_generations_are_spread_evenly(evaluator: FusedEvaluator) -> None:
    found = measure_history(random_history(), {SCRIPTED: script_panel()}, evaluator, n_generations=3, n_episodes=8)
    assert found.generations.tolist() == [0, 6, 11]
    assert len(found.curves["prey_scripts"]) == 3
    with pytest.raises(ValueError, match=r"^progress takes at least 3 generations, got 2$"):
        measure_history(random_history(2), {SCRIPTED: script_panel()}, evaluator)


def test_a_side_that_follows_a_script_has_no_measures(evaluator: FusedEvaluator) -> None:
    found = measure_history(
        random_history(prey="flee_nearest"), {SCRIPTED: script_panel()}, evaluator, n_generations=3, n_episodes=8
    )
    assert set(found.curves) == {"predators_scripts"}
    assert all(np.isnan(value) for name, value in found.values.items() if name.startswith("prey"))


def test_a_side_that_nobody_plays_against_has_no_measures(evaluator: FusedEvaluator) -> None:
    others = held_out_opponents(ENV, [random_history(prey="flee_nearest", seed=1)])  # it has no prey to meet
    found = measure_history(random_history(), {HELD_OUT: others}, evaluator, n_generations=3, n_episodes=8)
    assert set(found.curves) == {"prey_held_out"}


def test_every_column_is_a_cross_play(evaluator: FusedEvaluator) -> None:
    history, generations = random_history(), np.array([0, 5, 11])
    for role, other in (ROLES, ROLES[::-1]):
        mine, theirs = (
            history.entrants(role, generations),
            [*script_panel()[other], history.entrants(other, generations)],
        )
        found = caught_by_each(role, mine, theirs, evaluator, n_episodes=8)
        played = [
            cross_play(mine, each, evaluator, n_episodes=8).caught
            if role == "predators"
            else cross_play(each, mine, evaluator, n_episodes=8).caught.T
            for each in theirs
        ]
        assert found.tolist() == np.hstack(played).tolist()
        assert found.shape == (3, len(SCRIPTS[other]) + 3)


def test_the_zoo_is_held_out_in_its_own_worlds() -> None:
    for env in (EnvConfig(), EnvConfig(prey_fitness="complementary", reward="dense")):
        assert {role: len(teams) for role, teams in held_out_opponents(env).items()} == {"predators": 36, "prey": 36}
        older = held_out_opponents(env, older_only=True)
        assert {role: len(teams) for role, teams in older.items()} == {"predators": 27, "prey": 27}
    assert held_out_opponents(ENV) == {"predators": [], "prey": []}


def test_a_held_out_run_sends_six_champions_of_each_side() -> None:
    run = random_history()
    found = held_out_opponents(ENV, [run])
    for role in ROLES:
        (teams,) = found[role]
        assert isinstance(teams, EvolvedTeams)
        expected = run.entrants(role, np.array([0, 2, 4, 7, 9, 11]))
        assert isinstance(expected, EvolvedTeams)
        assert np.array_equal(teams.genomes, expected.genomes)


def test_runs_meet_the_late_champions_of_the_others_and_not_their_own(evaluator: FusedEvaluator) -> None:
    runs = [random_history(seed=seed) for seed in range(3)]
    found = meet_late(runs, evaluator, n_generations=4)
    for role, other in (("predators", "prey"), ("prey", "predators")):
        assert found[role].shape == (3, 4, 3)
        assert np.isnan(found[role]).tolist() == [[[i == j for j in range(3)]] * 4 for i in range(3)]
        mine = runs[1].entrants(role, np.array([0, 4, 7, 11]))
        caught = caught_by_each(role, mine, [runs[2].entrants(other, np.array([10, 10, 11]))], evaluator).mean(axis=1)
        assert found[role][1, :, 2] == pytest.approx(caught if role == "predators" else 1 - caught)


def condition(name: str, **values: list[float]) -> Condition:
    seeds = [dict(zip(values, each, strict=True)) for each in zip(*values.values(), strict=True)]
    return Condition(name, [MeasuredRun(np.arange(3), {}, np.zeros(3), seed) for seed in seeds])


def test_differences_are_corrected_over_all_that_are_told() -> None:
    base = condition("base", x=[1, 2, 3, 4], y=[1, 2, 3, 4])
    other = condition("other", x=[5, 6, 7, 8], y=[1.5, 2.5, 3.5, 0.5])
    third = condition("third", x=[0.1, 0.2, 0.3, 0.4], y=[1.2, 2.2, 3.2, 4.2])
    found = contrasts([base, other, third], base, ["x", "y"])
    assert [(each.condition, each.measure) for each in found] == [
        ("other", "x"),
        ("other", "y"),
        ("third", "x"),
        ("third", "y"),
    ]
    assert found[0].comparison == compare([5, 6, 7, 8], [1, 2, 3, 4])
    assert (found[0].difference, found[0].comparison.effect) == (4, 1)
    # All of four above, or below, all of four: 2 of 70 orders. Holm takes the least p of four tests four times, and no
    # later one less.
    assert found[0].p == pytest.approx(4 * 2 / 70)
    assert found[2].p == pytest.approx(4 * 2 / 70)
    assert found[1].p == found[3].p == 1


def test_of_few_seeds_there_is_only_the_difference_of_the_means() -> None:
    base, other = condition("base", x=[1, 2, 3, 4]), condition("other", x=[5.0, 6.0])
    (found,) = contrasts([base, other], base, ["x"])
    assert found == comparison.Contrast("other", "x", 3.0, None, None)


def test_what_is_not_known_is_left_out() -> None:
    nan = float("nan")
    base, other = condition("base", x=[nan, 2, 3, 4], y=[nan] * 4), condition("other", x=[5, 6, 7], y=[1, 2, 3])
    (found,) = contrasts([base, other], base, ["x", "y"])
    assert base.known("x").tolist() == [2, 3, 4]
    assert found.comparison == compare([5, 6, 7], [2, 3, 4])
