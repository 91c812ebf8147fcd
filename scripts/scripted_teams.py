"""Every scripted predator team against every scripted prey, as Markdown: the floor that learned teams must beat.

python scripts/scripted_teams.py > docs/scripted-teams.md
"""

from __future__ import annotations

import argparse
import inspect
from types import ModuleType

from study import table

from esp_trainer.evaluation.match import match
from esp_trainer.tasks import WORLDS
from esp_trainer.types import ScriptedTeams
from predprey_env import EnvConfig
from predprey_env.policies import SCRIPTS, predators, prey

ABOUT = """# Scripted teams

Scripts are the floor: a learned team that does not beat them has not learned to hunt, or to flee. All see only what
agents see, the offsets of their opponents; `random` is deterministic under a seed, the others always. This page is
written by `scripts/scripted_teams.py`.

{scripts}

Fraction of the prey that three predators catch in each task, in {episodes} episodes a cell, from held-out starts that
hold the parities in their true proportions; Wilson intervals (95%) on the number of episodes."""

PARITY_NOTE = """
A single prey that walks at random escapes `greedy_chase` only where all three predators start at an odd distance from
it, once in eight times: on an even torus nobody who never idles can land on it. `parity_chase` idles, and does."""


def main() -> None:
    """Play all pairs and print the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=10_000)
    options = parser.parse_args()
    listed = "\n".join(f"- `{name}` ({team}): {meaning(name)}" for team, names in SCRIPTS.items() for name in names)
    print(ABOUT.format(scripts=listed, episodes=f"{options.episodes:,}"))
    for name, env in WORLDS.items():
        print(f"\n## {name}\n\n{env.n_prey} prey on {env.size} x {env.size} cells, {env.max_cycles} steps.\n")
        print(captures(env, options.episodes))
    print(PARITY_NOTE)
    print(f"\n## Sources\n\n- Predators: {sources(predators)}\n- Prey: {sources(prey)}")


def meaning(script: str) -> str:
    """Return what a script does, from its own docstring."""
    rule = getattr(predators, script, None) or getattr(prey, script, None)
    if rule is None:
        return "every action equally often."
    text = " ".join(inspect.getdoc(rule).split())
    return text.replace(":func:`", "`")


def sources(module: ModuleType) -> str:
    """Return where a module's scripts come from, from its own docstring."""
    return " ".join(str(inspect.getdoc(module)).partition("Sources: ")[2].split())


def captures(env: EnvConfig, episodes: int) -> str:
    """Return a table with rows of predators and columns of prey."""
    rows = []
    for hunters in SCRIPTS["predators"]:
        results = [match(ScriptedTeams(hunters), ScriptedTeams(hunted), env, episodes) for hunted in SCRIPTS["prey"]]
        rows.append([f"`{hunters}`", *(result.caught for result in results)])
    return table(["predators", *SCRIPTS["prey"]], rows, "---:")


if __name__ == "__main__":
    main()
