"""Leaderboards: Markdown files of results, each result with all that is needed to verify it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

from esp_trainer.benchmark.gauntlet import PARTS
from esp_trainer.benchmark.report import BenchmarkResult
from esp_trainer.files import write_text
from esp_trainer.statistics import in_points
from esp_trainer.types import Role
from predprey_env.policies import SCRIPTS
from predprey_env.settings import brief

_TITLE = "# Leaderboard\n\n"
_OPENING = "The best policies of each task, against evolved teams that are held out from training:\n\n"
_INTRODUCTION = """\
How well policies do against teams that are held out from training, in fractions of the prey: caught for predators, not
caught for prey; best first. *Held out* are teams of the race presets, *older* those of the first zoo. A row is made by
the command in it, with `--leaderboard` and the name of this file behind it.
*policy* is the SHA-256 of the file that holds it, *zoo* that of the teams that it met, both shortened.
"""
_BEST: dict[Role, str] = {
    "predators": "the best predators catch {} of the held-out prey",
    "prey": "the best prey escape {} of the time from held-out predators",
}
_BAR = r"\|"
"""Markdown of a bar inside a cell."""
_HEAD = (
    "| name | held out | worst tenth | older | zoo | scripts | rating | gain | exploited | policy | zoo | version "
    "| command |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def append(path: Path, result: BenchmarkResult) -> None:
    """Insert a result into a leaderboard by rank. It replaces a result of the same policy, zoo, version and command.

    Raises :class:`ValueError` if the result is not complete, or if the file holds anything but a leaderboard.
    """
    if result.standing is None:
        raise ValueError("only a candidate that met the whole gauntlet can be on a leaderboard")
    tables = read_leaderboard(path)
    row, title = _row(result), f"{result.task}, {result.role}"
    rows = [each for each in tables.get(title, []) if _identity(each) != _identity(row)]
    tables[title] = sorted([*rows, row], key=lambda each: (-float(_cells(each)[1]), each))
    write_leaderboard(path, tables)


def write_leaderboard(path: Path, tables: Mapping[str, Sequence[str]]) -> None:
    """Write a leaderboard: its answer, its introduction, and the rows under each title, best first."""
    parts = [f"## {title}\n\n{_HEAD}\n" + "\n".join(tables[title]) + "\n" for title in sorted(tables)]
    write_text(path, "\n".join([f"{_TITLE}{_OPENING}{_answer(tables)}\n\n{_INTRODUCTION}", *parts]))


def _answer(tables: Mapping[str, Sequence[str]]) -> str:
    """Return a list item for each task: the scores of its best predators and prey, beside those of scripts."""
    clauses: dict[str, list[str]] = {}
    for title in sorted(tables):
        task, _, role = title.partition(", ")
        if tables[title] and role in SCRIPTS:
            clauses.setdefault(task, []).append(_clause(tables[title], role))
    return "\n".join(f"- On `{task}` {', and '.join(both)}." for task, both in clauses.items())


def _clause(rows: Sequence[str], role: Role) -> str:
    """Return the score of a side's best policy, and of the best script (or, if a script is best, of the best other)."""
    found = [(f"{float(cells[1]):.2f}", cells[-4].strip("`") in SCRIPTS[role]) for cells in map(_cells, rows)]
    best, scripted = found[0]
    other = next((score for score, is_script in found if is_script != scripted), None)
    beside = ["a script"] if scripted else []
    if other is not None:
        beside.append(f"the best {'other policy' if scripted else 'script'} {other}")
    return _BEST[role].format(best) + (f" ({'; '.join(beside)})" if beside else "")


def read_leaderboard(path: Path) -> dict[str, list[str]]:
    """Return the rows under each title of a leaderboard; none if the file does not exist yet.

    Raises :class:`ValueError` if the file holds anything else, which writing the leaderboard would lose.
    """
    text = path.read_bytes().decode() if path.exists() else _TITLE + _INTRODUCTION
    answer, introduction, rest = text.partition(_INTRODUCTION)
    # Older releases wrote no answer, or one line of it, and no opening.
    if not introduction or not re.fullmatch(rf"{_TITLE}({_OPENING})?(((- )?On `\w+` the best .+\n)+\n)?", answer):
        raise ValueError(f"{path} is not a leaderboard: it does not begin with the introduction of one")
    before, *parts = re.split(r"^## (.+)$", rest, flags=re.MULTILINE)
    tables: dict[str, list[str]] = {}
    for title, body in zip(["the introduction", *parts[::2]], [before, *parts[1::2]], strict=True):
        lines = [line for line in body.splitlines() if line.strip()]
        head, rows = lines[:2], lines[2:]
        if lines and "\n".join(head) != _HEAD:
            raise ValueError(f"{path} holds under {title} a line that is not a leaderboard's: {brief(lines[0])}")
        for row in rows:
            if not _is_row(row):
                raise ValueError(f"{path} holds a line that is not a leaderboard's row: {brief(row)}")
        if title in parts[::2]:
            tables[title] = rows
    return tables


def _is_row(line: str) -> bool:
    cells = _cells(line)
    try:
        return len(cells) == _HEAD.splitlines()[0].count(" | ") + 1 and float(cells[1]) >= 0
    except ValueError:
        return False


def _row(result: BenchmarkResult) -> str:
    standing = result.standing
    assert standing is not None
    held_out, older, zoo, scripts = (standing.generalist.get(part) for part in PARTS)
    worst = held_out and (held_out[1],)
    cells = [
        result.name,
        *("-" if score is None else f"{score[0]:.3f}" for score in (held_out, worst, older, zoo, scripts)),
        in_points(standing.rating),
        f"{standing.gain:+z.3f}",
        f"{standing.exploited:z.3f}",
        f"`{result.digest[:16]}`",
        f"`{result.zoo[:8]}`",
        version("predprey-esp"),
        f"`{result.command}`",
    ]
    return f"| {' | '.join(' '.join(cell.replace('|', _BAR).split()) for cell in cells)} |"


def _cells(row: str) -> list[str]:
    return [cell.strip() for cell in row.strip().removeprefix("|").removesuffix("|").split(" | ")]


def _identity(row: str) -> tuple[str, ...]:
    """Return the cells that identify a result: policy, zoo, version and command."""
    return tuple(_cells(row)[-4:])
