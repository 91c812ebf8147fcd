"""The claims of the paper, each as one number a seed, and a test."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.stats import binomtest

from esp_trainer.analysis.inference import Comparison, against, compare
from reproduction.claims import All, Claim
from reproduction.results import CHANCE

SHARE = 0.05
"""The smallest difference in a share of prey caught, or in success, that would matter."""
PROGRESS = 0.02
"""The smallest progress of a side that would: two in a hundred prey."""
BEHAVIOUR = 0.02
"""The smallest rate over chance at which a behaviour would count as one that emerges: once in fifty episodes."""


def _late(arm: str, curve: str, null: float) -> Callable[[All], Comparison]:
    return lambda results: against(results[arm].late(curve), null)


def _late_between(a: str, b: str, curve: str = "caught") -> Callable[[All], Comparison]:
    return lambda results: compare(results[a].late(curve), results[b].late(curve))


def _two_sided(arm: str) -> Callable[[All], Comparison]:
    return lambda results: against(results[arm].two_sided())


def _goes_on(arm: str) -> Callable[[All], Comparison]:
    return lambda results: against(results[arm].two_sided(since=results[arm].halfway))


def _two_sided_between(a: str, b: str) -> Callable[[All], Comparison]:
    return lambda results: compare(results[a].two_sided(), results[b].two_sided())


def _behaviour(arm: str, name: str) -> Callable[[All], Comparison]:
    return lambda results: against(np.nanmean(results[arm].behaviour(name), axis=1))


def _alternates(arm: str) -> Callable[[All], Comparison]:
    """In how many seeds, beyond the 1 in 20 in which chance does at most: an exact binomial test."""

    def number(results: All) -> Comparison:
        often = results[arm].cycling()
        test = binomtest(sum(often), len(often), CHANCE)
        share, ends = float(np.mean(often)), test.proportion_ci(method="wilson")
        return Comparison(share - CHANCE, ends.low - CHANCE, ends.high - CHANCE, 2 * share - 1, float(test.pvalue))

    return number


def _escapes(a: str, b: str) -> Callable[[All], Comparison]:
    return lambda results: compare(1 - results[a].late_share("panel.prey"), 1 - results[b].late_share("panel.prey"))


def _against_scripts(a: str, b: str) -> Callable[[All], Comparison]:
    name = "scripts.predators"
    return lambda results: compare(results[a].late_share(name), results[b].late_share(name))


_GLOBAL = "lesser side's progress against held-out opponents"
_OVER_CHANCE = "rate over chance, mean over generations"

CLAIMS = [
    Claim(
        "VI.A",
        "with one network an agent, two prey always win",
        ("monolithic-3v2",),
        "episodes in which no prey is caught, last third of the run, beyond 0.9",
        _late("monolithic-3v2", "none_caught", 0.9),
        1,
        SHARE,
        "success",
    ),
    Claim(
        "VI.A",
        "... and it stagnates",
        ("monolithic-3v2",),
        _GLOBAL,
        _two_sided("monolithic-3v2"),
        0,
        PROGRESS,
        "global",
    ),
    Claim(
        "VI.A",
        "a single prey with one network is caught easily",
        ("monolithic-3v1",),
        "prey caught, last third, beyond one half",
        _late("monolithic-3v1", "caught", 0.5),
        1,
        SHARE,
        "success",
    ),
    Claim(
        "VI.A",
        "... more often than a prey with split networks",
        ("monolithic-3v1", "paper-3v1"),
        "prey caught, last third, difference",
        _late_between("monolithic-3v1", "paper-3v1"),
        1,
        SHARE,
        "success",
    ),
    Claim(
        "VI.A",
        "more hidden neurons do not help it",
        ("monolithic-3v1-wide", "monolithic-3v1"),
        "prey caught, last third, difference",
        _late_between("monolithic-3v1-wide", "monolithic-3v1"),
        0,
        SHARE,
        "success",
    ),
    Claim(
        "VI.B",
        "split networks sustain an arms race with a single prey",
        ("paper-3v1",),
        _GLOBAL,
        _two_sided("paper-3v1"),
        1,
        PROGRESS,
        "global",
    ),
    Claim(
        "IV",
        "... without stagnation: also in the second half",
        ("paper-3v1",),
        f"{_GLOBAL}, second half of the run",
        _goes_on("paper-3v1"),
        1,
        PROGRESS,
        "global",
    ),
    Claim(
        "VI.B",
        "... more than one network does",
        ("paper-3v1", "monolithic-3v1"),
        f"{_GLOBAL}, difference",
        _two_sided_between("paper-3v1", "monolithic-3v1"),
        1,
        PROGRESS,
        "global",
    ),
    Claim(
        "VII",
        "... nor is it the number of weights",
        ("paper-3v1", "matched-3v1"),
        f"{_GLOBAL}, difference",
        _two_sided_between("paper-3v1", "matched-3v1"),
        1,
        PROGRESS,
        "ablations",
    ),
    Claim(
        "VI.C",
        "split networks sustain it with two prey",
        ("paper-3v2",),
        _GLOBAL,
        _two_sided("paper-3v2"),
        1,
        PROGRESS,
        "global",
    ),
    Claim(
        "IV",
        "... without stagnation: also in the second half",
        ("paper-3v2",),
        f"{_GLOBAL}, second half of the run",
        _goes_on("paper-3v2"),
        1,
        PROGRESS,
        "global",
    ),
    Claim(
        "VI.C",
        "... more than one network does",
        ("paper-3v2", "monolithic-3v2"),
        f"{_GLOBAL}, difference",
        _two_sided_between("paper-3v2", "monolithic-3v2"),
        1,
        PROGRESS,
        "global",
    ),
    Claim(
        "VII",
        "... nor is it the number of weights",
        ("paper-3v2", "matched-3v2"),
        f"{_GLOBAL}, difference",
        _two_sided_between("paper-3v2", "matched-3v2"),
        1,
        PROGRESS,
        "ablations",
    ),
    Claim(
        "VI.A",
        "success alternates in cycles, one prey",
        ("paper-3v1",),
        "share of seeds with more alternations, two at least, than an AR(1) curve has 1 time in 20, beyond that",
        _alternates("paper-3v1"),
        1,
        0.1,
        "success",
    ),
    Claim(
        "VI.C",
        "success alternates in cycles, two prey",
        ("paper-3v2",),
        "share of seeds with more alternations, two at least, than an AR(1) curve has 1 time in 20, beyond that",
        _alternates("paper-3v2"),
        1,
        0.1,
        "success",
    ),
    *(
        Claim(
            "VI.B",
            says,
            ("paper-3v1",),
            f"{_OVER_CHANCE}: {name}",
            _behaviour("paper-3v1", name),
            1,
            BEHAVIOUR,
            "behaviours",
        )
        for says, name in {
            "predators attack, one prey": "attacker",
            "predators block, one prey": "blocker",
            "predators switch roles, one prey": "role switch",
            "two attack from opposing sides, one prey": "opposing attack",
            "the prey goes round in a small circle": "circling",
            "the prey baits": "baiting",
            "the prey sidesteps the blocker": "sidestepping",
            "the prey reverses its direction": "reversal",
        }.items()
    ),
    *(
        Claim(
            "VI.C",
            says,
            ("paper-3v2",),
            f"{_OVER_CHANCE}: {name}",
            _behaviour("paper-3v2", name),
            1,
            BEHAVIOUR,
            "behaviours",
        )
        for says, name in {
            "predators herd two prey together": "herding",
            "predators catch them simultaneously": "simultaneous capture",
            "prey scatter before predators that converge": "scattering",
            "predators switch roles, two prey": "role switch",
            "prey bait, two prey": "baiting",
        }.items()
    ),
    Claim(
        "V",
        "complementary prey fitness gives worse evasion, one prey",
        ("paper-3v1", "complementary-3v1"),
        "prey that escape held-out predators, last sixth, difference",
        _escapes("paper-3v1", "complementary-3v1"),
        1,
        SHARE,
        "ablations",
    ),
    Claim(
        "V",
        "complementary prey fitness gives worse evasion, two prey",
        ("paper-3v2", "complementary-3v2"),
        "prey that escape held-out predators, last sixth, difference",
        _escapes("paper-3v2", "complementary-3v2"),
        1,
        SHARE,
        "ablations",
    ),
    Claim(
        "V",
        "the idle action matters, one prey",
        ("paper-3v1", "no-idling-3v1"),
        "scripted prey caught, last sixth, difference",
        _against_scripts("paper-3v1", "no-idling-3v1"),
        1,
        SHARE,
        "scripts",
    ),
    Claim(
        "V",
        "the idle action matters, two prey",
        ("paper-3v2", "no-idling-3v2"),
        "scripted prey caught, last sixth, difference",
        _against_scripts("paper-3v2", "no-idling-3v2"),
        1,
        SHARE,
        "scripts",
    ),
    Claim(
        "III",
        "a team of networks does better than a central controller",
        ("fleeing-prey", "fleeing-prey-central"),
        "fixed prey caught, last third, difference",
        _late_between("fleeing-prey", "fleeing-prey-central"),
        1,
        SHARE,
        "scripts",
    ),
    Claim(
        "VIII",
        "a combiner network is worth while, two prey",
        ("combiner-3v2", "paper-3v2"),
        f"{_GLOBAL}, difference",
        _two_sided_between("combiner-3v2", "paper-3v2"),
        1,
        PROGRESS,
        "ablations",
    ),
]
"""In the order of the paper."""
