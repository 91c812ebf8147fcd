"""The numbers and tables of ``docs/reproduction.md`` and its supplement, whose text is in ``page.md`` and beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from study import fill, table

from esp_trainer.analysis.games import exploitability_of_generations, solve_matrix
from esp_trainer.analysis.progress import dominant_generations, historical_progress
from esp_trainer.analysis.ratings import rate
from esp_trainer.files import write_text
from esp_trainer.types import ROLES
from reproduction.cells import All, mean, p_value, rows_of, strengths
from reproduction.claims import Verdict
from reproduction.rankings import levels, progress_and_level, ranked
from reproduction.results import StudyResults
from reproduction.settings import PARITY

PLACE = Path(__file__).parent
TASKS = {"paper-3v1": "one prey", "paper-3v2": "two prey"}
PAPER = ("monolithic-3v1", "monolithic-3v1-wide", "paper-3v1", "monolithic-3v2", "paper-3v2")
HIGH = ("baiting", "sidestepping", "reversal", "herding", "simultaneous capture", "scattering", "encirclement")
"""High-level strategies of the paper for which there is a detector."""
LOW = ("attacker", "blocker", "circling")
CYCLES = ("paper", "odd-torus", "prey-first", "no-idling", "scaled", "modern", "linear", "drawn")


def write(results: All, verdicts: Sequence[Verdict], made_by: str, out: Path) -> None:
    """Write the page, a short paper, and its supplement: every claim and every setting in tables."""
    words = [verdict.word for verdict in verdicts]
    common = {
        "made_by": made_by,
        "tally": ", ".join(f"{words.count(word)} {word}" for word in ("supported", "not supported", "undecided")),
        "n_claims": len(verdicts),
        "n_runs": sum(found.n_seeds for found in results.values()),
        "n_settings": len(results),
    }
    write_text(out / "reproduction.md", fill(PLACE / "page.md", common | _abstract(results)))
    sensitivity = [each for each in results.values() if each.setting.part == "sensitivity"]
    short = sensitivity[0]["curve.caught"].shape[1] if sensitivity else None
    tables = {
        "claims": _claims(verdicts),
        "alternations": _alternations(results),
        "progress": _progress(results),
        "parity": _parity(results),
        "beneath": _beneath(results),
        "cycles": _cycles(results),
        "games": _games(results),
        "exploitable": _exploitable(results),
        "watched": max((found["watched"].shape[1] for found in results.values() if "watched" in found), default=None),
        "behaviours": _behaviours(results),
        "ablations": progress_and_level(results, ("paper", "ablation")),
        "generations": short,
        "sensitivity": progress_and_level(results, ("sensitivity",), short),
        "sensitivity_ranked": ranked(results, ("sensitivity", "ablation"), short),
        "strongest": progress_and_level(results, ("combination", "modern")),
        "combined": ranked(results, ("combination",)),
        "confirmed": ranked(results, ("modern",)),
        "levels": levels(results),
    }
    write_text(out / "reproduction" / "supplement.md", fill(PLACE / "supplement.md", common | tables))


def _abstract(results: All) -> dict[str, object]:
    """Return the answers to the two hypotheses of section IV."""
    found = {name: results[name] for name in TASKS if name in results}

    def by_task(number: Callable[[StudyResults], object], between: str = "; ") -> str:
        return between.join(f"{number(each)} with {TASKS[name]}" for name, each in found.items())

    def late(each: StudyResults) -> str:
        return " and ".join(strengths(each.global_progress(since=each.halfway)))

    def most_of_gain(each: StudyResults) -> int:
        """Return the generation by which the predators' mean curve has made nine tenths of its gain."""
        curve = np.mean([both.predators.curve for both in each.global_progress()], axis=0)
        return int(each.generations[np.argmax(curve >= curve[0] + 0.9 * (curve.max() - curve[0]))])

    def rates(name: str) -> str:
        return " and ".join(f"{np.nanmean(each.behaviour(name)):.2f}" for each in found.values())

    high = [each.behaviour(name) for each in found.values() for name in HIGH if f"behaviour.{name}" in each]
    return {
        "race": by_task(lambda each: mean(each.two_sided(), 3)),
        "late": by_task(late),
        "early": by_task(most_of_gain, ", "),
        "low": "; ".join(f"{name} {rates(name)}" for name in LOW),
        "high": 100 * max((np.nanmean(each) for each in high if not np.isnan(each).all()), default=0.0),
        "n_seeds": max((each.n_seeds for each in results.values()), default=0),
    }


def _claims(verdicts: Iterable[Verdict]) -> str:
    heads = ["section", "the paper says", "measured", "value [95% interval]", "effect", "p", "verdict", "figure"]
    rows = []
    for verdict in verdicts:
        claim, found = verdict.claim, verdict.found
        value, p = found.interval, p_value(verdict.p)
        figure = f"[{claim.figure}]({claim.figure}.png)"
        words = [claim.section, claim.says, claim.measured]
        rows.append([*words, value, f"{found.effect:+.2f}", p, f"**{verdict.word}**", figure])
    return table(heads, rows)


def _alternations(results: All) -> str:
    lines = []
    for name in ("paper-3v1", "paper-3v2", "monolithic-3v1", "monolithic-3v2"):
        if found := results.get(name):
            count = np.mean([each.count for each in found.alternations])
            cycles = f"cycles in {sum(found.cycling())} of {found.n_seeds} seeds"
            lines.append(f"- `{name}`: {count:.1f} alternations a run; {cycles}.")
    return "\n".join(lines)


def _progress(results: All) -> str:
    """Return progress against own and against held-out opponents."""

    def row(found: StudyResults) -> list[str]:
        second = found.global_progress(since=found.halfway)
        return [
            cell for both in (found.historical_progress(), found.global_progress(), second) for cell in strengths(both)
        ]

    kinds = ("historical", "global", "global, second half")
    heads = ["setting", *(f"{kind}, {role}" for kind in kinds for role in ROLES)]
    return table(heads, rows_of(results, PAPER, row))


def _parity(results: All) -> str:
    """Return captures by the parity of the start, and when predators overcome it."""

    def row(found: StudyResults) -> list[str]:
        late = found["curve.caught_by_even"].astype(float)
        late = np.nan_to_num(late[:, -(late.shape[1] // 3) :].mean(axis=1))
        return [*(mean(late[:, even]) for even in range(late.shape[1])), _overcome(found)]

    heads = ["setting", "0 even", "1 even", "2 even", "3 even", "parity overcome"]
    return table(heads, rows_of(results, PARITY, row))


def _overcome(found: StudyResults) -> str:
    """Return when predators first catch at least half of the prey that none of them starts at an even distance from."""
    curves = np.nan_to_num(found["curve.caught_by_even"][:, :, 0].astype(float))
    window = min(10, curves.shape[1])
    means = [np.convolve(curve, np.ones(window) / window, "valid") for curve in curves]
    first = sorted(int(np.argmax(curve >= 0.5)) for curve in means if (curve >= 0.5).any())
    when = f" (generations {', '.join(map(str, first))})" if first else ""
    return f"{len(first)} of {len(curves)} seeds{when}"


def _beneath(results: All) -> str:
    """Return progress in the second half of the run within each parity."""
    rows = []
    for name in ("paper-3v1", "scaled-3v1"):
        if found := results.get(name):
            late = found.generations >= found.halfway
            for even in range(found["own.captured"].shape[-1]):
                shares = found["own.captured"][..., even] / np.maximum(found["met"][:, even], 1)[:, None, None]
                both = [historical_progress(caught[late][:, late]) for caught in shares]
                rows.append([f"`{name}`", str(even), *strengths(both)])
    return table(["setting", "predators at an even distance", "predators' progress", "prey's progress"], rows)


def _cycles(results: All) -> str:
    """Return how often success alternates, and how much of who beats whom no ladder explains."""

    def row(found: StudyResults) -> list[str]:
        count = [each.count for each in found.alternations]
        return [mean(count, 1), f"{sum(found.cycling())} of {found.n_seeds}", mean(found.cyclic_share())]

    names = [f"{name}-3v1" for name in CYCLES]
    names += [f"{name}-3v2" for name in ("paper", "prey-first", "linear", "drawn")]
    heads = ["setting", "alternations a run", "seeds with cycles", "depends on the opponent"]
    return table(heads, rows_of(results, names, row))


def _games(results: All) -> str:
    """Return the empirical game of each run's generations."""

    def row(found: StudyResults) -> list[str]:
        sixth, games = found.caught.shape[1] // 6, [solve_matrix(caught) for caught in found.caught]
        lost = [[side[-sixth:].mean() for side in exploitability_of_generations(caught)] for caught in found.caught]
        rated = [rate(caught, found.episodes, np.random.default_rng(0), n_resamples=2) for caught in found.caught]
        gained = [[side.rating[-sixth:].mean() - side.rating[:sixth].mean() for side in both] for both in rated]
        dominant = [len(dominant_generations(caught, found.episodes)) for caught in found.caught]
        support = np.mean([game.support for game in games], axis=0)
        return [
            mean([game.value for game in games]),
            f"{support[0]:.1f} and {support[1]:.1f}",
            *(mean(side) for side in np.transpose(lost)),
            mean(dominant, 1),
            *(mean(side, 0) for side in np.transpose(gained)),
        ]

    heads = ["setting", "value", "in the mixtures, predators and prey", "late predators lose", "late prey lose"]
    heads += ["dominant generations", "rating gained, predators", "rating gained, prey"]
    return table(heads, rows_of(results, PAPER, row))


def _exploitable(results: All) -> str | None:
    """Return what fresh evolution takes from the last generation."""
    names = [name for name, found in results.items() if "response.predators" in found]

    def row(found: StudyResults) -> list[str]:
        hunts, flees = found["response.predators"], found["response.prey"]
        return [mean(hunts[:, 0]), mean(hunts[:, 1]), mean(flees[:, 1])]

    heads = ["setting", "last generation, both sides", "fresh predators against its prey"]
    heads += ["its predators against fresh prey"]
    return table(heads, rows_of(results, names, row)) if names else None


def _behaviours(results: All) -> str | None:
    """Return every behaviour's rate in both tasks."""
    arms = [name for name in TASKS if name in results]
    if not arms:
        return None
    names = [key.removeprefix("behaviour.") for key in results[arms[-1]].arrays if key.startswith("behaviour.")]
    rows = []
    for name in names:
        cells = [name]
        for arm in arms:
            rates = results[arm].behaviour(name)
            if np.isnan(rates).all():
                cells += ["-", "-"]
            else:
                peaks = np.nanmax(rates, axis=1)
                cells += [mean(np.nanmean(rates, axis=1)), f"{np.median(peaks):.2f}, {peaks.max():.2f}"]
        rows.append(cells)
    heads = [head for arm in arms for head in (f"`{arm}`, mean", "peak: median seed, best seed")]
    return table(["behaviour", *heads], rows)
