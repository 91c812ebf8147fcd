"""Every cell of a cross-play is a match of its two teams, and a kept matrix is read only while it is about them."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from esp_trainer.analysis import cross_play as module
from esp_trainer.analysis.cross_play import CrossPlay, cross_play, own_cross_play
from esp_trainer.analysis.history import History
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.reference import predprey_reference
from esp_trainer.files import read_arrays, write_arrays
from esp_trainer.seeding import stream
from esp_trainer.types import Evaluator, Role, ScriptedTeams, TeamBatch, TrialBatch
from predprey_env import EnvConfig

ENV = EnvConfig(size=8, max_cycles=20)
N_EPISODES = 16
CHASE, FLEE = ScriptedTeams("greedy_chase"), ScriptedTeams("flee_nearest")


def random_history(env: EnvConfig = ENV, seed: int = 0, prey: str = "esp", n: int = 5, kind: str = "split") -> History:
    """Champions that nobody evolved: random networks play more differently than those of a short run."""
    config = RunConfig(
        env=env,
        seed=seed,
        generations=n,
        predators=SideConfig(controller=kind, n_hidden=3),
        prey=SideConfig(controller=kind, n_hidden=3, policy=prey),
        esp=EspConfig(subpopulation_size=4, n_trials=1, n_episodes=1, hof_mates=0),
        champion=ChampionConfig(n_candidates=1, n_held_out=8, method="argmax"),
    )
    first = History.evolve(config.replace(generations=1), FusedEvaluator(env, threads=1))
    generator = np.random.default_rng(seed)
    champions: dict[Role, np.ndarray] = {
        role: generator.uniform(-6, 6, (n, *array.shape[1:])).astype(np.float32)
        for role, array in first.champions.items()
    }
    return History(config, champions, {"caught": np.zeros(n)})


def same(a: CrossPlay, b: CrossPlay) -> bool:
    pairs = [(getattr(a, name), getattr(b, name)) for name in vars(a)]
    return all(np.array_equal(x, y) and np.asarray(x).dtype == np.asarray(y).dtype for x, y in pairs)


@pytest.fixture(scope="module")
def evaluator() -> FusedEvaluator:
    return FusedEvaluator(ENV, threads=1)


@pytest.fixture(scope="module")
def history() -> History:
    return random_history()


def meet(history: History, evaluator: FusedEvaluator, n_episodes: int = N_EPISODES, seed: int = 3) -> CrossPlay:
    """Three generations of predators and four of prey."""
    predators = history.entrants("predators", np.array([4, 0, 2]))
    prey = history.entrants("prey", np.array([1, 3, 0, 4]))
    return cross_play(predators, prey, evaluator, n_episodes=n_episodes, seed=seed)


def alone(predators: TeamBatch, prey: TeamBatch, evaluator: Evaluator, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Two teams in a match of their own: who was caught, bool ``(n_episodes, n_prey)``, and how many predators started
    at an even distance.
    """
    starts = evaluator.starts.held_out(stream(seed, "cross-play"), N_EPISODES).swapaxes(0, 1)
    result = evaluator.evaluate(TrialBatch(predators, prey, starts))
    return result.captured[0], evaluator.starts.even_predators(starts)[0]


@pytest.mark.parametrize("reference", [False, True], ids=["compiled", "PettingZoo"])
@pytest.mark.parametrize("kind", ["split", "central"])
def test_each_cell_is_a_match_of_its_teams(kind: str, reference: bool, evaluator: FusedEvaluator):
    history = random_history(kind=kind)
    met = meet(history, evaluator)
    judge = predprey_reference(ENV) if reference else evaluator
    for g, h in [(0, 0), (1, 3), (2, 1)] if reference else np.ndindex(3, 4):
        predators = history.team("predators", [4, 0, 2][g]).as_teams(1)
        prey = history.team("prey", [1, 3, 0, 4][h]).as_teams(1)
        captured, even = alone(predators, prey, judge)
        assert met.captured[g, h].tolist() == [int(captured[even == k].sum()) for k in range(4)]
        assert met.met.tolist() == [int((even == k).sum()) for k in range(4)]
        assert met.none_caught[g, h] == sum(not row.any() for row in captured)
        assert met.all_caught[g, h] == sum(row.all() for row in captured)
        assert met.caught[g, h] == captured.mean()


def test_the_teams_of_the_tests_differ(history: History, evaluator: FusedEvaluator):
    """Else a cell could be another's and nobody would see it."""
    assert len(np.unique(meet(history, evaluator).caught)) > 6


def test_what_is_caught_by_parity_sums_to_what_is_caught(history: History, evaluator: FusedEvaluator):
    met = meet(history, evaluator)
    assert met.captured.shape == (3, 4, 4)
    assert met.met.sum() == N_EPISODES * ENV.n_prey
    assert met.met.tolist() == [4, 12, 12, 4]  # 1 : 3 : 3 : 1 of 32
    assert (met.captured <= met.met).all()
    assert met.caught == pytest.approx(met.captured.sum(axis=-1) / 32)
    assert met.caught_by_even * met.met == pytest.approx(met.captured)


def test_episodes_without_and_with_all_captures_bound_the_prey_caught(history: History, evaluator: FusedEvaluator):
    met = meet(history, evaluator)
    # Of two prey: none in some episodes, two in others, and one in the rest.
    ones = N_EPISODES - met.none_caught - met.all_caught
    assert (ones >= 0).all()
    np.testing.assert_array_equal(met.captured.sum(axis=-1), ones + 2 * met.all_caught)


def test_of_a_single_prey_none_or_all_are_caught():
    env = ENV.replace(n_prey=1)
    met = meet(random_history(env), FusedEvaluator(env, threads=1))
    assert (met.none_caught + met.all_caught == N_EPISODES).all()
    np.testing.assert_array_equal(met.captured.sum(axis=-1), met.all_caught)


def test_where_no_prey_started_so_the_share_is_unknown(history: History, evaluator: FusedEvaluator):
    met = meet(history, evaluator, n_episodes=1)
    nobody = met.met == 0
    assert nobody.any()
    assert np.isnan(met.caught_by_even[..., nobody]).all()
    assert not np.isnan(met.caught_by_even[..., ~nobody]).any()


@pytest.mark.parametrize("at_once", [1, 5, 12, 13])
def test_how_many_cells_are_played_at_once_changes_nothing(
    at_once: int, history: History, evaluator: FusedEvaluator, monkeypatch: pytest.MonkeyPatch
):
    whole = meet(history, evaluator), cross_play(CHASE, history.entrants("prey", np.arange(5)), evaluator)
    monkeypatch.setattr(module, "_CELLS_AT_ONCE", at_once)
    parts = meet(history, evaluator), cross_play(CHASE, history.entrants("prey", np.arange(5)), evaluator)
    assert same(whole[0], parts[0])
    assert same(whole[1], parts[1])


def test_threads_change_nothing(history: History, evaluator: FusedEvaluator):
    assert same(meet(history, evaluator), meet(history, FusedEvaluator(ENV, threads=2)))


def test_it_follows_from_its_seed(history: History, evaluator: FusedEvaluator):
    assert same(meet(history, evaluator), meet(history, evaluator))
    assert not same(meet(history, evaluator), meet(history, evaluator, seed=4))


@pytest.mark.parametrize("script", ["greedy_chase", "parity_chase", "intercept", "surround"])
def test_scripted_predators_are_one_row(script: str, history: History, evaluator: FusedEvaluator):
    met = cross_play(
        ScriptedTeams(script), history.entrants("prey", np.arange(5)), evaluator, n_episodes=N_EPISODES, seed=3
    )
    assert met.captured.shape == (1, 5, 4)
    for h in range(5):
        captured, _ = alone(ScriptedTeams(script), history.team("prey", h).as_teams(1), evaluator)
        assert met.caught[0, h] == captured.mean()


@pytest.mark.parametrize("script", ["flee_nearest", "flee_centroid", "run_straight"])
def test_scripted_prey_are_one_column(script: str, history: History, evaluator: FusedEvaluator):
    met = cross_play(
        history.entrants("predators", np.arange(5)), ScriptedTeams(script), evaluator, n_episodes=N_EPISODES, seed=3
    )
    assert met.captured.shape == (5, 1, 4)
    for g in range(5):
        captured, _ = alone(history.team("predators", g).as_teams(1), ScriptedTeams(script), evaluator)
        assert met.caught[g, 0] == captured.mean()


def test_two_scripts_are_one_cell(evaluator: FusedEvaluator):
    met = cross_play(CHASE, FLEE, evaluator, n_episodes=N_EPISODES, seed=3)
    captured, _ = alone(CHASE, FLEE, evaluator)
    assert met.caught.tolist() == [[captured.mean()]]


# A run against itself.


def test_rows_and_columns_are_the_sampled_generations(history: History, evaluator: FusedEvaluator):
    own = own_cross_play(history, evaluator, n_generations=3, n_episodes=8)
    assert own.predators.tolist() == own.prey.tolist() == history.sample(3).tolist() == [0, 2, 4]
    teams = (history.entrants(role, np.array([0, 2, 4])) for role in ("predators", "prey"))
    np.testing.assert_array_equal(own.captured, cross_play(*teams, evaluator, n_episodes=8).captured)


def test_against_a_script_there_is_one_column(evaluator: FusedEvaluator):
    own = own_cross_play(random_history(prey="flee_nearest"), evaluator, n_generations=3, n_episodes=8)
    assert own.predators.tolist() == [0, 2, 4]
    assert own.prey.tolist() == [0]
    assert own.caught.shape == (3, 1)


class Asked(FusedEvaluator):
    """Counts how often it is asked to play."""

    def __init__(self) -> None:
        super().__init__(ENV, threads=1)
        self.times = 0

    def _play(self, batch: TrialBatch, n_traced: int):  # type: ignore[no-untyped-def]
        self.times += 1
        return super()._play(batch, n_traced)


@pytest.fixture
def asked() -> Asked:
    return Asked()


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    return tmp_path / "analysis" / "cross-play.safetensors"


def own(history: History, evaluator: FusedEvaluator, cache: Path | None, **changes: int) -> CrossPlay:
    return own_cross_play(history, evaluator, **{"n_generations": 3, "n_episodes": 8, **changes}, cache=cache)


@pytest.mark.parametrize("prey", ["esp", "flee_nearest"])
def test_a_kept_matrix_is_read_and_not_played_again(prey: str, asked: Asked, cache: Path):
    history = random_history(prey=prey)
    played = own(history, asked, cache)
    assert asked.times == 1
    assert same(own(history, asked, cache), played)
    assert asked.times == 1
    assert same(own(history, asked, None), played)
    assert asked.times == 2


def one_weight_changed() -> History:
    other = random_history()
    other.champions["prey"][2, -1, 0, 0, 0] += 1
    return other


def another_network() -> History:
    other = random_history()
    prey = other.config.prey.replace(input_scale=0.5)
    return History(other.config.replace(prey=prey), other.champions, other.curves)


OTHERS: dict[str, tuple[Callable[[], History], dict[str, int]]] = {
    "other champions": (lambda: random_history(seed=1), {}),
    "one weight of one champion": (one_weight_changed, {}),
    "a scripted side": (lambda: random_history(prey="flee_nearest"), {}),
    "another network": (another_network, {}),
    "another seed": (random_history, {"seed": 1}),
    "other episodes": (random_history, {"n_episodes": 16}),
    "more generations": (random_history, {"n_generations": 4}),
    "another world": (lambda: random_history(ENV.replace(max_cycles=21)), {}),
}


@pytest.mark.parametrize(("make", "changes"), OTHERS.values(), ids=OTHERS)
def test_a_matrix_that_is_about_something_else_is_played_again(
    make: Callable[[], History], changes: dict[str, int], history: History, asked: Asked, cache: Path
):
    other = make()
    own(history, asked, cache)
    expected = own(other, asked, None, **changes)
    asked.times = 0
    assert same(own(other, asked, cache, **changes), expected)
    assert asked.times == 1
    assert same(own(other, asked, cache, **changes), expected), "the new one is kept"
    assert asked.times == 1


def _foreign(path: Path) -> None:
    write_arrays(path, "team", {}, {})


def _without_an_array(path: Path) -> None:
    header, arrays = read_arrays(path, "cross-play")
    write_arrays(path, "cross-play", header, {name: array for name, array in arrays.items() if name != "met"})


SPOILT: dict[str, Callable[[Path], object]] = {
    "empty": lambda path: path.write_bytes(b""),
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-8]),
    "cut in the header": lambda path: path.write_bytes(path.read_bytes()[:100]),
    "a flipped bit": lambda path: path.write_bytes(path.read_bytes()[:-1] + bytes([path.read_bytes()[-1] ^ 1])),
    "text": lambda path: path.write_text("hello"),
    "another kind": _foreign,
    "without an array": _without_an_array,
}


@pytest.mark.parametrize("spoil", SPOILT.values(), ids=SPOILT)
def test_a_damaged_matrix_is_played_again_and_mended(
    spoil: Callable[[Path], object], history: History, asked: Asked, cache: Path
):
    played = own(history, asked, cache)
    whole = cache.read_bytes()
    spoil(cache)
    assert same(own(history, asked, cache), played)
    assert asked.times == 2
    assert cache.read_bytes() == whole


def test_a_matrix_may_be_kept_anywhere(history: History, asked: Asked, cache: Path):
    """It is about champions, not about where they are."""
    own(history, asked, cache)
    shutil.move(cache, cache.parent.parent / "elsewhere")
    own(history, asked, cache.parent.parent / "elsewhere")
    assert asked.times == 1
