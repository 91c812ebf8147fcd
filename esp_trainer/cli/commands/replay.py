"""``replay``: an episode of two teams."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from esp_trainer.cli.options import add_pair, natural, positive, whole

SUMMARY = "show an episode of two teams, as text or as a video"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``replay``."""
    parser.add_argument("--fps", type=positive, default=12, metavar="N", help="frames a second; by default 12")
    parser.add_argument(
        "--gif", type=_video(".gif"), metavar="FILE", help="write a GIF, with the names of detected behaviours"
    )
    parser.add_argument("--mp4", type=_video(".mp4"), metavar="FILE", help="write an MP4, likewise")
    parser.add_argument(
        "--follow",
        type=whole(5),
        metavar="CELLS",
        help="width of the pictures, which follow the chase; by default they show the whole world",
    )
    parser.add_argument(
        "--from", dest="first", type=natural, default=0, metavar="STEP", help="first step to show; by default 0"
    )
    parser.add_argument(
        "--until", dest="last", type=natural, metavar="STEP", help="last step to show; by default the end"
    )
    add_pair(parser, "the start and of all samples", ", or optimal:FILE, a file of solve")


def run(options: argparse.Namespace) -> int:
    """Run ``replay``, and return its exit status."""
    from esp_trainer.cli.replay import replay

    steps = range(options.first, sys.maxsize if options.last is None else options.last + 1)
    videos = [video for video in (options.gif, options.mp4) if video]
    return replay(options.team, options.against, options.seed, options.fps, steps, videos, options.follow)


def _video(suffix: str) -> Callable[[str], Path]:
    def path(text: str) -> Path:
        if Path(text).suffix.lower() != suffix:
            raise argparse.ArgumentTypeError(f"must end in {suffix}, got {text!r}")
        return Path(text)

    return path
