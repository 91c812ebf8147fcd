"""The history of a run, as its analysis needs it: champions and curves by generation."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from esp_trainer.arrays import Curve, GenerationIndices, TeamGenomes
from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.hall_of_fame import kept_generations
from esp_trainer.coevolution.league import NO_LEAGUE, League
from esp_trainer.coevolution.sides import new_sides, side_config, side_controller, side_shape
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team, as_candidates
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from esp_trainer.run.checkpoint import load_champions
from esp_trainer.run.directory import RunDirectory, whole_lines
from esp_trainer.run.trainer import metrics_record
from esp_trainer.types import ROLES, Contestant, Evaluator, EvolvedTeams, Fixed, Role, ScriptedTeams, TeamBatch
from predprey_env.settings import PartError


@dataclass(frozen=True)
class History:
    """The champions and curves of a finished or unfinished run."""

    config: RunConfig
    champions: dict[Role, TeamGenomes]
    """Genomes of the champions of each evolving side in the generations ``kept``, float32
    ``(n_kept, n_agents, n_networks, n_hidden, n_genes)``."""
    curves: dict[str, Curve]
    """Curves by name, float64 ``(n_generations, ...)``: those of :data:`CURVES`, or those of :data:`PAYOFF_CURVES` in
    another game than the predator-prey world.

    Champion against champion, from held-out starts: ``caught`` (fraction of prey caught), ``all_caught`` and
    ``none_caught`` (fractions of episodes), ``caught_by_even`` (fraction of prey caught, by number of predators that
    start at an even distance) and ``steps`` (length of an episode). In the trials of each side, ``(n_generations, 2)``
    with nan for a fixed side: ``trials_caught`` (fraction of prey caught) and ``trials_mean`` (mean fitness).
    In another game ``payoff`` and ``trials_payoff`` take the place of all fractions of prey."""
    kept: GenerationIndices = field(default=None)  # type: ignore[arg-type]  # filled in below
    """Generations whose champions are kept, int ``(n_kept,)``; by default all. Fewer if the run is longer than its hall
    of fame."""

    def __post_init__(self) -> None:
        if self.kept is None:
            object.__setattr__(self, "kept", np.arange(len(self)))

    def __len__(self) -> int:
        return len(self.payoff)

    @property
    def payoff(self) -> Curve:
        """Payoff to the predators, champion against champion, float64 ``(n_generations,)``.

        In the predator-prey world it is the fraction of prey caught.
        """
        return payoff_curve(self.curves)

    def __repr__(self) -> str:
        """Return one line without the arrays."""
        return f"<History: preset {self.config.preset}, seed {self.config.seed}, {len(self)} generations>"

    @classmethod
    def evolve(
        cls,
        config: RunConfig,
        evaluator: Evaluator,
        watch: Callable[[], object] = lambda: None,
        fixed: Mapping[Role, Fixed] = MappingProxyType({}),
        league: League = NO_LEAGUE,
    ) -> History:
        """Run a config in memory.

        Args:
            config: Config to run.
            evaluator: Evaluator of the config's world.
            watch: Function called after each generation.
            fixed: Teams that play a side without evolving, whatever the config says about that side.
            league: Champions of other runs, added to the opponent pools.
        """
        config = league.enter(config)
        run = Coevolution(config, {**new_sides(config, league), **fixed}, evaluator)
        records = []
        for number in range(config.generations):
            generation = run.step(number)
            records.append(metrics_record(generation, generation.held_out.as_dict()))
            watch()
        champions = {role: side.hall_of_fame.champions.copy() for role, side in run.evolving.items()}
        kept = kept_generations(config.generations, config.esp.hof_size)
        return cls(config, champions, curves_of(records), kept)

    @classmethod
    def of_run(cls, path: Path | str) -> History:
        """Read a run directory, up to its last checkpoint.

        Raises:
            FileNotFoundError: There is no run, or no checkpoint yet.
            ValueError: The run has no generation yet.
            DamagedFileError: A file cannot be read.
        """
        directory = RunDirectory(path)
        config = directory.read_config()
        if not directory.checkpoint_file.exists():
            raise FileNotFoundError(f"{path} has no checkpoint yet: there is nothing to analyse")
        champions, done = load_champions(directory.checkpoint_file, config)
        if not done:
            raise ValueError(f"{path} has no generation yet: there is nothing to analyse")
        lines = whole_lines(directory.metrics_file)[:done]
        if len(lines) < done:
            raise DamagedFileError(f"{directory.metrics_file} must hold {done} whole lines, got {len(lines)}")
        try:
            curves = curves_of(json.loads(line) for line in lines)
        except (ValueError, KeyError, TypeError) as error:
            raise DamagedFileError(f"{directory.metrics_file} is damaged: {error}") from None
        return cls(config, champions, curves, kept_generations(done, config.esp.hof_size))

    def save(self, path: Path | str) -> None:
        """Write the history to one file."""
        arrays = {f"champions.{role}": array for role, array in self.champions.items()}
        arrays |= {f"curves.{name}": array for name, array in self.curves.items()}
        if len(self.kept) < len(self):
            arrays["kept"] = self.kept
        write_arrays(Path(path), "history", {"config": self.config.model_dump()}, arrays)

    @classmethod
    def load(cls, path: Path | str) -> History:
        """Read a file that :meth:`save` wrote; raise :class:`DamagedFileError` for any other file."""
        header, arrays = read_arrays(Path(path), "history", finite=False)
        champions = {role: arrays[f"champions.{role}"] for role in ROLES if f"champions.{role}" in arrays}
        curves = {name.removeprefix("curves."): array for name, array in arrays.items() if name.startswith("curves.")}
        try:
            config = RunConfig.from_dict(header["config"])
            names = curve_names(config)
            kept = arrays.get("kept", np.arange(len(curves[names[0]])))
            return cls(config, champions, {name: curves[name] for name in names}, kept)
        except KeyError as error:
            raise DamagedFileError(f"{path} is not a usable history: {error.args[0]} is missing") from None
        except PartError as error:
            raise PartError(f"{path}: {error}") from None
        except ValueError as error:
            raise DamagedFileError(f"{path} is not a usable history: {error}") from None

    def first(self, n: int, kept: GenerationIndices | None = None) -> History:
        """Return the history of the first ``n`` generations.

        Args:
            n: Number of generations.
            kept: Generations whose champions to keep, int ``(n_kept,)``; by default all that are kept and below ``n``.
        """
        kept = self.kept[self.kept < n] if kept is None else kept
        champions = {role: self.genomes(role, kept) for role in self.champions}
        return History(self.config, champions, {name: curve[:n] for name, curve in self.curves.items()}, kept)

    def sample(self, n: int) -> GenerationIndices:
        """Return at most ``n`` generations with kept champions, evenly spread from the first to the last."""
        return self.kept[np.unique(np.linspace(0, len(self.kept) - 1, n).round().astype(int))]

    def genomes(self, role: Role, generations: GenerationIndices) -> TeamGenomes:
        """Return the champions' genomes of some generations; raise :class:`ValueError` if one is not kept."""
        rows = np.searchsorted(self.kept, generations)
        found = self.kept[np.minimum(rows, len(self.kept) - 1)] == generations
        if not found.all():
            raise ValueError(f"no champion is kept of generation {generations[~found][0]}")
        return self.champions[role][rows]

    def entrants(self, role: Role, generations: GenerationIndices) -> TeamBatch:
        """Return the champions of some generations as teams for a cross-play; for a scripted side, the script.

        Team ``t`` of the batch is the champion of ``generations[t]``.
        """
        if role not in self.champions:
            return ScriptedTeams(side_config(self.config, role).policy)
        genomes = as_candidates(self.genomes(role, generations))
        indices = np.broadcast_to(
            np.arange(len(generations))[:, None, None, None], (len(generations), *genomes.shape[:3])
        )
        return EvolvedTeams(side_controller(self.config, role), genomes, indices)

    def team(self, role: Role, generation: int) -> Team:
        """Return a generation's champion as a policy; raise :class:`ValueError` for a side that did not evolve."""
        if role not in self.champions:
            raise ValueError(f"the {role} of this run are a script: {side_config(self.config, role).policy}")
        origin = {**self.config.model_dump(), "generation": generation}
        side, controller = side_config(self.config, role), side_controller(self.config, role)
        (genomes,) = self.genomes(role, np.array([generation]))
        return Team(role, side, controller, genomes, origin, side_shape(self.config, role).n_seen)

    def player(self, role: Role, generation: int) -> Contestant:
        """Return the team that plays a side in a generation: the champion, or the script of a scripted side."""
        if role in self.champions:
            return self.team(role, generation)
        return ScriptedTeams(side_config(self.config, role).policy)


CURVES = ("caught", "all_caught", "none_caught", "caught_by_even", "steps", "trials_caught", "trials_mean")
"""Names of the curves of :class:`History`; the first is the payoff to the predators."""
PAYOFF_CURVES = ("payoff", "steps", "trials_payoff", "trials_mean")
"""Names of the curves in another game than the predator-prey world."""


def curve_names(config: RunConfig) -> tuple[str, ...]:
    """Return the names of the curves of a config's runs."""
    return PAYOFF_CURVES if config.game.environment else CURVES


def payoff_curve(curves: Mapping[str, Curve]) -> Curve:
    """Return the curve of the payoff to the predators."""
    return curves["payoff"] if "payoff" in curves else curves["caught"]


def curves_of(records: Iterable[dict[str, Any]]) -> dict[str, Curve]:
    """Return the curves of :class:`History` from the records of ``metrics.jsonl``."""

    def row(record: dict[str, Any]) -> dict[str, Any]:
        held_out, trials = record["held_out"], record["trials"]
        if "payoff" in held_out:
            return {
                "payoff": held_out["payoff"]["rate"],
                "steps": held_out["steps"],
                "trials_payoff": [trials[role]["payoff"] if role in trials else np.nan for role in ROLES],
                "trials_mean": [trials[role]["mean"] if role in trials else np.nan for role in ROLES],
            }
        return {
            "caught": held_out["caught"]["rate"],
            "all_caught": held_out["predators_succeed"]["rate"],
            "none_caught": held_out["prey_succeed"]["rate"],
            "caught_by_even": [rate["rate"] if rate else np.nan for rate in held_out["caught_by_even"]],
            "steps": held_out["steps"],
            "trials_caught": [trials[role]["caught"] if role in trials else np.nan for role in ROLES],
            "trials_mean": [trials[role]["mean"] if role in trials else np.nan for role in ROLES],
        }

    rows = [row(record) for record in records]
    names = PAYOFF_CURVES if rows and "payoff" in rows[0] else CURVES
    return {name: np.array([row[name] for row in rows], np.float64) for name in names}
