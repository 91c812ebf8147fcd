"""Cost of replacing a part: controllers, networks, what agents see, algorithms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bench.page import Row
from bench.timing import measure, side_by_side
from bench.workload import TrainerScale, config_of, first_generation
from esp_trainer.algorithms import ALGORITHMS
from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides, side_controller
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.networks import NETWORKS
from esp_trainer.types import ROLES
from predprey_env.config import SIGHT_OPTIONS

LIMIT = 3.0
"""Largest cost relative to the built-in part."""

REPLACED_PARTS: dict[str, dict[str, Any]] = {
    **{f"`{name}` controllers": {"controller": name} for name in ("monolithic", "combiner", "double", "central")},
    **{f"`{name}` networks": {"network": name} for name in NETWORKS if name != "feedforward"},
    "networks of a user, with the arithmetic of the paper's": {"network": "bench.own_parts:OwnNetwork"},
}


def rows(scale: TrainerScale) -> list[Row]:
    """Return what each part costs, relative to the paper's."""
    return [*_playing(scale), *_generations(scale)]


def _playing(scale: TrainerScale) -> list[Row]:
    """Return rows on the trials of a generation with other controllers, networks and sights."""
    plain = config_of(scale)
    configs = {
        name: plain.replace(**dict.fromkeys(ROLES, plain.predators.replace(**p))) for name, p in REPLACED_PARTS.items()
    }
    configs["everything seen (`see_*`)"] = plain.replace(env=plain.env.replace(**dict.fromkeys(SIGHT_OPTIONS, True)))
    own = plain.env.replace(observation="bench.own_parts:OwnSight")
    configs["an observation of a user, with the arithmetic of the paper's"] = plain.replace(env=own)
    compiling = {name: _first_seconds(config) for name, config in configs.items()}
    taken = side_by_side({"": _trials(plain), **{n: _trials(c) for n, c in configs.items()}}, scale.repetitions)
    base, found = taken[""].cpu, []
    for name, config in configs.items():
        ratio, genes = taken[name].cpu / base, _n_genes(config) / _n_genes(plain)
        for_its_genes = ratio / genes
        figure = f"{taken[name].cpu:.4f} CPU-s"
        words = f"{ratio:.2f} x fused, {for_its_genes:.2f} x for {genes:.2f} x as many genes"
        found.append(Row(f"trials with {name}", figure, words, f"≤ {LIMIT:.0f} x", for_its_genes <= LIMIT))
    slowest = max(compiling, key=lambda name: compiling[name])
    found.append(Row(f"the first trials with {slowest}: compiling, or loading", f"{compiling[slowest]:.1f} s wall"))
    return found


def _trials(config: RunConfig) -> Callable[[], object]:
    evaluator, batch = FusedEvaluator(config.env, threads=1), first_generation(config)
    return lambda: evaluator.evaluate(batch)


def _first_seconds(config: RunConfig) -> float:
    return measure(_trials(config)).wall


def _n_genes(config: RunConfig) -> int:
    """Return the number of genes that all agents of both teams read in a step."""
    found = 0
    for role in ROLES:
        each, n_agents = side_controller(config, role), config.env.team(role).n_agents
        of_others = (each.n_together - 1) * each.n_actions  # output weights of a central controller's other agents
        found += n_agents * each.n_hidden * sum(n - of_others for n in each.used_genes)
    return found


def _generations(scale: TrainerScale) -> list[Row]:
    """Return rows on a generation that other algorithms breed."""
    plain = config_of(scale)

    def generation(name: str) -> Callable[[], object]:
        config = plain.replace(**dict.fromkeys(ROLES, plain.predators.replace(algorithm=name)))
        run = Coevolution(config, new_sides(config), FusedEvaluator(config.env, threads=1))
        run.step(0)
        return lambda: run.play(1)

    taken = side_by_side({name: generation(name) for name in ALGORITHMS}, max(1, scale.repetitions // 3))
    base = taken["esp"].cpu
    return [
        Row(
            f"a generation by `{name}`",
            f"{seconds.cpu:.4f} CPU-s",
            f"{seconds.cpu / base:.2f} x `esp`",
            f"≤ {LIMIT:.0f} x" if name != "esp" else "",
            seconds.cpu / base <= LIMIT if name != "esp" else None,
        )
        for name, seconds in taken.items()
    ]
