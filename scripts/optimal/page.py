"""The page on optimal play."""

from __future__ import annotations

from esp_trainer.types import ROLES
from optimal.learners import PRESETS, SCRIPTS, Races
from optimal.play import Habits
from optimal.values import Value


def page(known: list[Value], sizes: list[tuple[Value, Value]], habits: Habits, races: Races) -> str:
    """``docs/optimal_play.md``."""
    return f"""# Optimal play on small tori

Made by `python scripts/optimal_play.py`. Three predators and one prey on a small torus are a finite zero-sum game of simultaneous
moves: `esp_trainer.exact` solves it by going back from the end (Shapley 1953), one matrix game a position, positions that look alike
once. The predators are taken as one player: they choose together, and may draw together. A start has no predator in the prey's cell.

## In short

- **The idle action is the game on an even torus.** Without it predators catch only when all three start at an even distance. With it
  they fix parity first: on {habits.size} x {habits.size} {habits.idling[0]:.2f} of them idle in the first step and {habits.idling[-1]:.2f} in the last, when {habits.even[-1]:.2f} are at an even
  distance. Optimal prey mostly have one good exit at the start, and draw from two or three once they are surrounded.
- **At one and a half times the size the value falls as the torus grows**, among even sizes and among odd ones, from {max(idling.mean for idling, _ in sizes):.2f} to {sizes[-1][0].mean:.2f} at {sizes[-1][0].game.size} x {sizes[-1][0].game.size}. Nothing follows from
  that for 100 x 100, where three predators may need another share of the time to come near.
- **Whoever can be foreseen is lost.** Evolved predators that take the action with the most votes, and scripts, never catch a prey that
  foresees them; those that draw by their votes hardly do, as they draw little, and apart.
- **Evolved prey are no better: predators that know them catch all of them within {races.half} steps**, more surely than a prey that moves at
  random. In {races.generations[-1] + 1} generations this does not change, in none of the three presets: the race makes neither side harder to exploit.

## Values

Share of prey caught in time under optimal play: over all starts, and with 0 / 1 / 2 / 3 predators at an even distance at the start.
The last column is what a prototype in C had found before.

| torus, steps | value | prototype | positions | solved in |
| --- | --- | --- | ---: | ---: |
{_known(known)}

On an odd torus parity is here that of the shorter way round; the prototype counted it otherwise.

At one and a half times the size, as the paper's 150 steps are on 100:

| torus, steps | with the idle action | without |
| --- | --- | --- |
{_sizes(sizes)}

## What it looks like

{habits.n_episodes:,} episodes of two optimal teams on {habits.size} x {habits.size}, {habits.steps} steps: {habits.caught:.3f} of the prey were caught, where the value is
{habits.value:.3f} (standard error {(habits.value * (1 - habits.value) / habits.n_episodes) ** 0.5:.3f}). Means over the episodes that are still going on:

| step | episodes | predators that idle | at an even distance | mean distance | quarters with a predator | exits the prey draws from |
| ---: | ---: | ---: | ---: | ---: | ---: | ---: |
{_habits(habits)}

## How far everybody is from it

On {races.size} x {races.size}: one side's policy is fixed, and the other side answers it optimally, with foresight of all that can be foreseen. Share of prey
caught within {races.half} steps, where optimal play catches {races.optimal[races.half - 1]:.3f}, and within {len(races.optimal)}, where it catches {races.optimal[-1]:.3f}. Evolved: the last champions,
means over {races.seeds} seeds with 95% intervals.

| policy | within {races.half} | within {len(races.optimal)} |
| --- | ---: | ---: |
{_policies(races)}

![Share caught by time](optimal_play/exploitability.png)

By generation, the prey's champions within {races.half} steps, and what the champions of both sides did against each other in {len(races.optimal)}:

| generation | {" | ".join(f"{name}, answered | met" for name in PRESETS)} |
| ---: | {" | ".join("---: | ---:" for _ in PRESETS)} |
{_generations(races)}
"""


def _known(known: list[Value]) -> str:
    return "\n".join(
        f"| {value.game.name} | {value} | {value.game.said} | {value.n_states:,} | {value.seconds:.1f} s |"
        for value in known
    )


def _sizes(sizes: list[tuple[Value, Value]]) -> str:
    return "\n".join(f"| {idling.game.name} | {idling} | {without} |" for idling, without in sizes)


def _habits(habits: Habits) -> str:
    columns = zip(habits.going, habits.idling, habits.even, habits.distance, habits.sides, habits.exits, strict=True)
    return "\n".join(
        f"| {step} | {going:,} | {idle:.2f} | {even:.2f} | {far:.2f} | {sides:.2f} | {exits:.2f} |"
        for step, (going, idle, even, far, sides, exits) in enumerate(columns)
    )


def _policies(races: Races) -> str:
    rows = []
    last = len(races.optimal)
    for role in ROLES:
        for script in SCRIPTS[role]:
            curve = races.scripts[script, role]
            rows.append(f"| {role}, `{script}` | {curve[races.half - 1]:.4f} | {curve[-1]:.4f} |")
        for name in PRESETS:
            found = [races.at(name, role, -1, steps) for steps in (races.half, last)]
            cells = (f"{each.mean:.4f} [{each.low:.4f}, {each.high:.4f}]" for each in found)
            rows.append(f"| {role}, `{name}` | {' | '.join(cells)} |")
    return "\n".join(rows)


def _generations(races: Races) -> str:
    rows = []
    for column, generation in enumerate(races.generations):
        cells = []
        for name in PRESETS:
            answered = races.at(name, "prey", column, races.half)
            cells += [str(answered), f"{races.met[name][:, column].mean():.2f}"]
        rows.append(f"| {generation} | {' | '.join(cells)} |")
    return "\n".join(rows)
