"""The story of a report: up to five lines in words, each with its figures on demand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.games import Sides, transitive_share
from esp_trainer.analysis.inference import MIN_SEEDS, against, over_seeds
from esp_trainer.analysis.progress import Progress, early_late, two_sided
from esp_trainer.report.measure import REPORTED_BEHAVIOURS, MeasuredRuns, appeared, never_seen, why_undated
from esp_trainer.report.verdict import notable, payoff_in_short, payoff_in_words, script_of, swings, why_unknown, won
from esp_trainer.types import ROLES, Role
from predprey_env.settings import counted

NAMED = 3
"""Maximum number of phases or behaviours that a line names."""


@dataclass(frozen=True)
class Line:
    """A line of the story."""

    words: str
    figures: str = ""
    """Numbers behind the words; empty if there are none."""


def story(runs: Sequence[MeasuredRuns]) -> list[Line]:
    """Return lines about progress, results against other opponents, cycles, phases, and behaviours of the runs."""
    known = [run for run in runs if not why_unknown(run)]
    if not known and why_unknown(runs[0]) == why_undated(runs):  # the same reason is given once
        lines = [Line(f"Nothing can be said of progress or phases: {why_undated(runs)}."), _behaviours(runs)]
        return [line for line in lines if line]
    of_progress = (
        [_progress(known), _met_others(known) or _corners(known), _circles(known)]
        if known
        else [Line(f"Nothing can be said of progress: {why_unknown(runs[0])}.")]
    )
    return [line for line in [*of_progress, _phases(runs), _behaviours(runs)] if line]


def _progress(runs: Sequence[MeasuredRuns]) -> Line:
    both = [run.progress for run in runs if run.progress]
    if not both:
        return _without_progress(runs)
    better, winners = _improved(both, runs), [winner[0] for run in runs if (winner := won(run))]
    words = f"{_who(better, len(both))} against the same opponents of the run."
    if winners and len(better) == 2:  # a side that was left behind did not simply "get better"
        words = _left_behind(winners, len(runs))
    return Line(words, f"Against the same opponents of the run, {_gains(both, runs)}.")


def _left_behind(winners: Sequence[Role], n_runs: int) -> str:
    if n_runs == 1:
        loser = "prey" if winners[0] == "predators" else "predators"
        return f"The {winners[0]} left the {loser} behind: late {loser} gained on early opponents only."
    return (
        "Late champions of both sides do better than early ones against the same opponents of their run, and yet in "
        f"{len(winners)} of {n_runs} runs one side won."
    )


def _met_others(runs: Sequence[MeasuredRuns]) -> Line | None:
    both = [run.met_others for run in runs if run.met_others]
    if not both:
        return None
    p = f", p {against(list(map(two_sided, both))).p:.2g}" if len(both) >= MIN_SEEDS else ""
    words = f"{_who(_improved(both, runs), len(both))} against opponents of other seeds, whom they never met."
    if any(map(won, runs)) and len(_improved(both, runs)) == 2:
        words = "Late champions of both sides do better than early ones against opponents of other seeds too."
    return Line(words, f"Against opponents of other seeds, {_gains(both, runs)}{p}.")


def _strengths(both: Sequence[Sides[Progress]]) -> dict[Role, list[float]]:
    return {role: [getattr(each, role).strength for each in both] for role in ROLES}


def _gains(both: Sequence[Sides[Progress]], runs: Sequence[MeasuredRuns]) -> str:
    strengths, unit = _strengths(both), "of the prey" if runs[0].captures else "in payoff"
    return (
        f"from early to late predators gain {_figure(strengths['predators'], '+')} {unit}, and prey "
        f"{_figure(strengths['prey'], '+')}; the smaller gain is {_figure([two_sided(each) for each in both], '+')}"
    )


def _improved(both: Sequence[Sides[Progress]], runs: Sequence[MeasuredRuns]) -> list[Role]:
    """Return the sides that became better.

    With one or two runs, a side became better if it gained a :func:`~.verdict.notable` amount in each. With more, it
    did if the interval of its gain lies above 0.
    """
    few = len(both) < MIN_SEEDS
    gains, least = _strengths(both), max(notable(run.own) for run in runs)
    return [role for role in ROLES if (min(gains[role]) > least if few else over_seeds(gains[role]).low > 0)]


def _who(better: Sequence[Role], n_runs: int) -> str:
    where = "" if n_runs == 1 else " in each of the two runs" if n_runs < MIN_SEEDS else " over the runs"
    who = "Both sides" if len(better) == 2 else f"Only the {better[0]}" if better else "Neither side"
    return f"{who} got better{where}"


def _figure(values: list[float], sign: str = "") -> str:
    """Return a mean over runs as text, with its interval for three runs or more."""
    if len(values) < MIN_SEEDS:
        return f"{np.mean(values):{sign}z.2f}"
    estimate = over_seeds(values)
    return f"{estimate.mean:{sign}z.2f} [{estimate.low:{sign}z.2f}, {estimate.high:{sign}z.2f}]"


def _without_progress(runs: Sequence[MeasuredRuns]) -> Line:
    """Return the line for runs in which only one side evolved."""
    curves = [run.own.payoff.ravel() for run in runs if run.own]
    sixth = max(1, len(curves[0]) // 6)
    early, late = ([float(curve[part].mean()) for curve in curves] for part in (slice(sixth), slice(-sixth, None)))
    script = f"Against the script {script_of(runs[0])}"
    what = "of the prey were caught" if runs[0].captures else "was the payoff"
    return Line(
        f"{script}, early in the run {payoff_in_words(runs[0], float(np.mean(early)))}, "
        f"late {_mean_in_words(runs, late)}.",
        f"{script}: {_figure(early)} {what} early in the run, {_figure(late)} late.",
    )


def _corners(runs: Sequence[MeasuredRuns]) -> Line | None:
    corners = [early_late(run.own.payoff, run.own.total) for run in runs if run.own and run.progress]
    if not corners:
        return None
    names = ("early_hunt_early", "late_hunt_early", "early_hunt_late", "late_hunt_late")
    each = {name: [getattr(corner, name) for corner in corners] for name in names}
    words = {name: _mean_in_words(runs, values) for name, values in each.items()}
    found = {name: _figure(values) for name, values in each.items()}
    if not runs[0].captures:
        return Line(
            f"Early predators are paid {words['early_hunt_early']} by early prey, late predators "
            f"{words['late_hunt_early']}. By late prey, early predators are paid {words['early_hunt_late']}, late "
            f"predators {words['late_hunt_late']}."
        )
    return Line(
        f"Early predators catch {words['early_hunt_early']} early prey, late predators {words['late_hunt_early']}. "
        f"Of late prey, early predators catch {words['early_hunt_late']}, late predators {words['late_hunt_late']}.",
        f"Early predators catch {found['early_hunt_early']} of early prey, late ones {found['late_hunt_early']}; "
        f"of late prey early predators catch {found['early_hunt_late']}, late ones {found['late_hunt_late']}.",
    )


def _mean_in_words(runs: Sequence[MeasuredRuns], values: list[float]) -> str:
    return payoff_in_short(runs[0], float(np.mean(values)))


def _circles(runs: Sequence[MeasuredRuns]) -> Line | None:
    played = [run.own for run in runs if run.own and run.progress]
    shares = [1 - transitive_share(own.payoff, own.noise) for own in played]
    known = [share for share in shares if not np.isnan(share)]
    if not known:
        return None
    figures = f"{_figure(known)} of the win matrix is cyclic, not explained by a ranking."
    if max(known) < 0.005:
        return Line("Who beats whom follows a ranking: nothing shows that it goes in circles.", figures)
    mean = float(np.mean(known))
    how = "Only a little" if mean < 0.15 else "Part" if mean < 0.5 else "Most"
    return Line(
        f"{how} of who beats whom goes in circles, as in rock, paper, scissors; the rest follows a ranking.", figures
    )


def _phases(runs: Sequence[MeasuredRuns]) -> Line:
    dated = [run for run in runs if run.alternation]
    if not dated:
        return Line(f"Nothing can be said of phases: {why_undated(runs)}.")
    if len(runs) > 1:
        return _phases_of_several(dated)
    (run,) = dated
    assert run.alternation is not None
    if len(run.phases) == 1:
        mean = run.phases[0].mean
        return Line(
            f"No lasting change of success was found: over the whole run {payoff_in_words(run, mean)}.",
            f"{mean:.2f} of the prey are caught from first to last." if run.captures else "",
        )
    least, most = (choose(run.phases, key=lambda phase: phase.mean) for choose in (min, max))
    longest = sorted(sorted(run.phases, key=lambda phase: phase.start - phase.end)[:NAMED], key=lambda each: each.start)
    named = "; ".join(f"{phase.mean:z.2f} in generations {phase.start} to {phase.end - 1}" for phase in longest)
    rest = f", the {NAMED} longest {named}" if len(run.phases) > NAMED else f": {named}"
    return Line(
        f"Success went through {len(run.phases)} phases: at the lowest (from generation {least.start}) "
        f"{payoff_in_words(run, least.mean)}, at the highest (from generation {most.start}) "
        f"{payoff_in_short(run, most.mean)}. "
        f"{'It swung to and fro more often than chance would.' if swings(run) else 'It did not swing to and fro.'}",
        f"{len(run.phases)} phases, by the {'prey caught' if run.captures else 'payoff'}{rest}. Success crosses its "
        f"mean {_times(run.alternation.count)}; by chance as often with p = {run.alternation.p:.2g}.",
    )


def _phases_of_several(dated: Sequence[MeasuredRuns]) -> Line:
    counts = sorted({len(run.phases) for run in dated})
    many = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    to_and_fro = sum(map(swings, dated))
    return Line(
        f"Success has {many} phase{'s' if counts[-1] > 1 else ''} a run; it swings to and fro in {to_and_fro} of "
        f"{counted(len(dated), 'run')}.",
        "To and fro: success crosses its mean more than once, and as often by chance with p of at most 0.05.",
    )


def _times(n: int) -> str:
    return {0: "never", 1: "once", 2: "twice"}.get(n, f"{n} times")


def _behaviours(runs: Sequence[MeasuredRuns]) -> Line | None:
    watched = [run.watched for run in runs if run.watched]
    if not watched:
        return None
    never, seen, absent = never_seen(runs), [], []
    for name in REPORTED_BEHAVIOURS:
        rates = np.mean([each.excess(name) for each in watched], axis=0)
        if np.isnan(rates).all():
            continue
        top = int(np.nanargmax(rates))
        if appeared(watched, name):
            seen.append((float(rates[top]), name, int(watched[0].generations[top])))
        elif name not in never:
            absent.append(name)
    seen.sort(reverse=True)
    named = ", ".join(name for _, name, _ in seen[:NAMED])
    more = f", and {len(seen) - NAMED} more" if len(seen) > NAMED else ""
    peaks = "; ".join(f"{name} ({100 * rate:.0f}% at generation {at})" for rate, name, at in seen)
    figures = [
        f"Behaviours beyond chance, with their peaks: {peaks}." if peaks else "",
        f"Seen, but not reliably more often than by chance: {', '.join(absent)}." if absent else "",
        f"Never seen: {', '.join(never)}." if never else "",
    ]
    words = (
        f"Behaviours seen more often than by chance: {named}{more}."
        if seen
        else "No behaviour is seen more often than by chance."
    )
    return Line(words, " ".join(filter(None, figures)))
