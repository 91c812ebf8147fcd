"""Reading of a run directory for a report: everything that can be shown, and notes on what is missing."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.analysis.exploiters import Exploiters, exploiters_in
from esp_trainer.analysis.genealogy import Genealogy, of_run
from esp_trainer.analysis.history import History, curve_names, curves_of, payoff_curve
from esp_trainer.analysis.pooling import cut_to_shortest
from esp_trainer.arrays import Curve, GenerationIndices, TeamGenomes
from esp_trainer.coevolution.hall_of_fame import kept_generations
from esp_trainer.coevolution.sides import side_config, side_controller
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.files import DamagedFileError
from esp_trainer.run.checkpoint import load_champions
from esp_trainer.run.directory import RunDirectory, records, whole_lines
from esp_trainer.types import ROLES, Role
from predprey_env.settings import counted

SPREADS = ("diversity", "scale", "signal", "ties")
"""Columns of :attr:`RunSource.spreads`."""


@dataclass(frozen=True)
class RunSource:
    """The readable part of a run."""

    name: str
    path: Path
    config: RunConfig
    done: int
    """Number of generations of the run, including those that are damaged."""
    history: History | None
    """Champions and curves of the same generations. None without champions, when nothing can be played. The curves are
    nan if the log is lost."""
    curves: dict[str, Curve]
    """Curves, see :attr:`History.curves`; empty if the log is lost."""
    spreads: dict[Role, Curve]
    """Statistics of each evolving side's subpopulations, ``(n_generations, 4)``, with columns :data:`SPREADS`. nan for
    statistics that the log lacks, and empty if it has none."""
    seconds: dict[str, Curve]
    """Wall time of each generation by phase, in seconds, ``(n_generations,)``; empty if not logged."""
    missing: tuple[str, ...]
    """Notes on everything that could not be read, with reasons."""
    exploiters: Exploiters | None = None
    """What the run's exploiters reached; None without any."""
    genealogies: dict[Role, Genealogy] = field(default_factory=dict)
    """Origins of each evolving side's genes, by generation; empty if the run keeps no parents."""

    def __len__(self) -> int:
        return len(self.history) if self.history else len(payoff_curve(self.curves))

    def first(self, n: int) -> RunSource:
        """Return the first ``n`` generations."""
        curves = {name: curve[:n] for name, curve in self.curves.items()}
        history = self.history and self.history.first(n)
        spreads = {role: values[:n] for role, values in self.spreads.items()}
        seconds = {phase: values[:n] for phase, values in self.seconds.items()}
        genealogies = {role: each.first(n) for role, each in self.genealogies.items()}
        exploiters = self.exploiters and self.exploiters.first(n)
        cuts: dict[str, Any] = {"history": history, "curves": curves, "genealogies": genealogies}
        cuts |= {"exploiters": exploiters}
        return replace(self, spreads=spreads, seconds=seconds, **cuts)


def cut(sources: Sequence[RunSource]) -> list[RunSource]:
    """Return the runs cut to the length of the shortest, see :func:`~.pooling.cut_to_shortest`."""
    n = min(map(len, sources))
    shorter = [source.first(n) for source in sources]
    histories = [source.history for source in shorter if source.history]
    same = iter(cut_to_shortest(histories) if histories else [])
    return [replace(source, history=next(same)) if source.history else source for source in shorter]


def read_source(path: Path) -> RunSource:
    """Read a run that is finished, in progress or damaged.

    Raises:
        FileNotFoundError: There is no run.
        DamagedFileError: The config cannot be read.
        ValueError: The run has no generation yet, or a class of its networks cannot be found.
    """
    directory = RunDirectory(path)
    config = directory.read_config()
    _check_networks(path, config)
    missing: list[str] = []
    lines = _lines(directory.metrics_file, missing)
    champions, kept = _champions(directory, config, missing)
    lengths = ([int(kept[-1]) + 1] if champions else []) + ([len(lines)] if lines else [])
    n = min(lengths, default=0)
    if not n:
        raise ValueError("; ".join([f"{path} has no generation yet: there is nothing to show", *missing]))
    curves = curves_of(lines[:n]) if lines else {}
    unknown = {name: np.full((n, 2) if name.startswith("trials") else n, np.nan) for name in curve_names(config)}
    history = History(config, champions, curves or unknown, kept).first(n) if champions else None
    genealogies = _genealogies(path, n, missing)
    return RunSource(
        name=path.resolve().name,
        path=path,
        config=config,
        done=max(lengths),
        history=history,
        curves=curves,
        spreads=_spreads(lines[:n], missing),
        seconds=_seconds(directory.timing_file, n, missing),
        exploiters=_exploiters(lines[:n], missing),
        missing=tuple(missing),
        genealogies=genealogies,
    )


def _check_networks(path: Path, config: RunConfig) -> None:
    """Raise :class:`ValueError`, in one line, unless the networks of a run, which its champions need, can be made."""
    try:
        for role in ROLES:
            if side_config(config, role).policy == "esp":
                side_controller(config, role)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _lines(log: Path, missing: list[str]) -> list[dict[str, Any]]:
    """Return the records of the log up to the first damaged line."""
    if not log.exists():
        missing.append(f"There is no {log.name}: no curves of success.")
    found = records(log)
    for number, record in enumerate(found):
        try:
            curves_of([record])
        except (ValueError, TypeError, KeyError):
            found = found[:number]
            break
    if len(found) < len(whole_lines(log)):
        missing.append(f"{log.name} is damaged: its line {len(found) + 1} and those after it are left out.")
    return found


def _champions(
    directory: RunDirectory, config: RunConfig, missing: list[str]
) -> tuple[dict[Role, TeamGenomes], GenerationIndices]:
    """Return the champions of each evolving side, and their generations, int ``(n_kept,)``.

    They are read from the checkpoint, or if that fails from the champions' own files, up to the first damaged file.
    """
    try:
        found, done = load_champions(directory.checkpoint_file, config)
        return found, kept_generations(done, config.esp.hof_size)
    except FileNotFoundError:
        pass  # the run has just begun, so this is not worth a note
    except ValueError as error:
        missing.append(f"{error}: the champions' own files are read instead.")
    genomes: dict[Role, dict[int, TeamGenomes]] = {}
    for role in [role for role in ROLES if side_config(config, role).policy == "esp"]:
        genomes[role] = _whole(directory, role, missing)
        if not genomes[role]:
            missing.append(f"{directory.champions.name} holds no {role}: no match can be played.")
            return {}, np.empty(0, int)
    kept = sorted(set.intersection(*map(set, genomes.values())))
    return {role: np.stack([teams[n] for n in kept]) for role, teams in genomes.items()}, np.array(kept)


def _whole(directory: RunDirectory, role: Role, missing: list[str]) -> dict[int, TeamGenomes]:
    """Return the champion of each generation of one side, from the champions' files up to the first damaged one."""
    genomes: dict[int, TeamGenomes] = {}
    for generation in directory.champion_generations(role):
        try:
            genomes[generation] = Team.load(directory.champion_file(role, generation)).genomes
        except DamagedFileError as error:
            missing.append(f"{error}: it and later champions are left out.")
            break
    return genomes


def _spreads(lines: list[dict[str, Any]], missing: list[str]) -> dict[Role, Curve]:
    try:
        roles: list[Role] = list(lines[0]["subpopulations"]) if lines else []
        told = {role: [line["subpopulations"][role] for line in lines] for role in roles}
        # Older logs have no signal of selection.
        return {role: np.array([[line.get(name) for name in SPREADS] for line in told[role]], float) for role in roles}
    except (KeyError, TypeError, ValueError):
        missing.append(
            "The log does not say how diverse the subpopulations were: it was made before that was recorded."
        )
        return {}


def _exploiters(lines: list[dict[str, Any]], missing: list[str]) -> Exploiters | None:
    try:
        found = exploiters_in(lines)
    except (KeyError, TypeError, ValueError):
        missing.append("The log tells of exploiters in another form: they are left out.")
        return None
    return found if len(found.generations) else None


def _genealogies(run: Path, n: int, missing: list[str]) -> dict[Role, Genealogy]:
    try:
        found = of_run(run)
        for role, each in found.items():
            if len(each) < n:
                whose = f"the genealogy of the {role}"
                raise DamagedFileError(f"{whose} holds only {len(each)} of {counted(n, 'generation')}")
        return {role: each.first(n) for role, each in found.items()}
    except (DamagedFileError, FileNotFoundError) as error:
        missing.append(f"{error}: no origins of genes.")
        return {}


def _seconds(log: Path, n: int, missing: list[str]) -> dict[str, Curve]:
    """Return the wall time of each generation by phase, in seconds. Missing generations are interpolated.

    A generation is missing if the process was killed before its line was written, or if it is the latest one of a run
    in progress, whose timing is written after its line in the metrics.
    """
    try:
        lines = {line["generation"]: line for line in map(json.loads, whole_lines(log)) if line["generation"] < n}
        known = sorted(lines)
        if len(known) < n / 2:
            raise ValueError(f"{len(known)} of {n}")
        if len(known) < n:
            missing.append(f"{log.name} lacks {n - len(known)} of {n} generations: they are interpolated.")
        phases = [name for name in lines[known[0]] if name != "generation"]
        every = np.arange(n)
        return {phase: np.interp(every, known, [lines[number][phase] for number in known]) for phase in phases}
    except (ValueError, TypeError, KeyError, IndexError, RecursionError):
        missing.append(f"{log.name} cannot be read: no timings.")
        return {}
