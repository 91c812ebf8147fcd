"""``esp-trainer``: the command line of the trainer."""

from __future__ import annotations

import argparse
import sys

from gymnasium.error import DependencyNotInstalled

from esp_trainer.cli import replay, teams, training
from esp_trainer.cli.overrides import describe, override, read_options, split
from esp_trainer.cli.parser import make_parser
from esp_trainer.cli.streams import let_go, standard_streams
from esp_trainer.files import in_words
from esp_trainer.presets import PRESETS, preset
from predprey_env.config import EnvConfig


def main(arguments: list[str] | None = None) -> int:
    """Run a command and return its exit status. A user's mistake gives one line on standard error and status 1."""
    with standard_streams():
        return _outcome(sys.argv[1:] if arguments is None else arguments)


def _outcome(arguments: list[str]) -> int:
    try:
        try:
            return _run(arguments)
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        let_go(sys.stdout)
        return 1
    except KeyboardInterrupt:
        print("esp-trainer: interrupted", file=sys.stderr)
        return 130
    except MemoryError as error:
        return _fail(f"not enough memory: {error}" if str(error) else "not enough memory")
    except OSError as error:
        let_go(sys.stdout)
        return _fail(in_words(error))
    # A Warning is raised only if PYTHONWARNINGS turns warnings into errors.
    except (ValueError, ArithmeticError, DependencyNotInstalled, Warning) as error:
        return _fail(str(error))


def _fail(line: str) -> int:
    print(f"esp-trainer: {line}", file=sys.stderr)
    return 1


def _run(arguments: list[str]) -> int:
    parser = make_parser()
    fields: list[str] = []
    if arguments[:1] == ["train"]:
        # First split off the options that set fields: argparse would take the 3 of "--seed 3 smoke" for the preset.
        fields, arguments = split(arguments)
    options, unknown = parser.parse_known_args(arguments)
    if unknown and options.command != "train":
        options.refuse_option(unknown[0])
    read_options(unknown)
    return _dispatch(options, [*fields, *unknown])


def _dispatch(options: argparse.Namespace, fields: list[str]) -> int:
    if options.command in ("train", "resume"):
        return _train(options, fields)
    if options.command == "sweep":
        from esp_trainer.cli.sweep import sweep  # imported here because it imports slow packages

        return sweep(options.file, options.out, options.workers, options.address, quiet=options.quiet)
    if options.command == "evaluate":
        return teams.evaluate(options.team, options.against, options.episodes, options.seed)
    if options.command == "show":
        return teams.show(options.team)
    if options.command == "replay":
        steps = range(options.first, sys.maxsize if options.last is None else options.last + 1)
        videos = [video for video in (options.gif, options.mp4) if video]
        return replay.replay(options.team, options.against, options.seed, options.fps, steps, videos, options.follow)
    if options.command == "presets":
        return _presets(options.preset)
    if options.command == "teams":
        return teams.zoo(options.task)
    return _analyse(options)


def _train(options: argparse.Namespace, fields: list[str]) -> int:
    following = training.Following(options.quiet, options.tensorboard)
    players = training.Players(options.threads, options.address)
    if options.command == "resume":
        return training.resume(options.directory, options.generations, players, following)
    config = override(preset(options.preset), fields)
    return training.train(config, options.out, players, following, options.league)


def _analyse(options: argparse.Namespace) -> int:
    """Run a command of the analysis. Its modules are imported here, as SciPy and Matplotlib take a second to import."""
    from esp_trainer.cli import analysis, behaviours, benchmark, compare, exact, report, watch
    from esp_trainer.report.measure import ReportOptions

    if options.command == "benchmark":
        settings = benchmark.BenchmarkOptions(options.role, options.task, options.episodes, options.seed, options.drawn)
        return benchmark.benchmark(options.policy, options.name, settings, options.out, options.leaderboard)
    if options.command == "solve":
        return exact.solve(_small_world(options), options.out)
    if options.command == "exploitability":
        return exact.exploitability(options.policy, options.role, _small_world(options), drawn=options.drawn)
    if options.command == "watch":
        return watch.watch(options.run, options.fps)
    if options.command == "report":
        return report.report(options.runs, options.out, ReportOptions(options.generations, options.episodes))
    if options.command == "compare":
        how = compare.CompareOptions(options.generations, options.episodes, options.against)
        return compare.compare(options.runs, options.panel, options.out, options.csv, how)
    if options.command == "behaviours":
        return behaviours.behaviours(options.runs, options.generations, options.episodes, options.csv)
    return analysis.analyse(options.runs, options.generations, options.episodes, options.figures)


def _small_world(options: argparse.Namespace) -> EnvConfig:
    return EnvConfig(
        size=options.size,
        n_predators=options.predators,
        n_prey=options.prey,
        max_cycles=options.steps or options.size * 3 // 2,
        predator_idle=not options.no_idle,
        move_order="prey_first" if options.in_turns else "simultaneous",
    )


def _presets(name: str | None) -> int:
    if name:
        print(f"{name}: {PRESETS[name][0] if preset(name) else ''}\n{describe(preset(name))}")
        return 0
    width = max(map(len, PRESETS))
    for known, (meaning, _) in PRESETS.items():
        print(f"{known:{width}}  {meaning}")
    return 0
