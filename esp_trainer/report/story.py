"""The summary at the top of a report, in up to five sentences with numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from esp_trainer.analysis.games import Sides, transitive_share
from esp_trainer.analysis.inference import MIN_SEEDS, against, over_seeds
from esp_trainer.analysis.progress import Progress, early_late, two_sided
from esp_trainer.report.measure import SHOWN, MeasuredRuns, appeared
from esp_trainer.types import ROLES, Role

NOTABLE = 0.02
"""Minimum gain, as a fraction of the prey, at which a side is said to have become better in one or two runs. With three
or more runs the interval decides."""


def story(runs: Sequence[MeasuredRuns]) -> list[str]:
    """Return lines about progress, results against other opponents, cycles, phases, and behaviours of the runs."""
    lines = [_progress(runs), _met_others(runs) or _corners(runs), _circles(runs), _phases(runs), _behaviours(runs)]
    return [line for line in lines if line]


def _progress(runs: Sequence[MeasuredRuns]) -> str:
    both = [run.progress for run in runs if run.progress]
    if not both:
        return _without_progress(runs)
    return f"{_verdict(_strengths(both))}: against the same opponents of their run, {_gains(both)}."


def _met_others(runs: Sequence[MeasuredRuns]) -> str:
    both = [run.met_others for run in runs if run.met_others]
    if not both:
        return ""
    p = f", p {against(list(map(two_sided, both))).p:.2g}" if len(both) >= MIN_SEEDS else ""
    return f"Against opponents of other seeds, whom they never met, {_gains(both)}{p}."


def _strengths(both: Sequence[Sides[Progress]]) -> dict[Role, list[float]]:
    return {role: [getattr(each, role).strength for each in both] for role in ROLES}


def _gains(both: Sequence[Sides[Progress]]) -> str:
    strengths = _strengths(both)
    return (
        f"from early to late predators gain {_figure(strengths['predators'], '+')} of the prey, and prey "
        f"{_figure(strengths['prey'], '+')}; the lesser of the two {_figure([two_sided(each) for each in both], '+')}"
    )


def _verdict(strengths: dict[Role, list[float]]) -> str:
    """Say which sides became better.

    With one or two runs, a side became better if it gained more than :data:`NOTABLE` in each. With more, it did if the
    interval of its gain lies above 0.
    """
    n = len(strengths["prey"])
    better = [
        role
        for role, values in strengths.items()
        if (min(values) > NOTABLE if n < MIN_SEEDS else over_seeds(values).low > 0)
    ]
    if n == 1:
        who = "both sides" if len(better) == 2 else f"only the {better[0]}" if better else "neither side"
        return f"In this run {who} got better"
    if n < MIN_SEEDS:
        who = "Both sides" if len(better) == 2 else f"Only the {better[0]}" if better else "No side"
        return f"{who} got better in each of the two runs"
    if len(better) == 2:
        return "Both sides made progress"
    return (
        f"The {better[0]} made progress, the other side none that can be shown"
        if better
        else "No progress can be shown"
    )


def _figure(values: list[float], sign: str = "") -> str:
    """Return a mean over runs as text, with its interval for three runs or more."""
    if len(values) < MIN_SEEDS:
        return f"{np.mean(values):{sign}z.2f}"
    estimate = over_seeds(values)
    return f"{estimate.mean:{sign}z.2f} [{estimate.low:{sign}z.2f}, {estimate.high:{sign}z.2f}]"


def _without_progress(runs: Sequence[MeasuredRuns]) -> str:
    """Return the line for runs in which only one side evolved, or that are too short to measure progress."""
    curves = [run.own.caught.ravel() for run in runs if run.own]
    if not curves:
        return "No champion could be read, so nothing can be said of progress."
    if len(curves[0]) == 1:
        return "The champions of one generation say nothing of progress."
    sixth = max(1, len(curves[0]) // 6)
    early, late = ([float(curve[part].mean()) for curve in curves] for part in (slice(sixth), slice(-sixth, None)))
    config = runs[0].source.config
    script = next(policy for policy in (config.predators.policy, config.prey.policy, "nobody") if policy != "esp")
    return (
        f"Against the script {script}: {_figure(early)} of the prey were caught early in the run, {_figure(late)} late."
    )


def _corners(runs: Sequence[MeasuredRuns]) -> str:
    corners = [early_late(run.own.caught) for run in runs if run.own and run.progress]
    if not corners:
        return ""
    names = ("early_hunt_early", "late_hunt_early", "early_hunt_late", "late_hunt_late")
    found = {name: _figure([getattr(corner, name) for corner in corners]) for name in names}
    return (
        f"Early predators catch {found['early_hunt_early']} of early prey, late ones {found['late_hunt_early']}; "
        f"of late prey early predators catch {found['early_hunt_late']}, late ones {found['late_hunt_late']}."
    )


def _circles(runs: Sequence[MeasuredRuns]) -> str:
    played = [run.own for run in runs if run.own and run.progress]
    shares = [1 - transitive_share(own.caught, own.n_episodes) for own in played]
    known = [share for share in shares if not np.isnan(share)]
    if not known:
        return ""
    if max(known) < 0.005:
        return "Who beats whom is a ladder of strength: that any of it depends on the opponent cannot be shown."
    return (
        f"Of who beats whom, {_figure(known)} depends on the opponent, as in rock, paper, scissors; the rest is a "
        "ladder of strength."
    )


def _phases(runs: Sequence[MeasuredRuns]) -> str:
    dated = [run for run in runs if run.alternation]
    if not dated:
        return ""
    if len(runs) > 1:
        counts = sorted({len(run.phases) for run in dated})
        many = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
        to_and_fro = sum(run.alternation.count > 1 and run.alternation.p <= 0.05 for run in dated if run.alternation)
        return (
            f"Success has {many} phase{'s' if counts[-1] > 1 else ''} a run; in {to_and_fro} of {len(dated)} runs it "
            "goes to and fro: it crosses its mean more than once, and as often by chance with p of at most 0.05."
        )
    (run,) = dated
    assert run.alternation is not None
    if len(run.phases) == 1:
        return f"Success has no phases: {run.phases[0].mean:.2f} of the prey are caught from first to last."
    changes = ", ".join(f"{phase.mean:.2f} from generation {phase.start}" for phase in run.phases)
    return (
        f"Success has {len(run.phases)} phases, by the prey caught: {changes}. It crosses its mean "
        f"{_times(run.alternation.count)}; by chance as often with p = {run.alternation.p:.2g}."
    )


def _times(n: int) -> str:
    return {0: "never", 1: "once", 2: "twice"}.get(n, f"{n} times")


def _behaviours(runs: Sequence[MeasuredRuns]) -> str:
    watched = [run.watched for run in runs if run.watched]
    if not watched:
        return ""
    seen, absent = [], []
    for name in SHOWN:
        rates = np.mean([each.excess(name) for each in watched], axis=0)
        if np.isnan(rates).all():
            continue
        top = int(np.nanargmax(rates))
        if appeared(watched, name):
            seen.append(
                (float(rates[top]), f"{name} ({100 * rates[top]:.0f}% at generation {watched[0].generations[top]})")
            )
        else:
            absent.append(name)
    words = "; ".join(word for _, word in sorted(seen, reverse=True)) or "none"
    rest = f" Next to none: {', '.join(absent)}." if absent else ""
    return f"Behaviours beyond chance, with their peaks: {words}.{rest}"
