"""Runs of controllers that are not one network for each opponent: trained, resumed, shown and played."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.esp.team import Team

if TYPE_CHECKING:
    from collections.abc import Callable


def _options(kind: str) -> list[str]:
    return ["--predators.controller", kind, "--prey.controller", kind, "--esp.hof_mates", "2", "--quiet"]


def _shown(outcome: Any) -> dict[str, str]:
    """The lines that ``show`` prints below the first, by name."""
    return {line[2:14].strip(): line[14:] for line in outcome.out.splitlines()[1:]}


def _champion(run: Path | str, role: str, generation: int) -> Path:
    return Path(run) / f"champions/{role}-{generation:05}.safetensors"


@pytest.mark.parametrize(
    ("kind", "predators", "prey"),
    [
        (
            "combiner",
            ("3 an agent (combiner), 2-10-5 and 10-10-5, logistic outputs", 3 * 10 * (7 + 7 + 15)),
            ("4 an agent (combiner), 2-10-4 and 12-10-4, logistic outputs", 2 * 10 * (3 * 6 + 16)),
        ),
        (
            "double",
            ("4 an agent (double), 2-10-5, logistic outputs", 3 * 4 * 10 * 7),
            ("6 an agent (double), 2-10-4, logistic outputs", 2 * 6 * 10 * 6),
        ),
        (
            "pairs",
            ("1 an agent (pairs), 4-10-5, logistic outputs", 3 * 10 * 9),
            ("3 an agent (pairs), 4-10-4, logistic outputs", 2 * 3 * 10 * 8),
        ),
        (
            "central",
            ("1 in all (central), 12-10-15, logistic outputs", 10 * 27),
            ("1 in all (central), 12-10-8, logistic outputs", 10 * 20),
        ),
    ],
)
def test_show_counts_the_networks_and_the_genes_that_they_use(
    kind: str, predators: tuple[str, int], prey: tuple[str, int], esp_trainer: Callable[..., Any]
) -> None:
    assert esp_trainer("train", "smoke", "--generations", "1", "--out", "run", *_options(kind)).code == 0
    for role, n_agents, n_seen, (networks, n_genes) in (("predators", 3, 4, predators), ("prey", 2, 6, prey)):
        path = _champion("run", role, 0)
        outcome = esp_trainer("show", path)
        assert (outcome.code, outcome.err) == (0, "")
        assert outcome.out.splitlines()[0] == f"{path}: {n_agents} {role}"
        lines = _shown(outcome)
        assert lines["networks"] == networks
        assert lines["genes"].startswith(f"{n_genes}, from -")
        assert lines["changed"] == f"predators.controller={kind}, prey.controller={kind}"
        team = Team.load(path)
        assert (team.n_agents, team.n_seen) == (n_agents, n_seen)
        assert np.count_nonzero(team.genomes) == n_genes


@pytest.mark.parametrize("kind", ["combiner", "central"])
def test_a_run_that_is_resumed_ends_like_one_that_went_through(kind: str, esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("train", "smoke", "--generations", "6", "--out", "whole", *_options(kind)).code == 0
    assert esp_trainer("train", "smoke", "--generations", "3", "--out", "parts", *_options(kind)).code == 0
    outcome = esp_trainer("resume", "parts", "--generations", "6", "--quiet")
    assert outcome.code == 0, outcome.err
    assert "going on with parts from generation 3" in outcome.err
    whole, parts = (
        {str(file.relative_to(run)): file.read_bytes() for file in Path(run).rglob("*.safetensors")}
        for run in ("whole", "parts")
    )
    assert whole.keys() == parts.keys()
    assert len(whole) == 2 * 6 + 1
    for name in whole:
        if name.startswith("champions"):
            assert parts[name] == whole[name], name
    assert Path("whole/metrics.jsonl").read_bytes() == Path("parts/metrics.jsonl").read_bytes()


@pytest.mark.parametrize("kind", ["combiner", "double", "pairs", "central"])
def test_their_champions_can_be_evaluated_and_replayed(kind: str, esp_trainer: Callable[..., Any]) -> None:
    esp_trainer("train", "smoke", "--generations", "2", "--out", "run", *_options(kind))
    predators, prey = _champion("run", "predators", 1), _champion("run", "prey", 1)
    for first, against in ((predators, prey), (predators, "flee_nearest"), (prey, "greedy_chase")):
        for command, *options in (("evaluate", "--episodes", "50"), ("replay",)):
            outcome = esp_trainer(command, first, "--against", against, *options)
            assert (outcome.code, outcome.err) == (0, "")


def test_a_run_may_share_fitness_and_resumes_with_it(esp_trainer: Callable[..., Any]) -> None:
    logs = {}
    for name, sharing in (("plain", "false"), ("shared", "true")):
        options = ["--esp.past_share", "0.5", "--esp.fitness_sharing", sharing, "--quiet", "--out", name]
        assert esp_trainer("train", "smoke", "--generations", "2", *options).code == 0
        assert esp_trainer("resume", name, "--generations", "4", "--quiet").code == 0
        logs[name] = [json.loads(line) for line in Path(name, "metrics.jsonl").read_text().splitlines()]
    plain, shared = (log[0] for log in logs.values())
    assert (plain["trials"], plain["held_out"]) == (shared["trials"], shared["held_out"])
    assert all(plain != shared for plain, shared in zip(logs["plain"][1:], logs["shared"][1:], strict=True))
    assert _shown(esp_trainer("show", _champion("shared", "prey", 3)))["changed"] == (
        "esp.past_share=0.5, esp.fitness_sharing=True"
    )
