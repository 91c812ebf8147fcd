"""The genealogy of a run: a file for each evolving side with the parents of every neuron that was bred.

A file begins with a line of JSON, its :class:`Layout`. A record of constant size for each generation follows.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from esp_trainer.coevolution.generation import Bred
from esp_trainer.coevolution.sides import side_config, side_controller, side_shape
from esp_trainer.config import RunConfig
from esp_trainer.files import SCHEMA, DamagedFileError, naming, sync, sync_directory
from esp_trainer.run.directory import Log, RunDirectory
from esp_trainer.types import ROLES, Role
from predprey_env.settings import counted


@dataclass(frozen=True)
class Layout:
    """The sizes of one side's ``S`` subpopulations, from which the layout of its records follows."""

    used: tuple[int, ...]
    """Number of genes of a neuron of each subpopulation, ``(S,)``."""
    size: int
    """Number of neurons in a subpopulation."""
    n_elite: int
    """Number of neurons of a subpopulation that breed."""
    hof_mates: int
    """Number of pairs, the last ones, that may have a past champion as mate."""

    @classmethod
    def of(cls, config: RunConfig, role: Role) -> Layout:
        """Return the layout of one side of a run."""
        controller, esp = side_controller(config, role), config.esp
        genome = [used for used in controller.used_genes for _ in range(controller.n_hidden)]
        n_genomes = controller.n_genomes(side_shape(config, role).n_agents)
        return cls(tuple(genome * n_genomes), esp.subpopulation_size, esp.n_elite, esp.hof_mates)

    @property
    def record(self) -> np.dtype[np.void]:
        """Layout of a generation's record, in the smallest integers that hold the values."""
        n, slot = len(self.used), np.min_scalar_type(self.size - 1).newbyteorder("<")
        return np.dtype(
            [
                ("generation", "<u4"),
                ("burst", "u1"),
                ("champion", slot, (n,)),
                ("elite", slot, (n, self.n_elite)),
                ("mates", slot, (n, self.n_elite)),
                ("cuts", np.min_scalar_type(max(self.used)).newbyteorder("<"), (n, self.n_elite)),
                ("children", slot, (n, 2 * self.n_elite)),
                ("past", "<i4", (n, self.hof_mates)),
            ]
        )

    @property
    def header(self) -> bytes:
        """First line of the file."""
        return json.dumps({"kind": "genealogy", "schema": SCHEMA, **asdict(self)}).encode() + b"\n"

    def pack(self, number: int, bred: Bred) -> bytes:
        """Return the record of a generation."""
        record = np.zeros((), self.record)
        record["generation"], record["burst"], record["champion"] = number, bred.burst, bred.champion
        for name, values in bred.parents._asdict().items():
            record[name] = values
        return record.tobytes()


def evolving(config: RunConfig) -> list[Role]:
    """Return the sides of a run that have a genealogy."""
    return [role for role in ROLES if config.genealogy and side_config(config, role).policy == "esp"]


class GenealogyLog:
    """Appends the parents of each generation to the genealogy of a run, if the run keeps one.

    Args:
        directory: Directory of the run.
        config: Config of the run.
    """

    def __init__(self, directory: RunDirectory, config: RunConfig) -> None:
        self._place = directory.genealogy
        self._layouts = {role: Layout.of(config, role) for role in evolving(config)}
        self._logs: dict[Role, Log] = {}
        self._held = ExitStack()
        if self._layouts:
            self._place.mkdir(exist_ok=True)
        for role in self._layouts:
            self._logs[role] = self._held.enter_context(closing(Log(directory.genealogy_file(role))))

    def append(self, number: int, bred: Mapping[Role, Bred]) -> None:
        """Add the record of a generation to the file of each side."""
        for role, log in self._logs.items():
            layout = self._layouts[role]
            log.write((b"" if number else layout.header) + layout.pack(number, bred[role]))

    def sync(self) -> None:
        """Wait until all records are on disk, where the system can."""
        for log in self._logs.values():
            log.sync()
        if self._logs:
            sync_directory(self._place)

    def close(self) -> None:
        """Close the files."""
        self._held.close()


def rewind(directory: RunDirectory, config: RunConfig, generations: int) -> None:
    """Go back to a checkpoint after some generations: cut off later records."""
    for role in evolving(config):
        file = directory.genealogy_file(role)
        if not generations:  # the first record brings the header again
            file.unlink(missing_ok=True)
            continue
        layout, records = read_genealogy(file)
        if layout != Layout.of(config, role):
            raise DamagedFileError(f"{file} is damaged: it belongs to another config")
        if len(records) < generations:
            raise DamagedFileError(f"{file} must hold {counted(generations, 'generation')}, got {len(records)}")
        with naming(file), file.open("r+b") as opened:
            opened.truncate(len(layout.header) + generations * layout.record.itemsize)
            sync(opened.fileno())


def read_genealogy(file: Path) -> tuple[Layout, np.ndarray]:
    """Return the layout and the records of a side's genealogy, ``(n_generations,)``, without a record that was cut off.

    Raises:
        FileNotFoundError: There is no such file.
        DamagedFileError: The file is damaged.
    """
    if not file.is_file():
        raise FileNotFoundError(f"{file} is not there")
    header, _, rest = file.read_bytes().partition(b"\n")
    try:
        layout = _layout(json.loads(header))
    except (ValueError, RecursionError) as error:
        raise DamagedFileError(f"{file} is damaged: {error}") from None
    n = len(rest) // layout.record.itemsize
    records = np.frombuffer(rest, layout.record, n)
    wrong = np.flatnonzero(records["generation"] != np.arange(n))
    if len(wrong):
        raise DamagedFileError(f"{file} is damaged: record {wrong[0] + 1} is not generation {wrong[0]}")
    return layout, records


def _layout(header: Any) -> Layout:
    """Return the layout of a header; raise :class:`ValueError` if it has none."""
    if not isinstance(header, dict) or header.pop("kind", None) != "genealogy" or header.pop("schema", None) != SCHEMA:
        raise ValueError(f"it must be a genealogy of schema {SCHEMA}")
    try:
        layout = Layout(**header | {"used": tuple(header["used"])})
        sizes = [*layout.used, layout.size, layout.n_elite, layout.hof_mates + 1]
        if not layout.used or not all(isinstance(size, int) and size > 0 for size in sizes):
            raise ValueError
    except (TypeError, ValueError, KeyError):
        raise ValueError("its header holds no sizes") from None
    return layout
