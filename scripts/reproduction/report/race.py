"""Whether there was a race, and how strong the champions are."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.games import exploitability_of_generations, solve_matrix
from esp_trainer.analysis.progress import dominant_generations
from esp_trainer.analysis.ratings import rate
from reproduction.report.words import mean, present
from reproduction.results import Results


def curves(results: dict[str, Results]) -> str:
    """Success by generation, and who catches whom."""
    lines = []
    for arm in ("paper-3v1", "paper-3v2", "monolithic-3v1", "monolithic-3v2"):
        if arm in results:
            found = results[arm]
            count = np.mean([each.count for each in found.alternations])
            lines.append(
                f"- `{arm}`: {count:.1f} alternations a run; cycles in {sum(found.cycling())} of {found.n_seeds} seeds."
            )
    words = "\n".join(lines)
    return f"""## Success over the generations

![Share of prey caught, champion against champion, by generation](reproduction/success.png)

Champion against champion, from the same held-out starts: means over seeds with 95% intervals. Phase changes are dated by a
change-point method (PELT with a BIC penalty for an AR(1) process), and an *alternation* is a change of phase from one side of
the run's mean to the other. Success goes in *cycles* where there are two or more, and more than an AR(1) curve of the same
autocorrelation has 1 time in 20:

{words}

![Who catches whom](reproduction/ciao.png)

Every tenth generation's predators against every tenth generation's prey (CIAO; Cliff & Miller 1995), mean over seeds."""


def exploitable(results: dict[str, Results]) -> str:
    """What fresh evolution takes from the last generation."""
    rows = []
    for arm, found in results.items():
        if "response.predators" not in found:
            continue
        hunts, flees = found["response.predators"], found["response.prey"]
        before, fresh_predators, fresh_prey = hunts[:, 0], hunts[:, 1], flees[:, 1]
        rows.append(f"| `{arm}` | {mean(before)} | {mean(fresh_predators)} | {mean(fresh_prey)} |")
    if not rows:
        return ""
    return """## How far from unbeatable

One side of the last generation is frozen and fresh ESP evolves against it from nothing (an approximate best response, a lower
bound). Share of prey caught, from starts that nobody saw:

| setting | last generation, both sides | fresh predators against its prey | its predators against fresh prey |
| --- | --- | --- | --- |
""" + "\n".join([*rows, "", _SCRIPTS])


_SCRIPTS = """![Prey that never change](reproduction/scripts.png)

Against prey that never change: the fixed prey of Yong & Miikkulainen, met by predators with a network each and by a central
controller, both evolved against it; and all scripted prey, met by predators that evolved with prey of their own, with and without
the idle action."""


def progress(results: dict[str, Results]) -> str:
    """Progress against own and against held-out opponents."""
    rows = []
    for arm in present(results, "monolithic-3v1", "monolithic-3v1-wide", "paper-3v1", "monolithic-3v2", "paper-3v2"):
        own, held_out = results[arm].historical_progress(), results[arm].global_progress()
        second = results[arm].global_progress(since=results[arm].halfway)
        cells = [
            np.array([getattr(both, side).strength for both in each])
            for each in (own, held_out, second)
            for side in ("predators", "prey")
        ]
        rows.append(f"| `{arm}` | {' | '.join(mean(values, 3) for values in cells)} |")
    return """## Progress

![Against all opponents of the own run](reproduction/master.png)

![Against held-out opponents](reproduction/global.png)

Above, the master tournament (Nolfi & Floreano 1998), against the opponents that a run itself made; below, against the panel of
held-out seeds. *Progress* is the mean of the last sixth of such a curve less that of the first: historical against the own
opponents, global against the held-out ones (Miconi 2009), and the latter within the second half of the run alone.

| setting | historical, predators | historical, prey | global, predators | global, prey | global, second half, predators | global, second half, prey |
| --- | --- | --- | --- | --- | --- | --- |
""" + "\n".join(rows)


def games(results: dict[str, Results]) -> str:
    """The empirical game of each run's generations."""
    rows = []
    for arm in present(results, "monolithic-3v1", "monolithic-3v1-wide", "paper-3v1", "monolithic-3v2", "paper-3v2"):
        found = results[arm]
        episodes = found.episodes
        values, supports, exploited, dominant, points = [], [], [], [], []
        for caught in found.caught:
            game, sixth = solve_matrix(caught), len(caught) // 6
            exploit = exploitability_of_generations(caught)
            rated = rate(caught, episodes, np.random.default_rng(0), n_resamples=2)
            values.append(game.value)
            supports.append(game.support)
            exploited.append([side[-sixth:].mean() for side in exploit])
            dominant.append(len(dominant_generations(caught, episodes)))
            points.append([side.rating[-sixth:].mean() - side.rating[:sixth].mean() for side in rated])
        support = np.mean(supports, axis=0)
        lost, gained = np.array(exploited), np.array(points)
        rows.append(
            f"| `{arm}` | {mean(np.array(values))} | {support[0]:.1f} and {support[1]:.1f} | {mean(lost[:, 0])} | {mean(lost[:, 1])} "
            f"| {mean(np.array(dominant, float), 1)} | {mean(gained[:, 0], 0)} | {mean(gained[:, 1], 0)} |"
        )
    return """## The generations as a game

Each run's matrix as a zero-sum game in which both sides choose a generation: its value (share of prey caught under optimal
mixtures), how many generations the mixtures use, what the late generations lose against their worst opponent of the run beyond
that value, how many generations a dominance tournament finds (Stanley & Miikkulainen 2002; differences beyond noise only), and how
many points of an Elo-like rating late generations have over early ones (400 points are ten to one).

| setting | value | in the mixtures, predators and prey | late predators lose | late prey lose | dominant generations | rating gained, predators | rating gained, prey |
| --- | --- | --- | --- | --- | --- | --- | --- |
""" + "\n".join(rows)
