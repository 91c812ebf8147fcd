"""``train`` and ``resume``: a run, with its progress on the terminal."""

from __future__ import annotations

import os
import shlex
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType

from tqdm import tqdm

from esp_trainer.analysis.exploiters import exploiters_of
from esp_trainer.analysis.league import league_of_runs
from esp_trainer.cli.signals import handled_by, write_from_handler
from esp_trainer.cli.streams import say
from esp_trainer.cluster import connected
from esp_trainer.coevolution.generation import Generation
from esp_trainer.coevolution.sides import side_config, side_controller
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.registry import make_evaluator
from esp_trainer.evaluation.sharded import LEAST_EPISODES, ShardedEvaluator
from esp_trainer.run.checkpoint import generations_in
from esp_trainer.run.directory import RunDirectory, versions
from esp_trainer.run.tensorboard import TensorBoardLog, check_tensorboard_installed
from esp_trainer.run.trainer import Trainer, metrics_record
from esp_trainer.statistics import Captures, Payoffs, results_in_short
from esp_trainer.types import ROLES, Evaluator, Role
from predprey_env.settings import counted

_BAR = "generation {n_fmt}/{total_fmt} {bar:6} {desc} | {rate_inv_fmt}, {remaining} left"  # fits in 80 columns
_RECENT = 20  # number of generations in the closing summary, and in the check for disengagement
_ALIKE = 0.95  # least fraction of tied trials in these generations that counts as a lost gradient


@dataclass(frozen=True)
class Players:
    """Computing resources that play a run's trials: threads of this process, or a cluster."""

    threads: int | None = None
    """Number of threads of this process; by default one per core."""
    address: str | None = None
    """Address of a Ray cluster that plays trials in shards, see :func:`esp_trainer.cluster.connected`."""

    def connected(self) -> AbstractContextManager[None]:
        """Return a context manager that connects to the cluster, if there is one."""
        return connected(self.address) if self.address else nullcontext()

    def evaluator(
        self, config: RunConfig, undo: Callable[[], object] = lambda: None, *, prepare: bool = True
    ) -> Evaluator:
        """Return an evaluator with a compiled kernel; a signal during the compilation calls ``undo`` and exits.

        With ``prepare=False`` nothing is compiled yet.
        """
        threads, episodes = self.threads, config.esp.n_trials * config.esp.n_episodes
        if self.address and config.game.environment:
            raise ValueError(f"--address plays the predator-prey world alone, got {config.game.environment}")
        if self.address and episodes < 2 * LEAST_EPISODES:
            say(f"a generation of {counted(episodes, 'episode')} is played here: on the cluster it would take longer")
        evaluator = ShardedEvaluator(config.env, threads=threads) if self.address else make_evaluator(config, threads)
        if not prepare:
            return evaluator
        what = "networks" if config.game.environment else "kernel"
        say(f"preparing the compiled {what} (some 15 s the first time, then from the cache) ...")

        def leave(number: int, _frame: FrameType | None) -> None:
            undo()
            write_from_handler("esp-trainer: interrupted")
            os._exit(128 + number)  # an exception would be lost where LLVM calls back to Python

        evolving = [role for role in ROLES if side_config(config, role).policy == "esp"]
        controllers = {role: side_controller(config, role) for role in evolving}
        with handled_by(leave):
            evaluator.compile(**controllers)
        return evaluator


@dataclass(frozen=True)
class Following:
    """Settings of the output about a run's progress."""

    quiet: bool = False
    """If true, print a line per checkpoint instead of a progress bar."""
    tensorboard: bool = False
    """If true, write event files for TensorBoard to the run's directory."""


def train(
    config: RunConfig, out: Path | None, players: Players, following: Following, league_runs: Sequence[Path] = ()
) -> int:
    """Begin a run. Champions of ``league_runs``, if any, are added to its opponent pools."""
    if following.tensorboard:
        check_tensorboard_installed()
    league = league_of_runs(league_runs, config)
    directory = RunDirectory(out or Path("runs") / f"{config.preset}-seed{config.seed}")
    with players.connected():
        make = partial(players.evaluator, undo=directory.discard)
        return _run(Trainer.start(directory, config, make, league), following)


def resume(directory: Path, generations: int | None, players: Players, following: Following) -> int:
    """Continue a run from its last checkpoint."""
    if following.tensorboard:
        check_tensorboard_installed()
    run = RunDirectory(directory)

    def make(config: RunConfig) -> Evaluator:
        complete = generations_in(run.checkpoint_file, config) == config.generations
        return players.evaluator(config, prepare=not complete)

    with players.connected():
        return _go_on(Trainer.resume(run, make, generations), following)


def _go_on(trainer: Trainer, following: Following) -> int:
    directory = trainer.directory.path
    if trainer.done == trainer.config.generations:
        say(f"{directory} is complete: {counted(trainer.done, 'generation')}; give --generations to go on")
        return 0
    begun, now = trainer.directory.begun_with(), versions()
    for name in now:
        if begun.get(name, now[name]) != now[name]:
            say(f"begun with {name} {begun[name]}, now {now[name]}: later generations may differ")
    say(f"going on with {directory} from generation {trainer.done}")
    return _run(trainer, following)


def _run(trainer: Trainer, following: Following) -> int:
    plain = following.quiet or not sys.stderr.isatty()
    stopping, recent = _Stopping(trainer, plain=plain), deque[Generation](maxlen=_RECENT)
    log = TensorBoardLog(trainer.directory.path / "tensorboard") if following.tensorboard else None
    try:
        with handled_by(stopping):
            try:
                _follow(trainer, recent, log, plain=plain)
            except KeyboardInterrupt:
                if not stopping.at_once:
                    raise
                trainer.stop()
                list(trainer.generations())  # after stop(), this only writes a checkpoint
    finally:
        if log:
            log.close()
    if stopping.by and trainer.done < trainer.config.generations:
        path = quoted(trainer.directory.path)
        say(f"stopped after {counted(trainer.done, 'generation')}; go on with: esp-trainer resume {path}")
        return 128 + stopping.by
    _summarise(trainer, recent)
    return 0


class _Stopping:
    """A handler of signals that ask to stop.

    The first signal stops the run after the current generation, and Ctrl-C after it stops at once. Other signals are
    ignored, because a terminal that closes sends more than one.
    """

    def __init__(self, trainer: Trainer, *, plain: bool) -> None:
        self.by = 0
        """Number of the first signal; 0 before it."""
        self.at_once = False
        """True after the Ctrl-C that stops at once."""
        self._trainer, self._plain = trainer, plain

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        if not self.by:
            self.by = number
            line = "stopping after the generation in hand; Ctrl-C now stops at once"
            write_from_handler(line if self._plain else f"\n{line}")
            self._trainer.stop()
        elif number == signal.SIGINT and not self.at_once:
            self.at_once = True
            raise KeyboardInterrupt


def _follow(trainer: Trainer, recent: deque[Generation], log: TensorBoardLog | None, *, plain: bool) -> None:
    """Run all generations, print their progress, and append them to ``recent``."""
    total, done = trainer.config.generations, trainer.done
    with tqdm(total=total, initial=done, unit="gen", bar_format=_BAR, disable=plain) as bar:
        warned: set[Role] = set()
        for generation in trainer.generations():
            recent.append(generation)
            for role, alike in _disengaged(recent):
                if role not in warned:
                    warned.add(role)
                    bar.write(f"warning: {_lost_gradient(role, alike)}", file=sys.stderr)
            if log:
                log.add(metrics_record(generation, generation.held_out.as_dict()), generation.seconds)
            bar.set_description_str(_at_a_glance(generation.held_out), refresh=False)
            bar.update()
            if plain and trainer.done % trainer.config.checkpoint_every == 0:
                say(f"generation {trainer.done}/{total}: {results_in_short(generation.held_out.as_dict())}")


def _disengaged(recent: Sequence[Generation]) -> Iterator[tuple[Role, float]]:
    """Yield each side that has lost its gradient in the recent generations, and its fraction of tied trials."""
    for role in recent[-1].signals:
        alike = sum(generation.signals[role].ties for generation in recent) / len(recent)
        if len(recent) == _RECENT and alike >= _ALIKE:
            yield role, alike


def _lost_gradient(role: Role, alike: float) -> str:
    return (
        f"{100 * alike:.0f}% of the trials of the {role} ended alike in the last {_RECENT} generations: "
        "selection has next to nothing to choose by (disengagement)"
    )


def _at_a_glance(held_out: Captures | Payoffs) -> str:
    if isinstance(held_out, Payoffs):
        return f"payoff {held_out.payoff.rate:z.2f}"
    return f"predators {held_out.predators_succeed.rate:.2f} prey {held_out.prey_succeed.rate:.2f}"


def _of_recent(held_out: Sequence[Captures | Payoffs]) -> str:
    """Return the mean results of champion against champion in words."""

    def mean(values: list[float]) -> str:
        return f"{sum(values) / len(values):z.2f}"

    if captures := [each for each in held_out if isinstance(each, Captures)]:
        return (
            f"{mean([each.caught.rate for each in captures])} of the prey caught; "
            f"predators catch all in {mean([each.predators_succeed.rate for each in captures])} of the episodes, "
            f"prey all survive in {mean([each.prey_succeed.rate for each in captures])}"
        )
    predators, prey = (mean([getattr(each, f"{name}_fitness") for each in held_out]) for name in ("predator", "prey"))
    payoff = mean([each.payoff.rate for each in held_out])
    return f"payoff {payoff} to the predators; a predator is paid {predators} an episode, a prey {prey}"


def _summarise(trainer: Trainer, recent: deque[Generation]) -> None:
    print(f"{counted(trainer.done, 'generation')} in {trainer.directory.path}")
    if recent:
        results = _of_recent([generation.held_out for generation in recent])
        print(f"last {counted(len(recent), 'generation')}, champion against champion: {results}")
    if told := exploiters_of(trainer.directory.path).first(trainer.done).in_words():
        print(f"exploiters against the champion, from the first third of the run to the last: {told}")
    players = {
        role: trainer.directory.champion_file(role, trainer.done - 1)
        if role in trainer.coevolution.evolving
        else side_config(trainer.config, role).policy
        for role in ROLES
    }
    pair = f"{quoted(players['predators'])} --against {quoted(players['prey'])}"
    print(f"  the curves    {trainer.directory.metrics_file}")
    print(f"  the teams     {trainer.directory.champions}/")
    print(f"next:\n  esp-trainer report {quoted(trainer.directory.path)}")
    if trainer.config.game.environment:
        print(f"  esp-trainer analyse {quoted(trainer.directory.path)}")
    else:
        print(f"  esp-trainer replay {pair}\n  esp-trainer evaluate {pair}")


def quoted(argument: Path | str) -> str:
    """Quote an argument for a shell, such that a path with a leading dash is not taken for an option.

    Bytes of a path that are not text are written as escapes.
    """
    text = str(argument)
    text = f"./{text}" if text.startswith("-") else text
    if text.isprintable():
        return shlex.quote(text)
    plain = {*range(ord(" "), ord("~") + 1)} - {*b"'\\"}
    return "$'" + "".join(chr(byte) if byte in plain else f"\\x{byte:02x}" for byte in os.fsencode(text)) + "'"
