"""The algorithms beside ESP: what each does with its scores, and what coevolution may expect of all of them."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any, ClassVar

import numpy as np
import pytest

from esp_trainer.algorithms import ALGORITHMS, WholeTeams, algorithm_class
from esp_trainer.algorithms.ask_tell import AskTell
from esp_trainer.algorithms.cosyne import Cosyne
from esp_trainer.algorithms.genetic import GeneticAlgorithm
from esp_trainer.algorithms.openai_es import OpenAIES
from esp_trainer.config import EspConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.team import gather_genomes

CONTROLLER = make_controller(SideConfig(n_hidden=2, bias=True), np.array([[0, 1], [2, 3]]), 4)
N_AGENTS = 3
NOBODY = np.empty((0, N_AGENTS, *CONTROLLER.shape), np.float32)
TARGET = 2.0


def esp(**fields: Any) -> EspConfig:
    return EspConfig(**{"subpopulation_size": 20, "n_trials": 45, "hof_mates": 0, "init_range": 1.0, **fields})


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def start(name: str, seed: int = 0, **options: Any) -> Any:
    if name == "cma_es":
        pytest.importorskip("cma")
    return algorithm_class(name).start(esp(), CONTROLLER, N_AGENTS, rng(seed), **options)


def genes_of(teams: Any) -> np.ndarray:
    return gather_genomes(teams, np.arange(len(teams.indices)))


def loss(genomes: np.ndarray) -> np.ndarray:
    """How far the genes are from a target, of each team ``(n, ...)``."""
    return ((genomes - TARGET) ** 2).mean(axis=(1, 2, 3, 4))


def generation(algorithm: Any, generator: np.random.Generator) -> float:
    """Ask, score and tell; the least loss."""
    losses = loss(genes_of(algorithm.ask(generator)))
    algorithm.tell(np.repeat(-losses[:, None], N_AGENTS, axis=1), NOBODY, generator)
    return float(losses.min())


EVERY = pytest.mark.parametrize("name", ALGORITHMS)
WHOLE = pytest.mark.parametrize("name", [name for name in ALGORITHMS if name != "esp"])


@EVERY
def test_each_asks_for_the_teams_of_all_trials_and_gets_better(name: str) -> None:
    algorithm, generator = start(name), rng(1)
    teams = algorithm.ask(generator)
    assert teams.indices.shape == (45, N_AGENTS, *CONTROLLER.shape[:2])
    assert teams.genomes.shape[:3] == (N_AGENTS, *CONTROLLER.shape[:2])
    assert np.isfinite(genes_of(teams)).all()
    algorithm.tell(np.zeros((45, N_AGENTS)), NOBODY, generator)
    losses = [generation(algorithm, generator) for _ in range(60)]
    assert np.mean(losses[-5:]) < 0.6 * losses[0]
    assert algorithm.spread().scale > 0


@EVERY
def test_a_deep_copy_goes_on_alike(name: str) -> None:
    first = start(name)
    for number in range(3):
        generation(first, rng(number))
    second = deepcopy(first)
    assert generation(first, rng(7)) == generation(second, rng(7))


@EVERY
def test_the_same_generators_lead_to_the_same_teams_and_others_to_others(name: str) -> None:
    def played(seed: int) -> bytes:
        algorithm, generator = start(name, seed), rng(seed)
        for _ in range(4):
            generation(algorithm, generator)
        return genes_of(algorithm.ask(generator)).tobytes()

    assert played(1) == played(1) != played(2)


@EVERY
def test_a_state_that_is_taken_on_leads_to_the_same_teams(name: str) -> None:
    first, second = start(name, 1), start(name, 2)
    for number in range(5):
        generation(first, rng(number))
    second.restore({key: array.copy() for key, array in first.state().items()})
    for number in range(5, 8):
        assert generation(first, rng(number)) == generation(second, rng(number))
        assert {k: a.tobytes() for k, a in first.state().items()} == {k: a.tobytes() for k, a in second.state().items()}


@EVERY
def test_a_state_that_is_none_is_refused(name: str) -> None:
    algorithm = start(name)
    generation(algorithm, rng())
    state = algorithm.state()
    for key, array in state.items():
        with pytest.raises(ValueError, match=r"got|fit"):
            algorithm.restore({**state, key: array[:-1]})
        with pytest.raises(KeyError):
            algorithm.restore({other: array for other, array in state.items() if other != key})


@EVERY
def test_a_burst_begins_again_around_the_champion(name: str) -> None:
    algorithm = start(name)
    champion = rng(5).normal(size=(N_AGENTS, *CONTROLLER.shape)).astype(np.float32)
    algorithm.burst(champion, rng())
    middle = np.median(genes_of(algorithm.ask(rng())), axis=0)
    assert np.abs(middle - champion).mean() < 0.25


@EVERY
def test_a_state_right_after_a_start_or_a_burst_can_be_taken_on(name: str) -> None:
    first, second = start(name, 1), start(name, 2)
    second.restore(first.state())
    assert genes_of(second.ask(rng(3))).tobytes() == genes_of(first.ask(rng(3))).tobytes()
    first, second = start(name, 1), start(name, 2)
    generation(first, rng())
    first.burst(np.ones((N_AGENTS, *CONTROLLER.shape), np.float32), rng())
    second.restore(first.state())
    assert genes_of(second.ask(rng(3))).tobytes() == genes_of(first.ask(rng(3))).tobytes()


class Unfinished(AskTell):
    """Has no optimiser."""


@WHOLE
def test_the_trials_of_a_round_hold_each_team_once(name: str) -> None:
    algorithm = start(name)
    teams = algorithm.ask(rng())
    order, n_teams = teams.indices[:, 0, 0, 0], teams.genomes.shape[3]
    rounds = [order[first : first + n_teams] for first in range(0, 45, n_teams)]
    assert all(len(set(each.tolist())) == len(each) for each in rounds)
    assert (teams.indices == order[:, None, None, None]).all()
    if len(rounds) > 1:
        assert rounds[0].tolist() != rounds[1][: len(rounds[0])].tolist()


class Recorder(WholeTeams):
    """Two teams and the scores that they are told."""

    def begin(self, generator: np.random.Generator) -> None:
        self.told = np.empty(0)

    def vectors(self, generator: np.random.Generator) -> np.ndarray:
        return np.stack([np.zeros(self.n_parameters), np.ones(self.n_parameters)])

    def learn(self, vectors: np.ndarray, scores: np.ndarray, generator: np.random.Generator) -> None:
        self.told = scores

    def around(self, vector: np.ndarray, generator: np.random.Generator) -> None:
        raise AssertionError

    def state(self) -> dict[str, np.ndarray]:
        raise AssertionError

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        raise AssertionError


def test_a_teams_score_is_the_mean_of_its_trials_over_its_agents() -> None:
    recorder = Recorder.start(esp(n_trials=3), CONTROLLER, N_AGENTS, rng())
    order = recorder.ask(rng()).indices[:, 0, 0, 0].tolist()
    fitness = np.array([[1.0, 2, 3], [4, 4, 4], [0, 0, 9]])
    recorder.tell(fitness, NOBODY, rng())
    by_team = [[row for row, team in zip([2.0, 4.0, 3.0], order, strict=True) if team == t] for t in (0, 1)]
    assert recorder.told.tolist() == [np.mean(own) for own in by_team]
    with pytest.raises(RuntimeError, match="needs the teams of ask"):
        recorder.tell(fitness, NOBODY, rng())


def test_genes_that_no_network_reads_are_no_parameters() -> None:
    combiner = make_controller(SideConfig(n_hidden=2, controller="combiner"), np.array([[0, 1], [2, 3]]), 4)
    recorder = Recorder.start(esp(), combiner, 1, rng())
    assert recorder.n_parameters == 2 * (2 * (2 + 4) + (8 + 4))
    genomes = genes_of(recorder.ask(rng()))
    ones = genomes[genomes.any(axis=(1, 2, 3, 4))][0]
    assert ones[0, 0, 0].tolist() == [1.0] * 6 + [0.0] * 6
    assert ones[0, 2, 0].tolist() == [1.0] * 12


def test_children_of_the_genetic_algorithm_are_cut_from_the_elite_and_replace_the_worst() -> None:
    algorithm = GeneticAlgorithm.start(esp(mutation_rate=0.0), CONTROLLER, N_AGENTS, rng())
    before = algorithm.population.copy()
    scores = np.arange(20.0)  # the last five are the elite
    algorithm.learn(before, scores, rng())
    after = algorithm.population
    assert (after[:10] == before[:9:-1]).all(), "the better half, the best first"
    for first, second in after[10:].reshape(5, 2, -1):
        for child in (first, second):
            assert (child == before[15:]).any(axis=0).all(), "all genes are of the elite"
        switched = [int((child[:-1] != child[1:]).sum()) for child in (first == before[15:][:, None, :]).any(axis=1)]
        assert len(switched) == 5


def test_mutation_changes_at_most_a_gene_of_each_neuron() -> None:
    algorithm = GeneticAlgorithm.start(esp(mutation_rate=1.0), CONTROLLER, N_AGENTS, rng())
    before = algorithm.population.copy()
    algorithm.mutate(algorithm.population, rng())
    changed = (algorithm.population != before).reshape(20, -1, 7)  # 2 + 1 + 4 genes
    assert (changed.sum(axis=2) == 1).all()


def test_cosyne_permutes_the_values_of_a_gene_and_keeps_the_best_team() -> None:
    algorithm = Cosyne.start(esp(mutation_rate=0.0), CONTROLLER, N_AGENTS, rng())
    plain = GeneticAlgorithm.start(esp(mutation_rate=0.0), CONTROLLER, N_AGENTS, rng())
    before, scores = algorithm.population.copy(), rng(3).normal(size=20)
    algorithm.learn(before, scores, rng(4))
    plain.learn(before, scores, rng(4))
    assert (np.sort(algorithm.population, axis=0) == np.sort(plain.population, axis=0)).all()
    assert (algorithm.population != plain.population).any()
    assert (algorithm.population[0] == before[scores.argmax()]).all()


def test_evolution_strategies_follow_the_centred_ranks() -> None:
    algorithm = OpenAIES.start(esp(n_trials=5), CONTROLLER, N_AGENTS, rng(), learning_rate=0.25, weight_decay=0)
    mean = algorithm.mean.copy()
    vectors = algorithm.vectors(rng(1))
    assert len(vectors) == 5
    assert np.allclose(vectors[0], mean)
    assert np.allclose(vectors[1:3] - mean, mean - vectors[3:])
    gradient = (vectors[1] - mean) * (1 / 2 + 1 / 2) + (vectors[2] - mean) * (1 / 6 + 1 / 6)
    algorithm.learn(vectors, np.array([0.0, 9.0, 5.0, 1.0, 2.0]), rng())  # ranks 1/2, 1/6, -1/2, -1/6
    assert np.allclose(algorithm.mean, mean + 0.25 * np.sign(gradient), atol=1e-4), "the first step of Adam is the sign"


class Stepper:
    """An optimiser that samples from NumPy's global generator."""

    def __init__(self, start: np.ndarray) -> None:
        self.centre = start

    def ask(self) -> list[np.ndarray]:
        return [self.centre + np.random.normal(size=len(self.centre)) for _ in range(6)]

    def tell(self, solutions: list[np.ndarray], losses: list[float]) -> None:
        self.centre = solutions[int(np.argmin(losses))]


class Adapted(AskTell):
    """Any object with ask and tell."""

    OPTIONS: ClassVar[Mapping[str, float]] = {"unused": 1.0}

    def optimiser(self, start: np.ndarray, seed: int) -> Stepper:
        return Stepper(start)


def test_any_optimiser_with_ask_and_tell_can_breed_and_is_resumed_by_telling_it_again() -> None:
    first = algorithm_class(f"{__name__}:Adapted").start(esp(), CONTROLLER, N_AGENTS, rng())
    state = np.random.get_state()[1].tolist()  # type: ignore[index]
    for number in range(4):
        generation(first, rng(number))
    assert np.random.get_state()[1].tolist() == state  # type: ignore[index]
    second = Adapted.start(esp(), CONTROLLER, N_AGENTS, rng(9))
    second.restore(first.state())
    assert second._optimiser.centre.tobytes() == first._optimiser.centre.tobytes()  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cosine", "algorithm must be one of esp, cosyne, .* or module:Class, got 'cosine'; did you mean cosyne\\?"),
        ("nowhere:Class", "algorithm nowhere:Class cannot be imported: ModuleNotFoundError: No module named 'nowhere'"),
        ("json:nothing", "algorithm json:nothing cannot be imported: AttributeError: .*"),
        ("json:dumps", "algorithm json:dumps must be a class, got function"),
        (f"{__name__}:Unfinished", ".* has no optimiser\\(\\)"),
        ("esp_trainer.algorithms:WholeTeams", ".* has no state\\(\\) and no restore\\(\\) and no around\\(\\) and .*"),
        ("pathlib:Path", "algorithm pathlib:Path has no start\\(\\) and no ask\\(\\) and no tell\\(\\) and .*"),
    ],
)
def test_a_name_that_is_no_algorithm_is_refused_in_one_line(name: str, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}$") as refused:
        algorithm_class(name)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sgma": 1}, "unknown option sgma; there are sigma, learning_rate, weight_decay"),
        ({"sigma": "big"}, "option sigma must be a finite number of at least 0, got 'big'"),
        ({"sigma": float("nan")}, "option sigma must be a finite number of at least 0, got nan"),
        ({"sigma": "1"}, "option sigma must be a finite number of at least 0, got '1'"),
        ({"sigma": True}, "option sigma must be a finite number of at least 0, got True"),
    ],
)
def test_options_that_an_algorithm_does_not_have_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}$"):
        start("openai_es", **options)


class Broken(Recorder):
    def vectors(self, generator: np.random.Generator) -> np.ndarray:
        return self.found  # type: ignore[attr-defined, no-any-return]


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (np.zeros((2, 3)), r"\(n_teams, 84\), got shape \(2, 3\)"),
        (np.zeros(84), r"\(n_teams, 84\), got shape \(84,\)"),
        (np.full((2, 84), np.nan), r"finite genes, got NaN or infinity"),
    ],
)
def test_vectors_that_are_no_teams_are_refused(found: np.ndarray, message: str) -> None:
    broken = Broken.start(esp(), CONTROLLER, N_AGENTS, rng())
    broken.found = found  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match=rf"^algorithm {__name__}:Broken: vectors\(\) must return {message}$"):
        broken.ask(rng())


@pytest.mark.parametrize("name", ["ga", "cosyne", "cma_es"])
def test_a_population_has_at_least_four_teams(name: str) -> None:
    with pytest.raises(ValueError, match=r"^option n_teams must be at least 4, got 1$"):
        start(name, n_teams=1)


@pytest.mark.parametrize("name", ["ga", "cosyne", "cma_es"])
def test_a_population_has_at_most_as_many_teams_as_trials(name: str) -> None:
    n = esp().n_trials
    most = rf"at most esp.n_trials={n}, as each team needs a trial, got {n + 1}"
    with pytest.raises(ValueError, match=rf"^option n_teams must be {most}$"):
        start(name, n_teams=n + 1)
    assert start(name, n_teams=n).n_teams == n
    many = esp(subpopulation_size=n + 1)
    assert algorithm_class(name).start(many, CONTROLLER, N_AGENTS, rng()).n_teams == n  # type: ignore[attr-defined]
