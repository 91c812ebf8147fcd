"""``watch``: a live view of a run on the terminal, with its curves and an episode of its newest champions."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from esp_trainer.analysis.history import curves_of
from esp_trainer.analysis.replay import Trajectory, as_text, play_episode
from esp_trainer.arrays import Curve, Fractions
from esp_trainer.cli.keyboard import Keyboard
from esp_trainer.cli.signals import handled_by
from esp_trainer.cli.streams import is_screen
from esp_trainer.cli.training import quoted
from esp_trainer.coevolution.sides import side_config
from esp_trainer.config import RunConfig
from esp_trainer.esp.team import Team
from esp_trainer.files import DamagedFileError
from esp_trainer.run.directory import RunDirectory, Tail
from esp_trainer.run.lock import Lock
from esp_trainer.statistics import results_in_short
from esp_trainer.types import ROLES, Role
from predprey_env.policies import Policy, ScriptedTeam
from predprey_env.settings import counted

_PATIENCE = 0.5  # seconds between checks of a run that has nothing new
_CURVES = {
    "caught": ("prey caught", "yellow"),
    "all_caught": ("all caught: predators succeed", "red"),
    "none_caught": ("none caught: prey succeed", "blue"),
    "payoff": ("payoff to the predators, from its lowest to its highest", "yellow"),
}
_RECENT = 10  # number of generations in the mean beside a curve
_CHASE = 46  # number of terminal columns of the episode
_QUIT = "q"
_BLOCKS = " ▁▂▃▄▅▆▇█"


class _Log:
    """A reader of a run's log that reads only new lines each time."""

    def __init__(self, file: Path) -> None:
        self._file, self._tail = file, Tail(file)
        self.lines: list[dict[str, Any]] = []
        self.curves: dict[str, Curve] = {}

    def look(self) -> int:
        """Read new lines, and return the number of generations."""
        new, cut = self._tail.look()
        if cut:
            self.lines.clear()
        if new:
            try:
                self.lines += map(json.loads, new)
                self.curves = curves_of(self.lines)
            except (ValueError, TypeError, KeyError) as error:
                raise DamagedFileError(f"{self._file} is damaged: {error}") from None
        return len(self.lines)


def watch(run: Path, fps: int) -> int:
    """Follow a run until it is finished or the user stops watching."""
    directory = RunDirectory(run)
    below = [] if directory.config_file.exists() else list(run.glob("*/config.json"))
    if below:
        newest = max(below, key=lambda config: config.parent.stat().st_mtime).parent
        raise ValueError(f"{run} is no run but holds some; watch one of them, such as {newest}")
    config = directory.read_config()
    try:
        with handled_by(_leave), Keyboard() as keyboard:
            if is_screen(sys.stdout):
                _live(directory, config, fps, keyboard)
            else:
                _plain(directory, config, keyboard)
    except KeyboardInterrupt:
        pass  # Ctrl-C is the usual way to stop watching, not an error
    return 0


def _leave(number: int, _frame: FrameType | None) -> None:
    """End the command by an exception, so that the terminal is restored."""
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    sys.exit(128 + number)


def _plain(directory: RunDirectory, config: RunConfig, keyboard: Keyboard) -> None:
    """Print a line for each generation."""
    told, log, deserted = 0, _Log(directory.metrics_file), False
    if keyboard.listens:
        print(_how_to_stop(keyboard), file=sys.stderr, flush=True)
    while True:
        # The lock is checked before the log: a run writes its last line before it frees the lock.
        was, deserted = deserted, Lock.is_free(directory.path)
        known = log.look()
        for record in log.lines[told:]:
            print(
                f"generation {record['generation'] + 1}/{config.generations}: {results_in_short(record['held_out'])}",
                flush=True,
            )
        told = max(told, known)
        if told >= config.generations:
            return
        if deserted and not was:
            print(_deserted(directory.path), file=sys.stderr, flush=True)
        if keyboard.pressed(_QUIT, _PATIENCE):
            return


def _deserted(run: Path) -> str:
    return f"no process on this machine works on {run}; go on with:\n  esp-trainer resume {quoted(run)}"


def _how_to_stop(keyboard: Keyboard) -> str:
    return f"{_QUIT} or Ctrl-C stops watching" if keyboard.listens else "Ctrl-C stops watching"


def _live(directory: RunDirectory, config: RunConfig, fps: int, keyboard: Keyboard) -> None:
    console, log = Console(), _Log(directory.metrics_file)
    with Live(console=console, screen=True, auto_refresh=False) as live:
        while True:
            hints = [_how_to_stop(keyboard), *([_deserted(directory.path)] if Lock.is_free(directory.path) else [])]
            done = log.look()
            episode = _chase(directory, config, done - 1) if done and not config.game.environment else None
            for frame in as_text(episode) if episode else [""]:
                title = f"champions of generation {done - 1}" if episode else ""
                chase = Text(f"{title}\n{frame}", no_wrap=True, overflow="crop")
                log.look()
                state = _state(directory, config, log, hints, console.width)
                live.update(_beside(state, chase), refresh=True)
                if keyboard.pressed(_QUIT, 1 / fps if episode else _PATIENCE):
                    return
            if done >= config.generations:
                break
    print(f"{directory.path} is complete: {counted(config.generations, 'generation')}")


def _chase(directory: RunDirectory, config: RunConfig, generation: int) -> Trajectory | None:
    """Play an episode of a generation's champions; None if their files are missing."""
    policies: dict[Role, Policy] = {}
    for role in ROLES:
        script = side_config(config, role).policy
        try:
            policies[role] = (
                Team.load(directory.champion_file(role, generation))
                if script == "esp"
                else ScriptedTeam.of(script, role, config.env)
            )
        except FileNotFoundError:  # a run that is resumed first removes the champions after its checkpoint
            return None
    return play_episode(policies["predators"], policies["prey"], config.env, seed=generation)


def _state(directory: RunDirectory, config: RunConfig, log: _Log, hints: list[str], width: int) -> Group:
    """Return the run's path, its number of generations, and its curves, for the left half of the screen."""
    lines: list[Text] = [
        Text(str(directory.path), style="bold", overflow="ellipsis", no_wrap=True),
        Text(f"generation {len(log.lines)} of {config.generations}"),
        *map(Text, hints),
    ]
    if not log.lines:
        return Group(*lines, Text("waiting for the first generation ..."))
    room = max(10, min(60, width - _CHASE))
    for name, (meaning, colour) in _CURVES.items():
        if name not in log.curves:
            continue
        curve = log.curves[name]
        lines += [Text(), Text(f"{curve[-_RECENT:].mean():z.2f} {meaning}")]
        if name == "payoff":  # of any scale
            curve = (curve - curve.min()) / (np.ptp(curve) or 1.0)
        lines += [Text(line, colour, no_wrap=True, overflow="crop") for line in chart(curve, room, 3)]
    return Group(*lines, *map(Text, _signals(log.lines[-_RECENT:])))


def _signals(recent: list[dict[str, Any]]) -> Iterator[str]:
    """Yield a line on the signal of selection of each side whose log has it."""
    for role, told in recent[-1].get("subpopulations", {}).items():
        if told.get("signal") is not None:
            known = [line["subpopulations"][role]["signal"] or 0.0 for line in recent]
            share = sum(known) / len(known)
            yield f"{share:z.2f} signal in the selection of {role}, {told['ties']:.2f} of its trials alike"


def _beside(left: Group, right: Text) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_row(left, right)
    return grid


def chart(values: Fractions, width: int, height: int) -> list[str]:
    """Return values in [0, 1] as ``height`` lines of block characters, each column the mean of its values."""
    columns = min(width, len(values))
    means = np.array([part.mean() for part in np.array_split(values, columns)])
    eighths = np.clip(np.round(8 * height * means), 0, 8 * height).astype(int)
    rows = [np.clip(eighths - 8 * row, 0, 8) for row in reversed(range(height))]
    return ["".join(_BLOCKS[eighth] for eighth in row) for row in rows]
