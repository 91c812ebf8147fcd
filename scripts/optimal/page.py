"""The page on optimal play."""

from __future__ import annotations

import numpy as np

from esp_trainer.analysis.behaviours.counts import BehaviourRate
from esp_trainer.types import ROLES
from optimal.learners import EPISODES, Course, Torus
from optimal.play import Habits
from optimal.values import Value

GAMES = (0, 3, 5)
"""Seeds of the games that are shown."""


def page(
    known: list[Value],
    teams: list[Value],
    sizes: list[tuple[Value, Value]],
    habits: Habits,
    seen: tuple[int, int, dict[str, BehaviourRate]],
    tori: list[Torus],
) -> str:
    """``docs/optimal_play.md``."""
    return "\n".join(
        [_in_short(sizes, habits, tori[0]), _values(known, teams, sizes), _looks(habits, seen), _learners(tori)]
    )


def _in_short(sizes: list[tuple[Value, Value]], habits: Habits, torus: Torus) -> str:
    paper, early = torus.courses[0], torus.early
    first, last = (paper.at("prey", look, early) for look in (0, -1))
    third = len(paper.looks) // 3
    soft = next(course for course in torus.courses if course.learner.fields)
    chance = torus.scripts["random", "prey"]
    ratios = [value.half / value.game.size for value, _ in sizes if value.mean >= 0.5]
    return f"""# Optimal play on small tori

Made by `python scripts/optimal_play.py`. Predators and prey on a small torus are a finite zero-sum game of simultaneous moves:
`esp_trainer.exact` solves it by going back from the end (Shapley 1953), one matrix game a position, positions that look alike once.
Each side is taken as one player: it chooses together, and may draw together. A start has no predator in a prey's cell. Unless it says
otherwise, three predators hunt one prey.

## In short

- **The idle action is the game on an even torus.** Without it predators catch only when all three start at an even distance. With it
  they fix parity first: on {habits.size} x {habits.size} {habits.idling[0]:.2f} of them idle in the first step and {habits.idling[-1]:.2f} in the last, when {habits.even[-1]:.2f} are at an even
  distance. Optimal prey mostly have one good exit at the start, and draw from two or three once they are surrounded.
- **At one and a half times the size the value falls as the torus grows**, among even sizes and among odd ones, from {max(idling.mean for idling, _ in sizes):.2f} to {sizes[-1][0].mean:.2f} at
  {sizes[-1][0].game.size} x {sizes[-1][0].game.size}. Half of the prey are caught within {min(ratios):.2f} to {max(ratios):.2f} times the size. Nothing sure follows from that for 100 x 100: the trend
  says that there, too, optimal predators catch fewer than on small tori in the paper's 150 steps, but not how many.
- **Whoever can be foreseen is lost.** Evolved predators that take the action with the most votes, and scripts that do not draw, never catch a
  prey that foresees them; those that draw by their votes hardly do, as each draws for itself.
- **Evolved prey learn to see a step or two ahead, and no further.** Of the paper's preset on {torus.size} x {torus.size}, predators that know the prey catch
  {first} of the first generation within {early} steps, {paper.at("prey", third, early)} of generation {paper.looks[third]}, and {last} of the last, where optimal
  prey lose {torus.optimal[early - 1]:.3f}. Within {torus.half} steps they catch {paper.at("prey", 0, torus.half)} of the first generation and {paper.at("prey", -1, torus.half)} of the last,
  where optimal prey lose {torus.optimal[torus.half - 1]:.3f}. The race makes neither side safe from who knows it.
- **Drawing actions helps as far as the draw is a wide one, and gets no further than chance.** Of the prey of
  {soft.learner.name} {soft.at("prey", -1, early)} are caught within {early} steps and {soft.at("prey", -1, torus.half)} within {torus.half}; of prey that move at random
  {chance[early - 1]:.3f} and {chance[torus.half - 1]:.3f}. Its votes are bounded, so that no action's chance grows large. Where they are not (`drawn-3v1`, PPO) the prey
  are caught like those that do not draw.
"""


def _values(known: list[Value], teams: list[Value], sizes: list[tuple[Value, Value]]) -> str:
    return f"""## Values

Share of prey caught in time under optimal play: over all starts, and with 0 / 1 / 2 / 3 predators at an even distance at the start.
The third column is what a prototype in C had found before.

| torus, steps | value | prototype | positions | solved in |
| --- | --- | --- | ---: | ---: |
{_known(known)}

On an odd torus parity is here that of the shorter way round; the prototype counted it otherwise.

At one and a half times the size, as the paper's 150 steps are on 100, and how many steps it takes to catch half of the prey:

| torus, steps | with the idle action | half caught within | without |
| --- | --- | ---: | --- |
{_sizes(sizes)}

Other teams, at one and a half times the size. Of two prey it is the mean share: they flee together, as one player.

| torus, steps | predators v prey | share caught | positions |
| --- | --- | ---: | ---: |
{_teams(teams)}
"""


def _known(known: list[Value]) -> str:
    return "\n".join(
        f"| {value.game.name} | {value} | {value.game.said} | {value.n_states:,} | {value.seconds:.1f} s |"
        for value in known
    )


def _sizes(sizes: list[tuple[Value, Value]]) -> str:
    return "\n".join(
        f"| {idling.game.name} | {idling} | {f'{idling.half} steps' if idling.mean >= 0.5 else '-'} | {without} |"
        for idling, without in sizes
    )


def _teams(teams: list[Value]) -> str:
    return "\n".join(
        f"| {value.game.name} | {value.game.config.n_predators} v {value.game.config.n_prey} | {value.mean:.3f} "
        f"| {value.n_states:,} |"
        for value in teams
    )


def _looks(habits: Habits, seen: tuple[int, int, dict[str, BehaviourRate]]) -> str:
    error = (habits.value * (1 - habits.value) / habits.n_episodes) ** 0.5
    size, n_episodes, rates = seen
    games = "\n".join(f"![A game of two optimal teams](optimal_play/game-{seed}.gif)" for seed in GAMES)
    return f"""## What it looks like

{habits.n_episodes:,} episodes of two optimal teams on {habits.size} x {habits.size}, {habits.steps} steps: {habits.caught:.3f} of the prey were caught, where the value is
{habits.value:.3f} (standard error {error:.3f}). Means over the episodes that are still going on; a prey is enclosed if no gap between the
predators around it is as wide as 180 degrees:

| step | episodes | predators that idle | at an even distance | mean distance | prey enclosed | exits the prey draws from |
| ---: | ---: | ---: | ---: | ---: | ---: | ---: |
{_habits(habits)}

{games}

What the detectors of [behaviours](../esp_trainer/analysis/behaviours) see in {n_episodes} episodes on {size} x {size}, {size * 3 // 2} steps: share of episodes, and the share
by chance, with predators and prey of different episodes put together. Most look at windows of 15 steps, of which such episodes
have few; what is seen in none is left out.

| behaviour | seen | by chance |
| --- | ---: | ---: |
{_behaviours(rates)}
"""


def _habits(habits: Habits) -> str:
    columns = zip(habits.going, habits.idling, habits.even, habits.distance, habits.enclosed, habits.exits, strict=True)
    return "\n".join(
        f"| {step} | {going:,} | {idle:.2f} | {even:.2f} | {far:.2f} | {enclosed:.2f} | {exits:.2f} |"
        for step, (going, idle, even, far, enclosed, exits) in enumerate(columns)
    )


def _behaviours(rates: dict[str, BehaviourRate]) -> str:
    return "\n".join(
        f"| {name} | {each.rate:.3f} | {'-' if np.isnan(each.null) else f'{each.null:.3f}'} |"
        for name, each in rates.items()
        if each.rate > 0
    )


def _learners(tori: list[Torus]) -> str:
    first = tori[0]
    seeds = len(first.courses[0].met)
    return f"""## How far everybody is from it

One side's policy is fixed, and the other side answers it optimally, with foresight of all that can be foreseen. On {first.size} x {first.size}, the
last of {seeds} seeds of each learner: share of prey caught, means with 95% intervals. The best response is another for each number of steps.

| policy | {" | ".join(f"within {steps}" for steps in first.columns)} |
| --- |{" ---: |" * len(first.columns)}
| both sides play optimally | {" | ".join(f"{first.optimal[steps - 1]:.4f}" for steps in first.columns)} |
{_policies(first)}

`paper-3v1` takes the action with the most votes, `modern-3v1` too, from offsets times 0.2; `drawn-3v1` draws it with chances in proportion
to the exponentials of its votes (softmax), and so does "actions drawn", which is `paper-3v1` otherwise. PPO learns from 10 million steps
of both sides' agents in self-play and draws likewise; `entropy` is what drawing is worth to it, 0.005 by default.

![Prey answered optimally](optimal_play/exploitability.png)

While they learn: their prey, answered optimally, and how many prey are caught where their own two sides meet ({EPISODES:,} episodes to the
end). Looks are at generations, or at millions of steps of PPO.

{_courses(tori)}
"""


def _policies(torus: Torus) -> str:
    rows, columns = [], torus.columns
    for role in ROLES:
        for (script, played), curve in torus.scripts.items():
            if played == role:
                cells = (f"{curve[steps - 1]:.4f}" for steps in columns)
                rows.append(f"| {role}, `{script}` | {' | '.join(cells)} |")
        for course in torus.courses:
            found = [course.at(role, -1, steps) for steps in columns]
            cells = (f"{each.mean:.4f} [{each.low:.4f}, {each.high:.4f}]" for each in found)
            rows.append(f"| {role}, {course.learner.name} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _courses(tori: list[Torus]) -> str:
    return "\n\n".join(_course(torus, course) for torus in tori for course in torus.courses)


def _course(torus: Torus, course: Course) -> str:
    looks = [str(look if course.learner.preset else look // 1_000_000) for look in course.looks.tolist()]
    rows = [f"| {torus.size} x {torus.size}, {course.learner.name} | {' | '.join(looks)} |"]
    rows.append("| --- |" + " ---: |" * len(looks))
    for steps in (torus.early, torus.half):
        cells = (str(course.at("prey", look, steps)) for look in range(len(looks)))
        rows.append(f"| within {steps} (optimal prey: {torus.optimal[steps - 1]:.3f}) | {' | '.join(cells)} |")
    met = (f"{course.met[:, look].mean():.2f}" for look in range(len(looks)))
    rows.append(f"| met | {' | '.join(met)} |")
    return "\n".join(rows)
