"""The page itself: a short paper, whose tables stand in the supplement."""

from __future__ import annotations

import numpy as np

from reproduction.claims import Verdict
from reproduction.report.words import mean
from reproduction.results import Results

_TASKS = {"paper-3v1": "one prey", "paper-3v2": "two prey"}
_HIGH = ("baiting", "sidestepping", "reversal", "herding", "simultaneous capture", "scattering", "encirclement")
"""What the paper calls high-level strategies, as far as there is a detector."""
_LOW = ("attacker", "blocker", "circling")


def abstract(results: dict[str, Results]) -> str:
    """Answer the two hypotheses of section IV."""
    found = {name: results[name] for name in _TASKS if name in results}
    race = "; ".join(f"{_gain(each)} with {_TASKS[name]}" for name, each in found.items())
    late = "; ".join(f"{_late_gains(each)} with {_TASKS[name]}" for name, each in found.items())
    early = ", ".join(f"{_most_of_gain(each)} with {_TASKS[name]}" for name, each in found.items())
    low = "; ".join(f"{name} {_rates(found, name)}" for name in _LOW)
    high = max((_peak(each, name) for each in found.values() for name in _HIGH), default=0.0)
    return f"""## Abstract

**Can an arms race be sustained without stagnation (first hypothesis of section IV)? In the paper's setting it begins and then stops.**
Measured against opponents of seeds that nobody trained on, both sides improve. The lesser side's gain over the whole run is
{race} (shares of the prey). Nine tenths of the predators' gain is reached by generation {early}. In the second half of the run
predators and prey gain {late}.

**Do baiting, herding and other complex behaviours emerge (second hypothesis)? Simple ones do.** Rates beyond chance, mean over
generations with one and two prey: {low}. Of baiting, sidestepping, reversal, herding, simultaneous capture, scattering and
encirclement none is seen in more than {100 * high:.1f}% of the episodes beyond chance.

**In another setting, with the same split networks and operators, both look better.** Bias genes, past champions as opponents, trials that share
their starts, and memory of what earlier generations told: see [race.md](race.md) for the runs, and [selection.md](selection.md) for why."""


def _gain(results: Results) -> str:
    return mean(results.two_sided(), 3)


def _late_gains(results: Results) -> str:
    late = results.global_progress(since=results.halfway)
    return " and ".join(mean(np.array([getattr(both, side).strength for both in late]), 3) for side in late[0]._fields)


def _most_of_gain(results: Results) -> int:
    """Return the generation by which the predators' mean curve has made nine tenths of its gain."""
    curves = np.mean([both.predators.curve for both in results.global_progress()], axis=0)
    reached = curves >= curves[0] + 0.9 * (curves.max() - curves[0])
    return int(results.generations[np.argmax(reached)])


def _rates(found: dict[str, Results], name: str) -> str:
    return " and ".join(f"{np.nanmean(each.behaviour(name)):.2f}" for each in found.values())


def _peak(results: Results, name: str) -> float:
    """Return a behaviour's mean over seeds and generations; 0 where it cannot be asked for."""
    rates = results.behaviour(name) if f"behaviour.{name}" in results else np.full(1, np.nan)
    return 0.0 if np.isnan(rates).all() else float(np.nanmean(rates))


def body(results: dict[str, Results], verdicts: list[Verdict]) -> str:
    """Tell what was done and found, in five figures."""
    words = [verdict.word for verdict in verdicts]
    tally = ", ".join(f"{words.count(word)} {word}" for word in ("supported", "not supported", "undecided"))
    n_seeds = max((found.n_seeds for found in results.values()), default=0)
    return f"""## What was done

The paper shows "a typical run" of each experiment. Here each is run from up to {n_seeds} seeds, and a claim is a number for each seed, an
interval over seeds and a test. Champions of every tenth generation meet champions of other seeds, held out from everything,
because success against one's own opponents moves with them (the Red Queen). Of {len(verdicts)} claims of the paper are {tally}: the
[supplement](reproduction/supplement.md) lists each with its test, and all ablations.

## Success alternates early and then holds

![Share of prey caught, champion against champion, by generation](reproduction/success.png)

Champion against champion, from the same held-out starts: means over seeds with 95% intervals. With one prey the level holds near
one half while single runs go up and down; with two prey the prey win most of the time.

## Both sides improve, for some hundred generations

![Against held-out opponents](reproduction/global.png)

The same champions against held-out ones. Split networks with one prey gain more on the prey's side than one network does; with two prey
they do not.

![Who catches whom](reproduction/ciao.png)

Every tenth generation's predators against every tenth generation's prey. In a race that goes on, later predators catch earlier prey and earlier
predators do not catch later prey: bright above the diagonal and dark below it, all the way. Here it is so at the edges. The first
generations of either side lose to all later ones, and beyond them the picture is flat.

## Parity makes the level

![Captures by parity of the start](reproduction/parity.png)

On an even torus a predator that starts at an odd distance from a prey that always moves can only land on it after idling once. Success
splits by how many predators start at an even distance, and few seeds ever learn to idle for it.

## Behaviours

![Behaviours by generation](reproduction/behaviours.png)

Rates beyond chance: the rate at which a detector fires, less its rate when predators and prey come from different episodes.
Predators chase, block and come from opposing sides, and a prey circles with a predator on its tail.

## Discussion

Why does the race stop? Two choices that the paper leaves open hold it down. *Networks without bias genes* compute a constant plus an odd function of
what they see, as the logistic function is symmetric about one half. *Opponents of the same moment only* let a side forget: once prey
escape nearly always, the predators' trials all end alike, and selection has nothing to go by. That is the loss of gradient of
section II. Neither touches the idea of the paper, a network for each opponent. [race.md](race.md) tests what happens without
them; [race-protocol.md](race-protocol.md) was written before its runs."""
