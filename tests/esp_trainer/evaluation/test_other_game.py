"""The evaluator of other games against the reference evaluator, and games that fail."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.coevolution.sides import EvolvingSide, new_sides
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.lockstep import Job, play_job
from esp_trainer.evaluation.other_game import GameEvaluator, check_repeats
from esp_trainer.evaluation.reference import ReferenceEvaluator
from esp_trainer.evaluation.seats import Squad
from esp_trainer.evaluation.starts import SeedStarts
from esp_trainer.game import GameConfig, GameError, game_of, make_environment
from esp_trainer.presets import preset
from esp_trainer.types import ROLES, ScriptedTeams, TeamBatch, TrialBatch, zero_sum_part

EXAMPLES = Path(__file__).parents[3] / "examples"
RING = {"game.environment": "own_game", "game.predators": "chaser_", "game.prey": "runner_"}
TAG = {"game.environment": "mpe2.simple_tag_v3"}
SHORT_TAG = {**TAG, "game.options": {"max_cycles": 6}}


@pytest.fixture(autouse=True)
def _examples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))


def config_of(fields: dict[str, Any]) -> RunConfig:
    return preset("game").with_fields({"esp.n_trials": 7, "esp.block_size": 1, "esp.subpopulation_size": 8, **fields})


def batch_of(config: RunConfig, n_episodes: int = 2) -> TrialBatch:
    generator = np.random.default_rng(0)
    teams: dict[str, TeamBatch] = {
        role: side.algorithm.ask(generator) if isinstance(side, EvolvingSide) else side
        for role, side in new_sides(config).items()
    }
    n_prey = game_of(config.game).shapes["prey"].n_agents
    return TrialBatch(teams["predators"], teams["prey"], SeedStarts(n_prey).draw(generator, 7, n_episodes))


def reference(game: GameConfig) -> ReferenceEvaluator:
    n_prey = game_of(game).shapes["prey"].n_agents
    return ReferenceEvaluator(lambda: make_environment(game), SeedStarts(n_prey), (game.predators, game.prey))


@pytest.mark.parametrize(
    "fields",
    [
        SHORT_TAG,
        RING,
        pytest.param(
            {**RING, "predators.network": "elman", "prey.choice": "drawn", "prey.output": "linear"},
            marks=pytest.mark.slow,  # it compiles
        ),
        {**RING, "prey.bias": False, "prey.n_hidden": 3, "prey.input_scale": 0.5},
    ],
    ids=["simple_tag", "ring", "memory and samples", "another size"],
)
def test_it_plays_as_the_reference_does_to_the_bit(fields: dict[str, Any]) -> None:
    config = config_of(fields)
    batch = batch_of(config)
    found, expected = GameEvaluator(config.game, 1).evaluate(batch), reference(config.game).evaluate(batch)
    assert found.fitness.tobytes() == expected.fitness.tobytes()
    assert found.steps.tolist() == expected.steps.tolist()
    assert found.payoff.tobytes() == expected.payoff.tobytes()
    assert len(np.unique(found.payoff)) > 3


def test_the_number_of_copies_does_not_matter() -> None:
    config = config_of(RING)
    game, batch = game_of(config.game), batch_of(config)
    squads = {role: Squad.of(role, getattr(batch, role), 7, game.shapes[role]) for role in ROLES}
    outcomes = []
    for copies in (1, 3, 32):
        made: dict[int, Any] = {}
        outcome = play_job(
            game,
            Job(squads, batch.starts),
            lambda n, made=made: made.setdefault(n, make_environment(config.game)),
            copies,
        )
        assert len(made) == min(copies, 14)
        outcomes.append(outcome.fitness.tobytes() + outcome.steps.tobytes())
    assert len(set(outcomes)) == 1


def test_a_random_side_moves_by_the_seed_of_the_episode() -> None:
    config = config_of(RING)
    batch = batch_of(config)
    at_random = TrialBatch(batch.predators, ScriptedTeams("random"), batch.starts)
    evaluator = GameEvaluator(config.game, 1)
    one, again = evaluator.evaluate(at_random), evaluator.evaluate(at_random)
    assert one.fitness.tobytes() == again.fitness.tobytes() != evaluator.evaluate(batch).fitness.tobytes()
    with pytest.raises(ValueError, match="prey must be evolved or random in another game, got flee_nearest"):
        evaluator.evaluate(TrialBatch(batch.predators, ScriptedTeams("flee_nearest"), batch.starts))


def test_teams_of_another_shape_are_refused() -> None:
    config = config_of(RING)
    batch = batch_of(config)
    with pytest.raises(ValueError, match="predators must have 7 trials, 2 agents and 3 actions, got 7, 1 and 3"):
        GameEvaluator(config.game, 1).evaluate(TrialBatch(batch.prey, batch.prey, batch.starts))


def test_the_payoff_is_half_the_difference_of_the_teams_mean_returns() -> None:
    assert zero_sum_part(np.array([[4.0, 8.0, -6.0], [1.0, 3.0, 2.0]]), 2).tolist() == [6.0, 0.0]
    config = config_of(RING)
    result = GameEvaluator(config.game, 1).evaluate(batch_of(config))
    assert result.payoff.tolist() == result.fitness[..., 0].tolist()  # a zero-sum game, with equal pay in the team
    assert result.mean_payoff == result.payoff.mean()
    assert not result.captured.any()


def test_no_trial_is_played_at_once() -> None:
    config = config_of(RING)
    evaluator = GameEvaluator(config.game, 1)
    evaluator.compile(*(side.algorithm.controller for side in new_sides(config).values()))
    none = batch_of(config).part(slice(0))
    assert evaluator.evaluate(none).fitness.shape == (0, 2, 3)


FAULTY = '''
import os
from pathlib import Path
import numpy as np
from own_game import Ring


class Broken(Ring):
    """Fails in its third step, observes too much, or pays nothing that can be added."""

    def __init__(self, how="raise"):
        self.how = how

    def step(self, actions):
        observations, rewards, *rest = super().step(actions)
        if self.steps == 3 and self.how == "raise":
            raise RuntimeError("the floor\\ngives way")
        if self.steps == 3 and self.how == "shape":
            observations["runner_0"] = np.zeros(5, np.float32)
        if self.how == "rewards":
            rewards["runner_0"] = "much"
        if self.how == "unpaid":
            del rewards["chaser_1"]
        if self.how == "four":
            rest.pop()
        if self.how == "nan":
            rewards["runner_0"] = float("nan")
        if self.how == "killed" or (self.how == "killed once" and not Path("died").exists()):
            Path("died").touch()
            os.kill(os.getpid(), 9)
        return observations, rewards, *rest


class Many(Ring):
    """The ring in arrays; ``wrong`` says in what it differs from the ring."""

    def __init__(self, wrong=""):
        self.wrong = wrong

    def many(self):
        return Side(self.wrong)


class Side:
    def __init__(self, wrong):
        self.wrong = wrong

    def reset(self, seeds):
        self.steps, self.rings = 0, [Ring() for _ in seeds]
        for ring, seed in zip(self.rings, seeds.tolist()):
            ring.reset(seed=seed)
        return self.seen()

    def seen(self):
        found = [ring.seen() for ring in self.rings]
        seen = {agent: np.stack([each[agent] for each in found]) for agent in Ring.possible_agents}
        return {agent: each[:, :1] for agent, each in seen.items()} if self.wrong == "shape" and self.steps else seen

    def step(self, actions):
        self.steps += 1
        paid = []
        for i, ring in enumerate(self.rings):
            if ring.agents:
                _, rewards, *_ = ring.step({agent: int(actions[agent][i]) for agent in ring.agents})
            paid.append(rewards if ring.agents or ring.steps == self.steps else dict.fromkeys(rewards, 99.0))
        rewards = {agent: np.array([each[agent] for each in paid]) for agent in Ring.possible_agents}
        if self.wrong == "rewards" and self.steps == 4:
            rewards["chaser_1"] = rewards["chaser_1"] + 1
        over = np.array([not ring.agents for ring in self.rings])
        return self.seen(), rewards, over | (self.wrong == "end" and self.steps == 9)


class Endless(Ring):
    def step(self, actions):
        self.steps = 0
        return super().step(actions)


class Unseeded(Ring):
    def reset(self, seed=None, options=None):
        return super().reset(None, options)


class Stateful(Ring):
    def reset(self, seed=None, options=None):
        self.played = getattr(self, "played", 0) + 1
        return super().reset(seed + self.played, options)
'''


@pytest.fixture
def faulty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """``faulty(name, **options)``: the config of a game that goes wrong."""
    (tmp_path / "faulty.py").write_text(FAULTY)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "faulty", raising=False)

    def made(name: str, **options: Any) -> RunConfig:
        return config_of({**RING, "game.environment": f"faulty:{name}", "game.options": options})

    return made


@pytest.mark.parametrize(
    ("how", "line"),
    [
        ("raise", r"faulty:Broken failed in step\(\) with seed \d+, after 2 steps: RuntimeError: the floor gives way"),
        ("shape", r".* after 2 steps: runner_0 must observe 2 numbers, got shape \(5,\)"),
        ("rewards", r".* after 0 steps: .*Error: .*"),
    ],
)
def test_an_environment_that_fails_is_named_with_its_seed_and_step(how: str, line: str, faulty: Any) -> None:
    config = faulty("Broken", how=how)
    with pytest.raises(GameError, match=f"^{line}$"):
        GameEvaluator(config.game, 1).evaluate(batch_of(config))


def test_a_game_that_fails_before_a_run_begins_is_refused_in_one_line(faulty: Any) -> None:
    line = "^faulty:Broken failed in an episode of random actions: RuntimeError: the floor gives way$"
    with pytest.raises(GameError, match=line):
        GameEvaluator(faulty("Broken").game, 1).compile()


def test_an_episode_without_an_end_is_refused(faulty: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("esp_trainer.evaluation.lockstep.MOST_STEPS", 50)
    config = faulty("Endless")
    with pytest.raises(GameError, match="an episode must end within 50 steps"):
        GameEvaluator(config.game, 1).evaluate(batch_of(config))


def test_a_game_that_pays_nan_is_told_so(faulty: Any) -> None:
    with pytest.raises(GameError, match=r"^faulty:Broken must give finite numbers, got nan as reward of runner_0$"):
        check_repeats(faulty("Broken", how="nan").game)


def test_a_step_that_leaves_something_out_is_refused(faulty: Any) -> None:
    message = r"^step\(\) of Broken must return a reward of each agent that acted, got none of chaser_1$"
    with pytest.raises(GameError, match=message):
        check_repeats(faulty("Broken", how="unpaid").game)
    with pytest.raises(GameError, match=r"^step\(\) of Broken must return observations, .* and infos, got 4 values$"):
        check_repeats(faulty("Broken", how="four").game)


@pytest.mark.parametrize("name", ["Unseeded", "Stateful"])
def test_a_game_that_does_not_repeat_itself_is_refused(name: str, faulty: Any) -> None:
    with pytest.raises(GameError, match=f"an episode of faulty:{name} must follow from its seed and the actions alone"):
        GameEvaluator(faulty(name).game, 1).compile()


def test_simple_tag_and_the_ring_follow_from_their_seeds() -> None:
    check_repeats(config_of(SHORT_TAG).game)
    check_repeats(config_of(RING).game)


def test_episodes_side_by_side_go_as_they_do_one_at_a_time(faulty: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("esp_trainer.evaluation.lockstep.MANY", 5)  # 14 episodes, in three parts
    config = faulty("Many")
    assert game_of(config.game).has_many
    batch = batch_of(config)
    evaluator = GameEvaluator(config.game, 1)
    evaluator.compile()
    found, expected = evaluator.evaluate(batch), GameEvaluator(config_of(RING).game, 1).evaluate(batch)
    assert found.fitness.tobytes() == expected.fitness.tobytes()
    assert found.steps.tolist() == expected.steps.tolist()
    assert evaluator.evaluate(batch.part(slice(0))).fitness.shape == (0, 2, 3)


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        ("rewards", "another reward of chaser_1 in step 4 with seed 1"),
        ("end", "another end in step 9 with seed 1"),
        ("shape", "another chaser_0 in step 1 with seed 1"),
    ],
)
def test_episodes_side_by_side_that_go_otherwise_are_refused(wrong: str, line: str, faulty: Any) -> None:
    with pytest.raises(GameError, match=rf"^many\(\) of faulty:Many must play as the environment does, got {line}$"):
        check_repeats(faulty("Many", wrong=wrong).game)
    if wrong == "shape":
        config = faulty("Many", wrong=wrong)
        with pytest.raises(GameError, match=r"many\(\).step.* chaser_0 must observe numbers of shape \(14, 2\), got"):
            GameEvaluator(config.game, 1).evaluate(batch_of(config))


@pytest.mark.parametrize("options", [{}, {"num_good": 2, "num_adversaries": 2, "num_obstacles": 1, "max_cycles": 40}])
def test_simple_tag_in_arrays_is_simple_tag_to_the_bit(options: dict[str, Any]) -> None:
    plain, fast = config_of({**TAG, "game.options": options}), config_of({"game.options": options})
    batch = batch_of(plain).part(slice(3))
    check_repeats(fast.game)
    found = GameEvaluator(fast.game, 1).evaluate(batch)
    assert found.fitness.tobytes() == GameEvaluator(plain.game, 1).evaluate(batch).fitness.tobytes()


@pytest.mark.slow
def test_the_number_of_processes_does_not_matter_and_they_can_be_started_again() -> None:
    config = config_of(RING)
    batch = batch_of(config)
    expected = GameEvaluator(config.game, 1).evaluate(batch)
    evaluator = GameEvaluator(config.game, 2)
    for _ in range(2):
        found = evaluator.evaluate(batch)
        assert found.fitness.tobytes() == expected.fitness.tobytes()
        assert found.steps.tobytes() == expected.steps.tobytes()
        evaluator._workers.close()


@pytest.mark.slow
def test_an_environment_that_fails_in_another_process_is_named_too(faulty: Any) -> None:
    config = faulty("Broken")
    evaluator = GameEvaluator(config.game, 2)
    for _ in range(2):  # the processes are gone, and others come
        with pytest.raises(GameError, match=r"RuntimeError: the floor gives way$"):
            evaluator.evaluate(batch_of(config))
    assert not evaluator._workers._workers


@pytest.mark.slow
def test_the_work_of_a_killed_process_is_done_by_another(faulty: Any) -> None:
    config = faulty("Broken", how="killed once")
    batch = batch_of(config)
    found = GameEvaluator(config.game, 2).evaluate(batch)
    assert Path("died").exists()
    assert found.fitness.tobytes() == GameEvaluator(config_of(RING).game, 1).evaluate(batch).fitness.tobytes()


@pytest.mark.slow
def test_a_game_that_kills_every_process_is_given_up(faulty: Any) -> None:
    config = faulty("Broken", how="killed")
    with pytest.raises(GameError, match=r"^the process of a job was lost 3 times, the last time by SIGKILL$"):
        GameEvaluator(config.game, 2).evaluate(batch_of(config))
