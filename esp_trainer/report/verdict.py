"""The verdict on runs: one sentence, which the page shows first.

A side that hardly ever loses to its contemporary opponents has won, whatever either side gained against older ones.
Only if neither has won does the verdict speak of progress.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from esp_trainer.analysis.cross_play import PayoffPlay, Played
from esp_trainer.analysis.plots import smooth
from esp_trainer.analysis.progress import early_late, progress
from esp_trainer.arrays import PayoffMatrix
from esp_trainer.report.measure import SHORTEST, MeasuredRuns
from esp_trainer.types import ROLES, Role

NOTABLE = 0.02
"""Minimum gain, as a fraction of the prey, at which a side of one run is said to have become better."""

WINDOW = 15
"""Number of generations over which curves of success are averaged."""

FEWEST = 4
"""Minimum number of generations of a side in the cross-play, as the verdict compares those of its second half."""

_RARE = (50, 20)
"""Values of ``n``: a side has won if, up to the end of the run, the opponents win fewer than 1 in ``n`` prey."""
_LAST = 6  # the opponents must win so few for at least the last sixth of the run
_WON: dict[Role, str] = {"predators": "escape", "prey": "are caught"}
_FRACTIONS = (
    (0, 1),
    (1, 50),
    (1, 20),
    (1, 10),
    (1, 5),
    (1, 4),
    (1, 3),
    (2, 5),
    (1, 2),
    (3, 5),
    (2, 3),
    (3, 4),
    (4, 5),
    (9, 10),
    (1, 1),
)


def verdict(runs: Sequence[MeasuredRuns]) -> str:
    """Return the verdict on one or several runs as one sentence."""
    if len(runs) == 1:
        return _of_one(runs[0])
    (first, n), *others = Counter(kind_of(run) for run in runs).most_common()
    most = f"In {n} of {len(runs)} runs" if others else f"In all {n} runs"
    return "; ".join([f"{most} {_IN_SHORT[first]}", *(f"in {m} {_IN_SHORT[kind]}" for kind, m in others)]) + "."


_IN_SHORT = {
    "predators won": "the predators won",
    "prey won": "the prey won",
    "both": "both sides were still improving in the second half",
    "predators": "only the predators were still improving in the second half",
    "prey": "only the prey were still improving in the second half",
    "swung": "success swung to and fro",
    "stopped": "no side was still improving in the second half",
    "neither": "neither side improved",
    "script": "one side followed a script",
    "unknown": "nothing can be said of progress",
}


def kind_of(run: MeasuredRuns) -> str:
    """Return the kind of a run's verdict: the winner, else the sides that were improving at the end."""
    winner = won(run)
    if winner:
        return f"{winner[0]} won"
    if run.own is None or why_unknown(run):
        return "unknown"
    if run.progress is None:
        return "script"
    improved = improving(run.own)
    late = [role for role in improving(run.own, late=True) if role in improved]
    if late:
        return "both" if len(late) == 2 else late[0]
    return "swung" if swings(run) else "stopped" if improved else "neither"


def why_unknown(run: MeasuredRuns) -> str:
    """Return why nothing can be said of a run's progress, as a clause; empty if something can."""
    if run.own is None:
        return "no champion could be read"
    if len(run.source) < SHORTEST:
        return f"that takes at least {SHORTEST} generations"
    if max(run.own.payoff.shape) < FEWEST:
        return f"that takes champions of at least {FEWEST} generations"
    return ""


def swings(run: MeasuredRuns) -> bool:
    """Return whether success went to and fro: it crosses its mean more than once, and more often than by chance."""
    return run.alternation is not None and run.alternation.count > 1 and run.alternation.p <= 0.05


def won(run: MeasuredRuns) -> tuple[Role, int, int] | None:
    """Return the side that won, since which generation, and the ``n`` of "fewer than 1 in n"; None if neither won.

    From that generation to the end, the loser's result stays below ``1 / n``: the fraction of prey caught, or not
    caught if the prey lose, champion against champion, as a running mean over :data:`WINDOW` generations. A run of
    fewer than :data:`SHORTEST` generations has no winner.
    """
    caught = run.source.curves.get("caught", np.empty(0))
    if len(caught) < SHORTEST or np.isnan(caught).any():
        return None
    curve = smooth(caught, WINDOW)
    for n in _RARE:
        for winner, losers in (("prey", curve), ("predators", 1 - curve)):
            above = np.flatnonzero(losers >= 1 / n)
            since = int(above[-1]) + 1 if len(above) else 0
            if since <= len(curve) - max(1, len(curve) // _LAST):
                return winner, since, n  # type: ignore[return-value]
    return None


def improving(own: Played, *, late: bool = False) -> list[Role]:
    """Return the sides that improved, against all opponents of the run.

    Args:
        own: Cross-play of at least four generations of each side.
        late: Look at the second half of the run alone.
    """
    results: dict[Role, PayoffMatrix] = {"predators": own.payoff, "prey": own.total - own.payoff.T}
    since = {role: len(results[role]) // 2 if late else 0 for role in ROLES}
    gained = {role: progress(results[role][since[role] :], own.total).strength for role in ROLES}
    return [role for role in ROLES if gained[role] > notable(own)]


def notable(own: Played | None) -> float:
    """Return the gain above which a side of a run is said to have become better.

    It is :data:`NOTABLE`. In another game than the predator-prey world that is a fraction of the range of the payoffs,
    and the gain must also exceed two standard errors, as payoffs may be of any scale and noise.
    """
    if not isinstance(own, PayoffPlay):
        return NOTABLE
    n_late = max(1, len(own.payoff) // _LAST)
    error = np.sqrt(2 * np.nanmean(own.variance) / (n_late * own.payoff.shape[1]))
    return max(NOTABLE * float(np.ptp(own.payoff)), 2 * float(np.nan_to_num(error)))


def fraction_in_words(fraction: float) -> str:
    """Return a fraction in words, to be followed by a noun: "about 1 in 4", "nearly no" or "nearly all"."""
    part, n = min(_FRACTIONS, key=lambda each: abs(each[0] / each[1] - fraction))
    return "nearly no" if part == 0 else "nearly all" if part == n else f"about {part} in {n}"


def caught_in_words(fraction: float) -> str:
    """Return a fraction of prey caught in words, for example "about 1 in 4 prey is caught"."""
    words = fraction_in_words(fraction)
    return f"{words} prey {'is' if words == 'nearly no' or ' 1 in ' in words else 'are'} caught"


def payoff_in_short(run: MeasuredRuns, payoff: float) -> str:
    """Return a payoff as the report says it: a fraction of prey in words, or a number."""
    return fraction_in_words(payoff) if run.captures else f"{payoff:z.2f}"


def payoff_in_words(run: MeasuredRuns, payoff: float) -> str:
    """Return a payoff as a clause, for example "about 1 in 4 prey is caught" or "the predators' payoff is 1.20"."""
    return caught_in_words(payoff) if run.captures else f"the predators' payoff is {payoff:z.2f}"


def _of_one(run: MeasuredRuns) -> str:
    kind, winner = kind_of(run), won(run)
    if winner:
        role, since, n = winner
        when = f"after generation {since - 1}" if since else "from the first generation on"
        return f"{role.capitalize()} won: {when} fewer than 1 in {n} {_WON[role]}."
    if kind == "script":
        return _against_script(run)
    if run.own is None or kind == "unknown":
        return f"Nobody can say who improved: {why_unknown(run)}."
    late = payoff_in_short(run, early_late(run.own.payoff, run.own.total).late_hunt_late)
    ending = (
        f"late predators catch {late} late prey" if run.captures else f"late predators are paid {late} by late prey"
    )
    improved = improving(run.own)
    said = {
        "both": "Both sides were still improving in the second half",
        "stopped": "Both sides improved, in the first half alone"
        if len(improved) == 2
        else f"Only the {''.join(improved)} improved, in the first half alone",
        "neither": "Neither side improved",
        "swung": "Neither side got ahead for good: success swung to and fro",
    }.get(kind, f"Only the {kind} were still improving in the second half")
    return f"{said}; {ending}."


def _against_script(run: MeasuredRuns) -> str:
    assert run.own is not None
    payoff, least = run.own.payoff.ravel(), notable(run.own)
    role: Role = "predators" if run.own.payoff.shape[0] > 1 else "prey"
    curve = payoff if role == "predators" else run.own.total - payoff
    gained = progress(curve[:, None], run.own.total).strength
    sixth = max(1, len(curve) // _LAST)
    change = "got better" if gained > least else "got worse" if gained < -least else "did not change much"
    early, late = (payoff_in_words(run, payoff[part].mean()) for part in (slice(sixth), slice(-sixth, None)))
    return f"Against the script {script_of(run)}, the {role} {change}: at first {early}, at the end {late}."


def script_of(run: MeasuredRuns) -> str:
    """Return the script that one side of a run follows."""
    config = run.source.config
    return next(policy for policy in (config.predators.policy, config.prey.policy, "nobody") if policy != "esp")
