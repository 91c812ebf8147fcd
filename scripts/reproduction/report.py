"""``docs/reproduction.md``: what the measurements say, as Markdown. Every number in it is made here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from esp_trainer.analysis.inference import Estimate, compare, holm, over_seeds
from esp_trainer.analysis.phases import alternation
from reproduction.claims import Verdict
from reproduction.results import Results

All = Mapping[str, Results]


@dataclass(frozen=True)
class Origin:
    """Where a report came from."""

    command: str
    commit: str
    versions: str


def write(results: All, verdicts: Iterable[Verdict], origin: Origin) -> str:
    """The whole page."""
    parts = [
        _head(results, origin),
        _claims(list(verdicts)),
        _curves(results),
        _arms(results, "Ablations", ("paper", "ablation"), "ablations"),
        _sensitivity(results),
        _parity(results),
        _exploitable(results),
        _behaviours(results),
        _method(),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _head(results: All, origin: Origin) -> str:
    n_runs = sum(found.n_seeds for found in results.values())
    return f"""# The paper's experiments over many seeds

`{origin.command}` at commit {origin.commit}, {origin.versions}: {n_runs} runs of {len(results)} settings. This page and its
figures are made by that command; each figure's data lies beside it as CSV, and the measurements of every run in
[`data/`](reproduction/data). The paper shows "a typical run"; here a claim is a number for each seed, an interval over seeds
and a test, and the agents are measured against opponents that stand still, most of them champions of seeds that nobody
trained on."""


def _claims(verdicts: list[Verdict]) -> str:
    rows = [
        f"| {v.claim.section} | {v.claim.says} | {v.claim.measure} | {_difference(v)} | {v.found.effect:+.2f} | {_p(v.p)} "
        f"| **{v.word}** | [{v.claim.figure}](reproduction/{v.claim.figure}.png) |"
        for v in verdicts
    ]
    words = [v.word for v in verdicts]
    tally = ", ".join(f"{words.count(word)} {word}" for word in ("supported", "not supported", "undecided"))
    return f"""## The paper's claims

{tally}. *Effect* is Cliff's delta, *p* is corrected for all {len(verdicts)} claims (Holm). How a verdict is reached stands
under [How it was measured](#how-it-was-measured).

| section | the paper says | measured | value [95% interval] | effect | p | verdict | figure |
| --- | --- | --- | --- | --- | --- | --- | --- |
""" + "\n".join(rows)


def _difference(verdict: Verdict) -> str:
    found = verdict.found
    return f"{found.difference:+.3f} [{found.low:+.3f}, {found.high:+.3f}]"


def _p(p: float) -> str:
    return f"{p:.2g}" if p >= 0.001 else "< 0.001"


def _curves(results: All) -> str:
    lines = []
    for arm in ("paper-3v1", "paper-3v2", "monolithic-3v1", "monolithic-3v2"):
        if arm in results:
            found = [alternation(c.astype(float), np.random.default_rng(0)) for c in results[arm]["curve.caught"]]
            often = sum(each.p <= 0.05 for each in found)
            count = np.mean([each.count for each in found])
            lines.append(
                f"- `{arm}`: {count:.1f} alternations a run; more than an AR(1) curve has in {often} of {len(found)} seeds."
            )
    return (
        """## Success over the generations

![Share of prey caught, champion against champion, by generation](reproduction/success.png)

Champion against champion, from the same held-out starts: means over seeds with 95% intervals. Phase changes are dated by a
change-point method (PELT with a BIC penalty for an AR(1) process), and an *alternation* is a change of phase from one side of
the run's mean to the other:

"""
        + "\n".join(lines)
        + """

![Who catches whom](reproduction/ciao.png)

Every tenth generation's predators against every tenth generation's prey (CIAO; Cliff & Miller 1995), mean over seeds.

![Against all opponents of the own run](reproduction/master.png)

![Against held-out opponents](reproduction/global.png)

Above, the master tournament (Nolfi & Floreano 1998), against the opponents that a run itself made; below, against the panel of
held-out seeds: progress that is global, not only historical (Miconi 2009)."""
    )


def _arms(results: All, title: str, parts: tuple[str, ...], figure: str, until: int | None = None) -> str:
    shown = [found for found in results.values() if found.arm.part in parts]
    rows = [
        f"| `{found.arm.name}` | {found.arm.meaning} | {found.n_seeds} | {_mean(found.late('caught'))} | {_sides(found, until)} |"
        for found in shown
    ]
    return f"""## {title}

![Progress against held-out opponents](reproduction/{figure}.png)

*Caught*: share of prey, champion against champion, last third of the run. *Progress*: late minus early generations against
held-out opponents of the same world, in shares of prey. *Level*: where the last sixth stands against them. *Depends on the
opponent*: share of who beats whom that no ladder explains (Hodge decomposition).

| setting | what it is | seeds | caught | predators' progress | prey's progress | lesser of both | predators' level | prey's level | depends on the opponent |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
""" + "\n".join(rows)


def _sides(found: Results, until: int | None) -> str:
    if "panel.predators" not in found or "panel.prey" not in found:
        return "- | - | - | - | - | -"
    both = found.global_progress(until=until)
    cells = [
        _mean(np.array([side.predators.strength for side in both])),
        _mean(np.array([side.prey.strength for side in both])),
        _mean(found.two_sided(until=until)),
        _mean(found.late_share("panel.predators", until)),
        _mean(1 - found.late_share("panel.prey", until)),
        _mean(found.cyclic_share()),
    ]
    return " | ".join(cells)


def _mean(values: np.ndarray) -> str:
    known: Estimate = over_seeds(values)
    return f"{known.mean:.2f} [{known.low:.2f}, {known.high:.2f}]"


def _sensitivity(results: All) -> str:
    found = [arm for arm in results.values() if arm.arm.part == "sensitivity"]
    if not found:
        return ""
    generations = found[0]["curve.caught"].shape[1]
    table = _arms(results, "Sensitivity: one factor at a time", ("sensitivity",), "sensitivity", generations)
    rows, tests = [], []
    for arm in [*found, *(a for a in results.values() if a.arm.name.startswith("scaled-"))]:
        base = results.get(f"paper-3v{arm.arm.config.env.n_prey}")
        if base is not None:
            test = compare(arm.two_sided(until=generations), base.two_sided(until=generations))
            tests.append((arm.arm.name, test))
    for (name, test), p in zip(tests, holm([test.p for _, test in tests]) if tests else [], strict=True):
        rows.append(
            (
                test.difference,
                f"| `{name}` | {test.difference:+.3f} [{test.low:+.3f}, {test.high:+.3f}] | {test.effect:+.2f} | {_p(float(p))} |",
            )
        )
    ranked = "\n".join(row for _, row in sorted(rows, reverse=True))
    return f"""{table}

Against `paper-3v1` and `paper-3v2` over the same {generations} generations, the lesser side's progress, best first:

| setting | difference [95% interval] | effect | p (Holm) |
| --- | --- | --- | --- |
{ranked}"""


def _parity(results: All) -> str:
    arms = [a for a in ("paper-3v1", "scaled-3v1", "prey-first-3v1", "no-idling-3v1", "odd-torus-3v1") if a in results]
    if not arms:
        return ""
    rows = []
    for arm in arms:
        late = results[arm]["curve.caught_by_even"].astype(float)
        late = late[:, -(late.shape[1] // 3) :].mean(axis=1)
        cells = " | ".join(_mean(np.nan_to_num(late[:, even])) for even in range(late.shape[1]))
        rows.append(f"| `{arm}` | {cells} | {_discovered(results[arm])} |")
    return """## Parity: what the level is made of

On an even torus a predator that starts at an odd distance from a prey that always moves can only land on it if it idles once.

![Captures by parity of the start](reproduction/parity.png)

Share of prey caught in the last third of the run, champion against champion, by how many of the three predators start at an
even distance; and in how many seeds the predators ever learn to do without (of the prey with no predator at an even distance,
at least half caught over ten generations), with the generations at which they first do:

| setting | 0 even | 1 even | 2 even | 3 even | parity overcome |
| --- | --- | --- | --- | --- | --- |
""" + "\n".join(rows)


def _discovered(found: Results) -> str:
    """When predators first catch at least half of the prey that none of them starts at an even distance from."""
    curves = np.nan_to_num(found["curve.caught_by_even"][:, :, 0].astype(float))
    window = min(10, curves.shape[1])
    means = np.apply_along_axis(lambda row: np.convolve(row, np.ones(window) / window, "valid"), 1, curves)
    first = [int(np.argmax(row >= 0.5)) for row in means if (row >= 0.5).any()]
    when = f" (generations {', '.join(map(str, sorted(first)))})" if first else ""
    return f"{len(first)} of {len(curves)} seeds{when}"


def _exploitable(results: All) -> str:
    rows = []
    for arm, found in results.items():
        if "response.predators" not in found:
            continue
        hunts, flees = found["response.predators"], found["response.prey"]
        before, fresh_predators, fresh_prey = hunts[:, 0], hunts[:, 1], flees[:, 1]
        rows.append(f"| `{arm}` | {_mean(before)} | {_mean(fresh_predators)} | {_mean(fresh_prey)} |")
    if not rows:
        return ""
    return """## How far from unbeatable

One side of the last generation is frozen and fresh ESP evolves against it from nothing (an approximate best response, a lower
bound). Share of prey caught, from starts that nobody saw:

| setting | last generation, both sides | fresh predators against its prey | its predators against fresh prey |
| --- | --- | --- | --- |
""" + "\n".join(rows)


def _behaviours(results: All) -> str:
    arms = [arm for arm in ("paper-3v1", "paper-3v2") if arm in results]
    if not arms:
        return ""
    names = [key.removeprefix("behaviour.") for key in results[arms[-1]].arrays if key.startswith("behaviour.")]
    rows = []
    for name in names:
        cells = []
        for arm in arms:
            rates = results[arm].behaviour(name)
            if np.isnan(rates).all():
                cells.append("- | -")
            else:
                peaks = np.nanmax(rates, axis=1)
                cells.append(f"{_mean(np.nanmean(rates, axis=1))} | {np.median(peaks):.2f}, {peaks.max():.2f}")
        rows.append(f"| {name} | {' | '.join(cells)} |")
    heads = " | ".join(f"`{arm}`, mean | peak: median seed, best seed" for arm in arms)
    return f"""## Behaviours

![Behaviours by generation](reproduction/behaviours.png)

![A moment of each behaviour](reproduction/moments.png)

For each behaviour the moment that its detector picked, from the run and generation in which it was seen most, in the manner of
the paper's figures 4 and 6: predators orange with triangles, prey blue with squares, circles where the excerpt begins.

Share of episodes in which a behaviour is seen, minus the share in which it is when predators and prey of different episodes are
paired (idling and parity idle: plain shares; specialisation: in bits). Definitions are the docstrings of
`esp_trainer.analysis.behaviours`; the peak is the highest of {len(results[arms[0]]["watched"][0])} watched generations.

| behaviour | {heads} |
| --- | {" | ".join(["---"] * (2 * len(arms)))} |
""" + "\n".join(rows)


def _method() -> str:
    return """## How it was measured

- **Runs.** Each setting with the seeds 0 and up; the panel of held-out opponents from seeds 1000 to 1002 of the same world, half
  of them with raw and half with scaled offsets, three champions of each run. No run of a panel is part of a result.
- **Matches.** 64 episodes a pair, the same starts for all, holding the parities in their true proportions.
- **Intervals** over seeds are Student's for means; differences between settings are Hodges-Lehmann's with the interval of the rank
  test. **Tests**: sign flips for one setting against a number, Mann-Whitney between settings; Holm's correction over all claims.
- **Verdicts.** *Not supported*: the whole interval is below the smallest difference that would matter (0.05 of the prey or episodes,
  0.02 of progress, 0.02 for a behaviour: once in fifty episodes), or the corrected test finds the contrary. *Supported*: the corrected
  test finds it. Else *undecided*. A claim of no change is supported where the whole interval is within that difference.
- **Early** and **late** are the first and the last sixth of the generations."""
