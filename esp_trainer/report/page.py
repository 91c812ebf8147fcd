"""The page of a report: measurements, teams, and the scripts that show them, in one HTML file."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from plotly.offline import get_plotlyjs

from esp_trainer.analysis.history import History
from esp_trainer.arrays import GenerationIndices
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.starts import CellStarts
from esp_trainer.files import write_text
from esp_trainer.game import game_of
from esp_trainer.networks.feedforward import FeedForward
from esp_trainer.presets import PRESETS, preset
from esp_trainer.report import matches, moments
from esp_trainer.report.charts import charts
from esp_trainer.report.html import asset, page
from esp_trainer.report.measure import MeasuredRuns, ReportOptions, measure_runs
from esp_trainer.report.recorded import recorded
from esp_trainer.report.source import RunSource
from esp_trainer.report.story import Line, story
from esp_trainer.report.verdict import verdict
from esp_trainer.report.win_matrix import win_matrix
from esp_trainer.seeding import stream
from predprey_env.arrays import Starts
from predprey_env.settings import counted, flat

_SCRIPTS = (
    *("dom", "teams", "recording", "episode", "game", "behaviours", "painter", "timeline", "wants", "thoughts"),
    *("player", "dragging", "keys", "link", "yourself", "csv", "charts", "tour", "main"),
)
_DIAGONAL = "On the dotted line both are of the same generation."
_MATRIX = {
    True: ("Who catches whom", f"The fraction of prey caught in each pairing. {_DIAGONAL}"),
    False: ("Who beats whom", f"The mean payoff to the predators, the first team, in each pairing. {_DIAGONAL}"),
}
"""Title and explanation of the matrix, by whether payoffs are captures."""
_GENES = 2**22  # maximum size of all champions in a page, in bytes; beyond it the page holds only some generations


def write_page(
    sources: Sequence[RunSource],
    out: Path,
    settings: ReportOptions,
    say: Callable[[str], None],
    notes: Sequence[str] = (),
) -> None:
    """Measure runs, and write their page.

    Args:
        sources: Runs of the same world and length.
        out: File to write.
        settings: Numbers of generations and episodes to play.
        say: Function called with a line about what is being done.
        notes: Notes for the reader.
    """
    runs = measure_runs(sources, settings, say)
    say("writing the page ...")
    write_text(out, run_page(runs, notes))


def run_page(runs: Sequence[MeasuredRuns], notes: Sequence[str] = ()) -> str:
    """Return the page of some runs as HTML."""
    sources = [run.source for run in runs]
    phases, captures = moments.of_phases(runs), runs[0].captures
    rules, unplayable = _rules(sources)
    if not captures:  # no match of another game is played here anyhow
        unplayable = []
    lines = story(runs)
    shown = [*phases, *moments.of_behaviours(runs, without=[phase["behaviour"] for phase in phases])]
    data = {
        "world": matches.world_for_page(sources[0].config.env) if captures else None,
        "matrix": win_matrix(runs),
        "charts": charts(runs),
        **(recorded(runs, shown, _starts(runs)) if unplayable else _computed(runs, shown)),
    }
    return page(
        "page.html",
        "style.css",
        "script-src 'unsafe-inline'; img-src data: blob:",
        _title(sources),
        subtitle=escape(_subtitle(sources)),
        verdict=escape(verdict(runs)),
        lines=("one line", "two lines", "three lines", "four lines", "five lines")[len(lines) - 1],
        story="\n".join(map(_line, lines)),
        missing="\n".join(f"<li>{escape(line)}</li>" for line in [*notes, *unplayable, *_missing(sources)]),
        phases=escape(moments.why_no_phases(runs)),
        matrix_title=_MATRIX[captures][0],
        matrix_hint=_MATRIX[captures][1],
        glossary=asset("glossary.html" if captures else "glossary-of-game.html"),
        config=_config(sources[0].config),
        configured=escape(sources[0].name),
        plotly=get_plotlyjs(),
        data=_json(data),
        scripts="\n".join([rules, *map(_script, _SCRIPTS)]),
    )


def _line(line: Line) -> str:
    """Return a line of the story as HTML, with its figures on demand."""
    figures = f"<details><summary>figures</summary>{escape(line.figures)}</details>" if line.figures else ""
    return f"<li>{escape(line.words)} {figures}</li>"


def _rules(sources: Sequence[RunSource]) -> tuple[str, list[str]]:
    """Return the rules as JavaScript, and a note for each network or sight of the runs that has no translation."""
    floats = asset("floats.js")
    kinds = matches.kinds_in(source.history for source in sources if source.history)
    try:
        return matches.rules_in_javascript(floats, kinds), []
    except (ValueError, OSError) as error:  # OSError: the source of a class cannot be read
        alone = list(filter(None, map(_untranslated, kinds))) or [
            f"the rules have no translation to JavaScript ({error})"
        ]
        note = "The matches are recorded, as the page cannot compute them"
        return matches.rules_in_javascript(floats), [f"{note}: {why}." for why in alone]


def _untranslated(kind: type) -> str:
    """Return a clause if the rule of a network or sight by itself has no translation, else an empty text."""
    try:
        matches.rules_in_javascript("", [FeedForward, kind])
    except (ValueError, OSError) as error:
        return f"the rule of {kind.__name__} has no translation to JavaScript ({error})"
    return ""


def _script(name: str) -> str:
    return asset(f"{name}.js")


def _json(data: Any) -> str:
    """Return data as JSON for a script element, with "<" escaped so that no text in it can end the element."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _title(sources: Sequence[RunSource]) -> str:
    return sources[0].name if len(sources) == 1 else f"{sources[0].name} and {len(sources) - 1} more"


def _subtitle(sources: Sequence[RunSource]) -> str:
    config = sources[0].config
    env, game = config.env, config.game
    where = (
        game_of(game).words
        if game.environment
        else f"{counted(env.n_predators, 'predator')} against {env.n_prey} prey on a torus of {env.size} by {env.size}"
    )
    seeds = ", ".join(str(source.config.seed) for source in sources)
    presets = ", ".join(dict.fromkeys(source.config.preset for source in sources))
    return (
        f"{presets}, seed{'s' if len(sources) > 1 else ''} {seeds}: {counted(len(sources[0]), 'generation')}, {where}"
    )


def _missing(sources: Sequence[RunSource]) -> list[str]:
    of_runs: dict[str, list[str]] = {}
    for source in sources:
        for line in source.missing:
            of_runs.setdefault(line, []).append(source.name)
    several = len(sources) > 1
    lines = [f"{_names(names, sources)}: {line}" if several else line for line, names in of_runs.items()]
    unfinished = [source for source in sources if source.done < source.config.generations]
    return lines + [
        f"{each.name} has {each.done} of its {each.config.generations} generations so far." for each in unfinished
    ]


def _names(names: list[str], sources: Sequence[RunSource]) -> str:
    return "All runs" if len(names) == len(sources) else ", ".join(names)


def _computed(runs: Sequence[MeasuredRuns], shown: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the part of the page's data from which it computes matches, if the game is one that it can play."""
    playable = runs[0].captures
    return {
        "runs": _teams(runs, playable=playable),
        "starts": _starts(runs).tolist() if playable else [],
        "moments": shown,
    }


def _teams(runs: Sequence[MeasuredRuns], *, playable: bool) -> list[dict[str, Any]]:
    """Return the teams of each run: champions of all kept generations if they fit, else of the measured ones."""
    histories = [run.source.history for run in runs]
    size = sum(array.nbytes for history in histories if history for array in history.champions.values())
    return [
        {
            "name": run.source.name,
            "sides": matches.both(history, _kept(run, history, whole=size <= _GENES)) if history and playable else None,
        }
        for run, history in zip(runs, histories, strict=True)
    ]


def _kept(run: MeasuredRuns, history: History, *, whole: bool) -> GenerationIndices:
    if whole or run.own is None or run.watched is None:
        return history.kept
    played = run.own.predators if "predators" in history.champions else run.own.prey
    return np.union1d(played, run.watched.generations)


def _starts(runs: Sequence[MeasuredRuns]) -> Starts:
    """Return the starts of the cross-play, so that the matches behind each cell of the matrix can be played.

    They are int ``(n, n_agents, 2)``; none without a cross-play.
    """
    n = max((run.own.n_episodes for run in runs if run.own), default=0)
    return CellStarts(runs[0].source.config.env).held_out(stream(0, "cross-play"), n)[:, 0]


def _config(config: RunConfig) -> str:
    """Return all fields of a config as HTML, with those that differ from the preset marked."""
    usual = flat(preset(config.preset).model_dump()) if config.preset in PRESETS else None
    rows = []
    for name, value in flat(config.model_dump()).items():
        changed = usual is not None and name not in ("preset", "seed") and usual.get(name) != value
        mark = (
            f' class="changed" title="{escape(config.preset)} has {escape(str(usual.get(name, "none")))}"'
            if usual and changed
            else ""
        )
        rows.append(f"<div{mark}><dt>{escape(name)}</dt><dd>{escape(str(value))}</dd></div>")
    return "\n".join(rows)
