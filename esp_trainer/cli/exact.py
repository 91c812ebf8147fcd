"""``solve`` and ``exploitability``: optimal play on a small torus, and the exploitability of a policy there."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from tqdm import tqdm

from esp_trainer.benchmark.specs import load_candidate
from esp_trainer.cli.candidate import tell_about
from esp_trainer.cli.streams import say
from esp_trainer.exact.chances import chances, survivors
from esp_trainer.exact.duration import sample_of, seconds_to_answer, seconds_to_solve
from esp_trainer.exact.parity import by_parity
from esp_trainer.exact.response import best_responses, exploitability_from, memory_for_response
from esp_trainer.exact.solution import Solution, check_memory, memory_needed
from esp_trainer.exact.solution import solve as solve_game
from esp_trainer.files import check_place
from esp_trainer.types import Role
from predprey_env.config import EnvConfig
from predprey_env.settings import counted

_UNITS: tuple[tuple[str, int], ...] = (("days", 86400), ("hours", 3600), ("minutes", 60))
_WIDTH = 9


def solve(config: EnvConfig, out: Path | None) -> int:
    """Solve the game of a world, print its value, and save the solution."""
    if out:
        check_place(out)
    horizon = config.max_cycles
    _promise_memory(memory_needed(config, horizon))
    _promise_time(seconds_to_solve(config, horizon))
    solution = _solved(config)
    print(f"{_words(config)}, both sides playing optimally: the fraction of prey caught")
    _tell_heads(by_parity(solution, horizon)[1])
    print("  within steps")
    for steps in sorted({*range(1, horizon, max(1, horizon // 10)), horizon}):
        _tell(f"{steps}", *by_parity(solution, steps))
    if out:
        solution.save(out)
        print(f"the solved game is in {out}: {out.stat().st_size / 1e6:,.1f} MB")
    return 0


def exploitability(spec: str, role: Role, config: EnvConfig, *, drawn: bool) -> int:
    """Solve the game, compute the best response to a policy, and print the policy's exploitability."""
    horizon = config.max_cycles
    candidate = load_candidate(spec, role, config, drawn=drawn)
    tell_about(candidate)
    _promise_memory(memory_needed(config, horizon) + memory_for_response(config, role))
    sample, to_ask = sample_of(candidate.player, role, config)
    _promise_time(to_ask + seconds_to_solve(config, horizon) + seconds_to_answer(sample, role, config, horizon))
    n_positions = survivors(config)[-1].keys.stop
    say(f"asking the policy in {n_positions:,} positions ...")
    with tqdm(total=n_positions, unit="position", disable=not sys.stderr.isatty(), desc="asking the policy") as bar:
        # Before the game is solved, which takes long, because this fails for policies that cannot be asked everywhere.
        fixed = chances(candidate.player, role, config, bar.update)
    solution = _solved(config)
    with tqdm(total=horizon, unit="step", disable=not sys.stderr.isatty(), desc="best response") as bar:
        values = np.empty(0)
        for values in best_responses(fixed, role, config, horizon):  # noqa: B007 - only the last values are used
            bar.update()
    found = exploitability_from(values, role, solution, horizon)
    print(f"{spec}, {role} on {_words(config)}: the fraction of prey caught")
    _tell_heads(found.optimal_by_even)
    _tell("when both sides play optimally", found.optimal, found.optimal_by_even)
    _tell("against the best response to this policy", found.exploited, found.exploited_by_even)
    print(f"exploitability: {found.loss:z.3f} of the prey")
    return 0


def _promise_memory(needed: int) -> None:
    """Print how much memory is needed; raise an error if it is not available."""
    check_memory(needed)
    say(f"some {max(1, needed / 1e6):,.0f} MB of memory are needed")


def _promise_time(seconds: float) -> None:
    """Print the estimated time on an idle machine; a busy one takes longer."""
    unit, length = next((each for each in _UNITS if seconds >= 2 * each[1]), ("s", 1))
    say(f"estimated time: {max(1, seconds / length):,.0f} {unit} on an idle machine")


def _solved(config: EnvConfig) -> Solution:
    plain = not sys.stderr.isatty()
    with tqdm(
        total=100, disable=plain, desc="solving", bar_format="{desc} {percentage:3.0f}% |{bar}| {remaining}"
    ) as bar:
        return solve_game(config, config.max_cycles, lambda fraction: bar.update(100 * fraction - bar.n))


def _words(config: EnvConfig) -> str:
    idle = "" if config.predator_idle else ", predators may not idle"
    order = ", the prey move first" if config.move_order == "prey_first" else ""
    teams = f"{config.n_predators} v {config.n_prey}"
    return f"a torus of {config.size} x {config.size}, {teams}, {counted(config.max_cycles, 'step')}{idle}{order}"


def _tell_heads(by_even: list[float]) -> None:
    pairs = "".join(f"{n:>{_WIDTH}}" for n, value in enumerate(by_even) if not np.isnan(value))
    print(f"  {'by predator-prey pairs that start an even distance apart':56}{'all':>{_WIDTH}}{pairs}")


def _tell(what: str, mean: float, by_even: list[float]) -> None:
    cells = "".join(f"{value:>{_WIDTH}.3f}" for value in by_even if not np.isnan(value))
    print(f"  {what:56}{mean:>{_WIDTH}.3f}{cells}")
