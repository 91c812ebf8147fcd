"""One generation's trials, played by the fused evaluator and by the reference."""

from __future__ import annotations

import numpy as np

from bench.page import Row, at_least
from bench.timing import measure, side_by_side
from bench.workload import TrainerScale, config_of, first_generation
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.reference import predprey_reference, team_of_trial
from esp_trainer.types import EvolvedTeams, ScriptedTeams, TeamBatch, TrialBatch, TrialResult
from predprey_env import PredPreyEnv


def rows(scale: TrainerScale) -> list[Row]:
    """Return the CPU seconds of each evaluator, and their ratio to those of the fused kernel."""
    config, linear = config_of(scale), config_of(scale, "linear")
    batch, linear_batch = first_generation(config), first_generation(linear)
    one, two = FusedEvaluator(config.env, threads=1), FusedEvaluator(config.env, threads=2)
    fused = one.evaluate(batch)
    check_agreement("two threads", two.evaluate(batch), fused)

    taken = side_by_side(
        {
            "fused": lambda: one.evaluate(batch),
            "linear": lambda: one.evaluate(linear_batch),
        },
        scale.repetitions,
    )
    base = taken["fused"].cpu
    by_threads = side_by_side({"1": lambda: one.evaluate(batch), "2": lambda: two.evaluate(batch)}, scale.repetitions)
    threads, speedup = by_threads["2"], by_threads["1"].wall / by_threads["2"].wall
    n_reference, reference = _reference(config, batch, fused, scale)
    n_played, n_asked = fused.steps.size, int(fused.steps.sum())

    limit = 0.10
    parts = _parts(scale, batch)
    return [
        Row(f"`fused`, {n_played:,} episodes of {n_asked:,} steps in all, one thread", f"{base:.4f} CPU-s"),
        Row(
            "the same with linear outputs (stretch)",
            f"{taken['linear'].cpu:.4f} CPU-s",
            f"{taken['linear'].cpu / base:.2f} x fused",
            f"≤ {limit:.2f} CPU-s",
            taken["linear"].cpu <= limit,
        ),
        Row(
            "`fused`, two threads",
            f"{threads.wall:.4f} s wall, {threads.cpu:.4f} CPU-s",
            f"one thread's wall {speedup:.2f} x",
            "≥ 1.8 x",
            at_least(speedup, 1.8),
        ),
        Row(
            f"`reference`, extrapolated from {n_reference} episodes",
            f"{reference:.3g} CPU-s",
            f"{reference / base:,.1f} x fused",
            "≥ 1,000 x",
            reference / base >= 1000,
        ),
        *[Row(f"- of `fused`: {name}", f"{cpu:.4f} CPU-s", f"{cpu / base:.2f} x fused") for name, cpu in parts.items()],
        *_reference_parts(config, batch),
    ]


def _parts(scale: TrainerScale, batch: TrialBatch) -> dict[str, float]:
    """Return the CPU seconds of the same trials with less to do, which say where the time goes."""
    config = config_of(scale)
    slim = {side: getattr(config, side).replace(n_hidden=1) for side in ("predators", "prey")}
    one = FusedEvaluator(config.env, threads=1)
    scripts = TrialBatch(ScriptedTeams("greedy_chase"), ScriptedTeams("flee_nearest"), batch.starts)
    slim_batch = first_generation(config.replace(**slim))
    taken = side_by_side(
        {
            "scripts instead of networks": lambda: one.evaluate(scripts),
            "one hidden neuron": lambda: one.evaluate(slim_batch),
        },
        scale.repetitions,
    )
    return {name: timing.cpu for name, timing in taken.items()}


def _reference_parts(config: RunConfig, batch: TrialBatch) -> list[Row]:
    """Return rows on the parts of a step of the reference evaluator."""
    env = PredPreyEnv(config.env)
    teams = [team_of_trial("predators", batch.predators, 0), team_of_trial("prey", batch.prey, 0)]
    observations, _ = env.reset(options={"starts": batch.starts[0, 0]})
    actions = teams[0].act(observations) | teams[1].act(observations)
    n_steps = 1000
    env.max_cycles = 100 * n_steps
    stepping = measure(lambda: [env.step(actions) for _ in range(n_steps)]).cpu / n_steps
    acting = measure(lambda: [team.act(observations) for _ in range(n_steps) for team in teams]).cpu / n_steps
    return [
        Row("- of a step of `reference`: the environment", f"{1e6 * stepping:.1f} us"),
        Row("- of a step of `reference`: five agents' networks", f"{1e6 * acting:.1f} us"),
    ]


def check_agreement(name: str, result: TrialResult, fused: TrialResult) -> None:
    """Raise :class:`RuntimeError` if another evaluator, or another number of threads, has other results."""
    if not all(
        np.array_equal(getattr(result, part), getattr(fused, part)) for part in ("fitness", "captured", "steps")
    ):
        raise RuntimeError(f"{name} must play as fused does")


def _reference(config: RunConfig, batch: TrialBatch, fused: TrialResult, scale: TrainerScale) -> tuple[int, float]:
    """Return the number of episodes that the reference played, and its CPU seconds for as many steps as the others."""
    few = scale.reference_trials
    evaluator = predprey_reference(config.env)
    sample = TrialBatch(_first(batch.predators, few), _first(batch.prey, few), batch.starts[:few, :1])
    expected = TrialResult(fused.fitness[:few, :1], fused.captured[:few, :1], fused.steps[:few, :1])
    check_agreement("reference", evaluator.evaluate(sample), expected)
    seconds = measure(lambda: evaluator.evaluate(sample))
    return few, seconds.cpu * float(fused.steps.sum() / expected.steps.sum())


def _first(teams: TeamBatch, n_trials: int) -> TeamBatch:
    """Return the teams of the first trials."""
    if not isinstance(teams, EvolvedTeams):
        return teams
    return EvolvedTeams(teams.controller, teams.genomes, teams.indices[:n_trials])
