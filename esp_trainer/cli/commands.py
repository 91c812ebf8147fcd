"""Each command: the function that does it, and the options that it takes.

A command's module is imported when the command is given. Modules of the analysis take a second to import, and need the
extra ``analysis``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

from esp_trainer.cli import replay, teams, training
from esp_trainer.cli.overrides import describe, override
from esp_trainer.presets import PRESETS, preset
from predprey_env.config import EnvConfig
from predprey_env.extras import extra


def run(options: argparse.Namespace, fields: list[str]) -> int:
    """Run the command of the parsed options and return its exit status.

    Args:
        options: Options of the command.
        fields: Options of ``train`` that set fields of the config.
    """
    return _train(options, fields) if options.command == "train" else _COMMANDS[options.command](options)


def _train(options: argparse.Namespace, fields: list[str]) -> int:
    config = override(preset(options.preset), fields)
    return training.train(config, options.out, _players(options), _following(options), options.league)


def _resume(options: argparse.Namespace) -> int:
    return training.resume(options.directory, options.generations, _players(options), _following(options))


def _players(options: argparse.Namespace) -> training.Players:
    return training.Players(options.threads, options.address)


def _following(options: argparse.Namespace) -> training.Following:
    return training.Following(options.quiet, options.tensorboard)


def _watch(options: argparse.Namespace) -> int:
    from esp_trainer.cli.watch import watch

    return watch(options.run, options.fps)


def _sweep(options: argparse.Namespace) -> int:
    from esp_trainer.cli.sweep import sweep

    return sweep(options.file, options.out, options.workers, options.address, quiet=options.quiet)


def _evaluate(options: argparse.Namespace) -> int:
    return teams.evaluate(options.team, options.against, options.episodes, options.seed)


def _replay(options: argparse.Namespace) -> int:
    steps = range(options.first, sys.maxsize if options.last is None else options.last + 1)
    videos = [video for video in (options.gif, options.mp4) if video]
    return replay.replay(options.team, options.against, options.seed, options.fps, steps, videos, options.follow)


def _show(options: argparse.Namespace) -> int:
    return teams.show(options.team)


def _teams(options: argparse.Namespace) -> int:
    return teams.zoo(options.task)


def _analyse(options: argparse.Namespace) -> int:
    with extra("analysis", "analyse"):
        from esp_trainer.cli.analysis import analyse

    return analyse(options.runs, options.generations, options.episodes, options.figures)


def _behaviours(options: argparse.Namespace) -> int:
    from esp_trainer.cli.behaviours import behaviours

    return behaviours(options.runs, options.generations, options.episodes, options.csv)


def _report(options: argparse.Namespace) -> int:
    with extra("analysis", "report"):
        from esp_trainer.cli.report import report
        from esp_trainer.report.measure import ReportOptions

    return report(options.runs, options.out, ReportOptions(options.generations, options.episodes))


def _compare(options: argparse.Namespace) -> int:
    with extra("analysis", "compare"):
        from esp_trainer.cli.compare import CompareOptions, compare

    how = CompareOptions(options.generations, options.episodes, options.against)
    return compare(options.runs, options.panel, options.out, options.csv, how)


def _benchmark(options: argparse.Namespace) -> int:
    with extra("analysis", "benchmark"):
        from esp_trainer.cli.benchmark import BenchmarkOptions, benchmark

    settings = BenchmarkOptions(options.role, options.task, options.episodes, options.seed, options.drawn)
    return benchmark(options.policy, options.name, settings, options.out, options.leaderboard)


def _exploitability(options: argparse.Namespace) -> int:
    from esp_trainer.cli.exact import exploitability

    return exploitability(options.policy, options.role, _small_world(options), drawn=options.drawn)


def _solve(options: argparse.Namespace) -> int:
    from esp_trainer.cli.exact import solve

    return solve(_small_world(options), options.out)


def _small_world(options: argparse.Namespace) -> EnvConfig:
    return EnvConfig(
        size=options.size,
        n_predators=options.predators,
        n_prey=options.prey,
        max_cycles=options.steps or options.size * 3 // 2,
        predator_idle=not options.no_idle,
        move_order="prey_first" if options.in_turns else "simultaneous",
    )


def _presets(options: argparse.Namespace) -> int:
    if name := options.preset:
        print(f"{name}: {PRESETS[name][0] if preset(name) else ''}\n{describe(preset(name))}")
        return 0
    width = max(map(len, PRESETS))
    for known, (meaning, _) in PRESETS.items():
        print(f"{known:{width}}  {meaning}")
    return 0


_COMMANDS: dict[str, Callable[[argparse.Namespace], int]] = {
    "resume": _resume,
    "watch": _watch,
    "sweep": _sweep,
    "evaluate": _evaluate,
    "replay": _replay,
    "show": _show,
    "teams": _teams,
    "analyse": _analyse,
    "behaviours": _behaviours,
    "report": _report,
    "compare": _compare,
    "benchmark": _benchmark,
    "exploitability": _exploitability,
    "solve": _solve,
    "presets": _presets,
}
