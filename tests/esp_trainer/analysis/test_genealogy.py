"""Origins of genes: by hand, and against genes that say themselves where they come from."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.analysis.genealogy import NEVER, Genealogy, of_run, replay_origins, trace
from esp_trainer.config import RunConfig
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.run.directory import RunDirectory
from esp_trainer.run.genealogy import Layout, read_genealogy
from esp_trainer.run.trainer import Trainer

if TYPE_CHECKING:
    from pathlib import Path

LAYOUT = Layout((3,), size=4, n_elite=1, hof_mates=1)


def records(*generations: dict[str, Any]) -> np.ndarray:
    """Records of one subpopulation of four neurons with three genes, of which one pair breeds."""
    found = np.zeros(len(generations), LAYOUT.record)
    for number, fields in enumerate(generations):
        found[number]["generation"] = number
        for name, value in fields.items():
            found[number][name] = value
    return found


def pair(elite: int, mate: int, cut: int, children: list[int], champion: int, past: int = NEVER) -> dict[str, Any]:
    return {"elite": elite, "mates": mate, "cuts": cut, "children": [children], "champion": champion, "past": past}


BY_HAND = records(
    pair(0, 1, 1, [3, 2], champion=2),  # 000 x 111, after the first gene: 011 and 100
    pair(2, 3, 2, [1, 0], champion=3, past=0),  # 100 x 222 of the first champion: 102 and 220
    pair(0, 3, 1, [2, 1], champion=0, past=1),  # 220 x 011 of the second champion: 211 and 020
    {"champion": 2, "burst": 1, **{name: [[0]] for name in ("elite", "mates", "cuts")}, "children": [[0, 1]]},
    pair(1, 2, 1, [0, 3], champion=0),
)


def test_origins_follow_the_parents_cut_by_cut() -> None:
    found = [(genes.each(np.copy), champion) for genes, champion in replay_origins(LAYOUT, BY_HAND)]
    strings = [["".join(map(str, neuron)) for neuron in genes.founder[0]] for genes, _ in found]
    assert strings == [
        ["000", "111", "222", "333"],
        ["000", "111", "100", "011"],
        ["220", "102", "100", "011"],
        ["220", "020", "211", "011"],
        ["211", "211", "211", "211"],
    ]
    assert found[2][0].past[0].tolist() == [[0, 0, -1], [-1, -1, 0], [-1] * 3, [-1] * 3]
    assert found[3][0].past[0].tolist() == [[0, 0, -1], [1, 0, -1], [0, 1, 1], [-1] * 3]
    assert found[2][0].skipped[0].tolist() == [[1, 1, 0], [0, 0, 1], [0] * 3, [0] * 3]
    assert found[3][0].skipped[0].tolist() == [[1, 1, 0], [1, 1, 0], [1, 1, 1], [0] * 3]


def test_curves_and_ancestry_are_those_worked_out_by_hand() -> None:
    genealogy = trace(LAYOUT, BY_HAND)
    # In generation 2 each place has one founder twice and two once: 4^2 / (2^2 + 1 + 1).
    assert genealogy.founders.tolist() == pytest.approx([4, 2, 16 / 6, 2, 1])
    assert genealogy.from_past.tolist() == pytest.approx([0, 0, 3 / 12, 7 / 12, 1])
    ancestry = genealogy.ancestry(3)
    assert ancestry.founders.tolist() == [pytest.approx([0, 2 / 3, 1 / 3, 0])]
    assert ancestry.past == pytest.approx({0: 1 / 3, 1: 2 / 3})
    assert genealogy.ancestry(2).past == pytest.approx({NEVER: 1 / 3, 0: 2 / 3})
    leading = genealogy.leading()  # the champions are 222, 011, 220, 211 and 211
    assert leading.founder.tolist() == [[2], [1], [2], [1], [1]]
    assert leading.share.tolist() == [[1], *[[pytest.approx(2 / 3)]] * 4]
    assert leading.from_past.tolist() == [[0], [0], [pytest.approx(2 / 3)], [1], [1]]
    assert leading.takeovers().tolist() == [[True], [True], [True], [False]]
    first = genealogy.first(3)
    assert len(first) == 3
    assert first.champions.founder.shape == (3, 1, 3)


# -- genes that carry their own origin ---------------------------------------------------------------------------------

SMALL = preset("smoke").replace(generations=12, checkpoint_every=50, genealogy=True)
ESP = {"subpopulation_size": 12, "n_trials": 30, "n_episodes": 1, "mutation_rate": 0.0}
BIASED = {"n_hidden": 2, "controller": "combiner", "bias": True}
CASES: dict[str, RunConfig] = {
    "elite alone": SMALL.replace(esp={**ESP, "hof_mates": 0}),
    "past champions": SMALL.replace(esp={**ESP, "hof_mates": 2, "mate": "better_ranked"}, prey=BIASED),
    "a small hall of fame": SMALL.replace(esp={**ESP, "hof_mates": 3, "hof_size": 3}, champion={"method": "argmax"}),
    "bursts": SMALL.replace(
        esp={**ESP, "hof_mates": 1, "burst_after": 2, "burst_scale": 1e-12, "mutation_limit": 1e-9}
    ),
    "a central controller": SMALL.replace(esp={**ESP, "hof_mates": 1}, predators={"controller": "central"}),
}
SLOTS, TIMES = 16, 64  # a gene is founder + SLOTS * (past + 1) + SLOTS * TIMES * skipped


def label(founder: np.ndarray, past: np.ndarray, skipped: np.ndarray) -> np.ndarray:
    return founder + SLOTS * (past + 1) + SLOTS * TIMES * skipped


def relabelled(champions: np.ndarray, generations: np.ndarray, now: int) -> np.ndarray:
    """Champions as mates: their genes now say that they came through a past champion."""
    each = generations.reshape(-1, *[1] * (champions.ndim - 1))
    champions = np.rint(champions)  # after a burst they are off by a billionth
    founder, skipped = champions % SLOTS, champions // (SLOTS * TIMES)
    return label(founder, each, skipped + now - each).astype(np.float32)


@pytest.mark.parametrize("config", CASES.values(), ids=CASES)
def test_the_origins_of_all_genes_are_those_that_the_genes_say(
    config: RunConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Evolves genes that are labels instead of weights, which no mutation changes."""
    trainer = Trainer.start(RunDirectory(tmp_path), config, lambda config: FusedEvaluator(config.env, threads=1))
    sides = trainer.coevolution.evolving
    for side in sides.values():
        side.algorithm.genomes[:] = np.arange(12.0)[:, None]
    tell = Subpopulations.tell

    def told(population: Subpopulations, fitness: Any, champions: np.ndarray, generator: Any) -> float:
        fame = next(iter(trainer.coevolution.evolving.values())).hall_of_fame
        return tell(population, fitness, relabelled(champions, fame.generations, fame.done), generator)

    monkeypatch.setattr(Subpopulations, "tell", told)
    says: dict[Any, list[tuple[np.ndarray, np.ndarray]]] = {role: [] for role in sides}
    before = {role: side.algorithm.genomes.copy() for role, side in sides.items()}
    n_bursts = 0
    for generation in trainer.generations():
        for role, side in trainer.coevolution.evolving.items():
            says[role].append((np.rint(before[role]), np.rint(generation.champions[role].genomes)))
            before[role] = side.algorithm.genomes.copy()
            n_bursts += generation.bred[role].burst
    assert (n_bursts > 0) == bool(config.esp.burst_after)
    for role in sides:
        layout, found = read_genealogy(RunDirectory(tmp_path).genealogy_file(role))
        read_by_a_network = np.arange(max(layout.used)) < np.array(layout.used)[:, None]
        assert len(found) == len(says[role]) == 12
        for (genes, champion), (population, chosen) in zip(replay_origins(layout, found), says[role], strict=True):
            wanted = population.reshape(*genes.founder.shape).swapaxes(1, 2)
            assert np.array_equal(label(*genes).swapaxes(1, 2)[read_by_a_network], wanted[read_by_a_network])
            of_champion = chosen.reshape(champion.founder.shape)
            assert np.array_equal(label(*champion)[read_by_a_network], of_champion[read_by_a_network])


# -- of a run ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def without_past(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "run"
    config = CASES["elite alone"].replace(esp={"mutation_rate": 0.4}, generations=20)
    list(Trainer.start(RunDirectory(path), config, lambda config: FusedEvaluator(config.env, threads=1)).generations())
    return path


def test_founders_are_lost_for_good_where_no_past_champion_mates(without_past: Path) -> None:
    layout, found = read_genealogy(RunDirectory(without_past).genealogy_file("prey"))
    left = [{*genes.founder[0, :, 0].tolist()} for genes, _ in replay_origins(layout, found)]
    assert len(left[0]) == 12
    assert all(later <= earlier for earlier, later in pairwise(left))
    assert len(left[-1]) < 4


def test_shares_of_a_champions_ancestry_add_up(without_past: Path) -> None:
    genealogies = of_run(without_past)
    assert list(genealogies) == ["predators", "prey"]
    for genealogy in genealogies.values():
        assert len(genealogy) == 20
        assert genealogy.founders[0] == 12
        assert (genealogy.founders >= 1).all()
        assert (genealogy.from_past == 0).all()
        for generation in (0, 7, 19):
            ancestry = genealogy.ancestry(generation)
            assert ancestry.founders.sum(axis=1) == pytest.approx(1)
            assert ancestry.past == {NEVER: 1.0}
        assert (genealogy.ancestry(0).founders.max(axis=1) == 1).all()


def test_a_run_that_keeps_no_parents_has_no_genealogy(tmp_path: Path) -> None:
    RunDirectory(tmp_path).create(SMALL.replace(genealogy=False))
    assert of_run(tmp_path) == {}
    assert isinstance(trace(LAYOUT, BY_HAND[:0]), Genealogy)
