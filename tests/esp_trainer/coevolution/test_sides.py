"""Both sides before the first generation, and generations of every kind of controller."""

from __future__ import annotations

from typing import Any

import pytest
from small_runs import small

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides, side_controller
from esp_trainer.config import SideConfig
from esp_trainer.esp.team import as_candidates
from esp_trainer.evaluation.fused import FusedEvaluator

KINDS = ["split", "monolithic", "combiner", "double", "pairs", "central"]


@pytest.mark.parametrize(
    ("kind", "predators", "prey"),
    [
        ("split", (3, 2, 3, 12, 2 + 5), (2, 3, 3, 12, 2 + 4)),
        ("monolithic", (3, 1, 3, 12, 4 + 5), (2, 1, 3, 12, 6 + 4)),
        ("combiner", (3, 3, 3, 12, 10 + 5), (2, 4, 3, 12, 12 + 4)),
        ("double", (3, 4, 3, 12, 2 + 5), (2, 6, 3, 12, 2 + 4)),
        ("pairs", (3, 1, 3, 12, 4 + 5), (2, 3, 3, 12, 4 + 4)),
        ("central", (1, 1, 3, 12, 12 + 15), (1, 1, 3, 12, 12 + 8)),
    ],
)
def test_each_kind_has_its_subpopulations_and_room_for_its_champions(
    kind: str, predators: tuple[int, ...], prey: tuple[int, ...]
):
    for role, shape in (("predators", predators), ("prey", prey)):
        side = new_sides(small(kind, n_trials=60))[role]
        assert side.algorithm.genomes.shape == shape
        assert side.hall_of_fame.champions.shape == (0, *shape[:3], shape[4])


def test_the_two_sides_may_be_of_different_kinds():
    config = small("central", n_trials=60).replace(prey=SideConfig(controller="combiner"))
    assert (side_controller(config, "predators").n_together, side_controller(config, "prey").n_together) == (3, 1)
    assert (side_controller(config, "predators").combines, side_controller(config, "prey").combines) == (False, True)


@pytest.mark.parametrize("pairing", ["cosample", "mixed"])
@pytest.mark.parametrize("kind", KINDS)
def test_generations_of_every_kind_depend_on_the_seed_and_not_on_the_threads(kind: str, pairing: str):
    config = small(kind, n_trials=60, pairing=pairing, burst_after=1)
    runs = []
    for threads, seed in ((1, 0), (2, 0), (1, 1)):
        seeded = config.replace(seed=seed)
        run = Coevolution(seeded, new_sides(seeded), FusedEvaluator(config.env, threads))
        generations = [run.step(number) for number in range(4)]
        kept: list[Any] = [generation.held_out for generation in generations]
        for role, side in run.evolving.items():
            kept += [side.algorithm.genomes.tobytes(), side.hall_of_fame.champions.tobytes()]
            kept += [generation.trials[role].fitness.tobytes() for generation in generations]
        runs.append(kept)
    assert runs[0] == runs[1] != runs[2]


@pytest.mark.parametrize("kind", KINDS)
def test_genes_that_no_network_uses_stay_zero_in_a_run(kind: str):
    config = small(kind, n_trials=60, burst_after=2, mutation_rate=1.0)
    run = Coevolution(config, new_sides(config), FusedEvaluator(config.env, 1))
    for number in range(6):
        run.step(number)
    for role, side in run.evolving.items():
        controller = side_controller(config, role)
        for genomes in (side.algorithm.genomes, as_candidates(side.hall_of_fame.champions)):
            for network, n_used in enumerate(controller.used_genes):
                assert (genomes[:, network, ..., n_used:] == 0).all()
                assert (genomes[:, network, ..., :n_used] != 0).mean() > 0.99
