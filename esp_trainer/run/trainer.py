"""The training loop, which writes to disk all that another program or a resumed run needs."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing
from math import isnan
from time import perf_counter
from typing import Any

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.generation import Generation
from esp_trainer.coevolution.hall_of_fame import kept_generations
from esp_trainer.coevolution.league import NO_LEAGUE, League
from esp_trainer.coevolution.sides import new_sides, side_config, side_shape
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.files import sync_directory
from esp_trainer.run.checkpoint import (
    NO_MATTER,
    check_algorithms,
    follow_from,
    generations_in,
    load_checkpoint,
    save_checkpoint,
)
from esp_trainer.run.directory import Log, RunDirectory, records, versions
from esp_trainer.run.genealogy import GenealogyLog
from esp_trainer.run.genealogy import rewind as rewind_genealogy
from esp_trainer.run.lock import Lock
from esp_trainer.types import Evaluator
from predprey_env.settings import counted


class Trainer:
    """A run in a directory. Call :meth:`start` or :meth:`resume`, then iterate over :meth:`generations`.

    A generation happens wholly or not at all: after an exception, such as Ctrl-C, call :meth:`generations` again or
    :meth:`resume` the run.
    """

    def __init__(
        self, directory: RunDirectory, config: RunConfig, coevolution: Coevolution, saved: int, lock: Lock
    ) -> None:
        self.directory = directory
        self._lock = lock
        self.config = config
        self.coevolution = coevolution
        self._saved = saved  # generations in the checkpoint
        self._stopping = False
        self._going: weakref.ref[Generator[Generation, None, None]] | None = None
        # Provenance that all champions of the run share.
        self._origin = {**config.model_dump(exclude=set(NO_MATTER)), "version": versions()["predprey-esp"]}

    @classmethod
    def start(
        cls,
        directory: RunDirectory,
        config: RunConfig,
        make: Callable[[RunConfig], Evaluator],
        league: League = NO_LEAGUE,
    ) -> Trainer:
        """Start a run in an empty directory. ``make`` returns its evaluator; a ``league`` is copied there."""
        config = league.enter(config)
        sides = new_sides(config, league)
        lock = directory.create(config, league)
        try:
            return cls(directory, config, Coevolution(config, sides, make(config)), 0, lock)
        except BaseException:  # Ctrl-C included, for example while the kernel compiles
            directory.discard()
            raise

    @classmethod
    def resume(
        cls, directory: RunDirectory, make: Callable[[RunConfig], Evaluator], generations: int | None = None
    ) -> Trainer:
        """Resume the run of a directory from its last checkpoint, optionally with another number of generations."""
        config = directory.read_config()
        lock = directory.lock()
        try:
            wanted = config.replace(generations=generations) if generations else config
            league = directory.read_league(config)
            sides, done = new_sides(config, league), 0
            if directory.checkpoint_file.exists():
                check_algorithms(directory.checkpoint_file, config)
                sides, done = load_checkpoint(directory.checkpoint_file, config, league)
            if done > wanted.generations:
                raise ValueError(f"generations must be at least the {done} that this run has done, got {generations}")
            directory.rewind(done)
            rewind_genealogy(directory, wanted, done)
            _keep_champions(directory, wanted, done)
            if wanted != config:
                directory.write_config(wanted)
            return cls(directory, wanted, Coevolution(wanted, sides, make(wanted)), done, lock)
        except BaseException:
            directory.unlock()
            raise

    @property
    def done(self) -> int:
        """Number of generations so far."""
        return self.coevolution.done

    def stop(self) -> None:
        """End the running call of :meth:`generations` after its current generation, or else the next call at once."""
        self._stopping = True

    def generations(self) -> Iterator[Generation]:
        """Run, and yield each generation once it is on disk. A call continues where the one before it ended.

        Raises :class:`BlockingIOError` if another trainer, thread or process works on the run, and :class:`ValueError`
        if the run is no longer as an earlier call left it.
        """
        if self._going and (earlier := self._going()):  # a notebook keeps the loop of an interrupted cell alive
            try:
                earlier.close()
            except ValueError:
                raise BlockingIOError(f"{self.directory.path} is in use by another thread") from None
        generations = self._run()
        self._going = weakref.ref(generations)  # weak, so that leaving the loop ends the generator
        return generations

    def _run(self) -> Generator[Generation, None, None]:
        with ExitStack() as held:  # releases the lock even if a log cannot be closed on a full disk
            held.callback(self._let_go)
            self._take_up()
            if not self.done and not follow_from(self.config, self.coevolution.sides):
                self._write_checkpoint()  # so that resume refuses a user's own algorithm from the beginning
            metrics = held.enter_context(closing(Log(self.directory.metrics_file)))
            timing = held.enter_context(closing(Log(self.directory.timing_file)))
            genealogy = held.enter_context(closing(GenealogyLog(self.directory, self.config)))
            while self.done < self.config.generations and not self._stopping:
                generation, sides = self.coevolution.play(self.done)
                begun = perf_counter()
                held_out = generation.held_out.as_dict()
                self._save_champions(generation, held_out)
                genealogy.append(generation.number, generation.bred)
                metrics.append(metrics_record(generation, held_out))
                self.coevolution.sides = sides  # from here on the generation counts
                if self.done % self.config.checkpoint_every == 0:
                    self._save_checkpoint(metrics, genealogy)
                seconds = {**generation.seconds, "files": perf_counter() - begun}
                timing.append({"generation": generation.number, **{k: round(v, 6) for k, v in seconds.items()}})
                yield generation
            self._save_checkpoint(metrics, genealogy)

    def _take_up(self) -> None:
        """Lock the directory again after an earlier call, and undo the generation that the call left unfinished."""
        if self._lock.held:
            return
        self._lock = self.directory.lock()
        saved, logged = (
            generations_in(self.directory.checkpoint_file, self.config),
            records(self.directory.metrics_file),
        )
        if not self._saved <= saved <= self.done <= len(logged):
            left = (
                f"{self.directory.path} is no longer as this trainer left it after {counted(self.done, 'generation')}"
            )
            raise ValueError(f"{left}: go on by Trainer.resume")
        self._saved = saved
        self.directory.rewind(self.done)
        rewind_genealogy(self.directory, self.config, self.done)

    def __getstate__(self) -> dict[str, Any]:
        """Leave the running loop out of copies and pickles."""
        return self.__dict__ | {"_going": None}

    def _let_go(self) -> None:
        self._stopping = False
        self._lock.release()

    def _save_checkpoint(self, *logs: Log | GenealogyLog) -> None:
        """Write a checkpoint, unless there is one of this generation already."""
        if self._saved == self.done:
            return
        for log in logs:  # they and the champions must be on disk before a checkpoint that counts them
            log.sync()
        sync_directory(self.directory.champions)
        self._write_checkpoint()
        _keep_champions(self.directory, self.config, self.done)

    def _write_checkpoint(self) -> None:
        save_checkpoint(self.directory.checkpoint_file, self.config, self.coevolution.sides, self.done)
        self._saved = self.done
        sync_directory(self.directory.path)

    def _save_champions(self, generation: Generation, held_out: dict[str, Any]) -> None:
        config = self.config
        for role, champion in generation.champions.items():
            progress = {"generation": generation.number, "score": champion.score, "held_out": held_out}
            side = side_config(config, role)
            team = Team(
                role,
                side,
                champion.controller,
                champion.genomes,
                {**self._origin, **progress},
                side_shape(config, role).n_seen,
            )
            team.save(self.directory.champion_file(role, generation.number))


def _keep_champions(directory: RunDirectory, config: RunConfig, done: int) -> None:
    """Delete the files of champions that are no longer in the hall of fame."""
    kept = kept_generations(done, config.esp.hof_size)
    if len(kept) < done:
        directory.keep_champions(set(kept.tolist()))


def _rounded(values: dict[str, float]) -> dict[str, float | None]:
    """Return JSON values without the last digits of sums, which differ between processors; None for nan."""
    return {name: None if isnan(value) else round(value, 4) for name, value in values.items()}


def metrics_record(generation: Generation, held_out: dict[str, Any]) -> dict[str, Any]:
    """Return a line of ``metrics.jsonl``."""
    payoff = "caught" if "caught" in held_out else "payoff"  # the fraction of prey caught, or that of another game
    return {
        "generation": generation.number,
        "trials": {
            role: {"mean": float(t.fitness.mean()), "best": float(t.fitness.mean(axis=1).max()), payoff: t.payoff}
            for role, t in generation.trials.items()
        },
        "champions": {role: champion.score for role, champion in generation.champions.items()},
        "subpopulations": {
            role: _rounded(spread._asdict() | {"signal": signal.share, "ties": signal.ties})
            for (role, spread), signal in zip(generation.spreads.items(), generation.signals.values(), strict=True)
        },
        "held_out": held_out,
        **({"exploited": generation.exploited} if generation.exploited else {}),
    }
