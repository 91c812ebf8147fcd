"""Writing of frames as a GIF or an MP4."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from itertools import chain
from math import inf
from numbers import Real
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from tempfile import TemporaryDirectory, TemporaryFile

import numpy as np

from predprey_env.arrays import Picture
from predprey_env.extras import extra
from predprey_env.settings import brief, plain

SUFFIXES = ".gif", ".mp4"

_H264 = [
    *("-vcodec", "libx264", "-pix_fmt", "yuv420p", "-crf", "10", "-movflags", "+faststart"),
    *("-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"),  # H.264 with yuv420p requires even sides
]


def save_video(frames: Iterable[Picture], path: str | os.PathLike[str], fps: float = 15) -> None:
    """Write RGB frames, uint8 ``(height, width, 3)``, as a GIF or an MP4; the suffix of the path decides which.

    Raises :class:`ValueError` for another suffix or unfit frames, :class:`OSError` if the file cannot be written, and
    :class:`gymnasium.error.DependencyNotInstalled` if a GIF lacks Pillow, or an MP4 lacks imageio-ffmpeg; the extra
    ``render`` installs both. After an error no half-written file is left.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"a video must be a {' or '.join(SUFFIXES)} file, got {str(path)!r}")
    rate = _read_rate(fps)
    check_encoder(path)
    try:
        target = Path(os.path.realpath(path))  # replace the file that a link points to, and keep the link
        if target.is_symlink():  # a cycle of links
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        with TemporaryDirectory(dir=target.parent, prefix=".video-") as place:
            whole = Path(place, f"video{suffix}")
            if suffix == ".mp4":
                _write_mp4(_checked(frames), whole, rate)
            else:
                from predprey_env.rendering.gif import write_gif  # here, because it imports Pillow

                write_gif([*_checked(frames)], whole, rate)
            whole.replace(target)
    except OSError as error:
        raise OSError(f"cannot write {path}: {error.strerror or error}") from None


def check_encoder(path: Path) -> None:
    """Raise :class:`gymnasium.error.DependencyNotInstalled` if the package that writes such a video is missing."""
    if path.suffix.lower() == ".mp4":
        with extra("render", "an MP4"):
            import imageio_ffmpeg  # noqa: F401
    else:
        with extra("render", "a GIF"):
            import PIL  # noqa: F401


def _read_rate(fps: object) -> float:
    number = plain(fps)
    try:
        rate = float(number) if isinstance(number, Real | Decimal) and not isinstance(number, bool) else inf
    except (OverflowError, ValueError):  # a very long integer, or a signalling NaN
        rate = inf
    if rate == inf:
        raise ValueError(f"fps must be a finite number, got {brief(number)}")
    if not rate > 0:
        raise ValueError(f"fps must be greater than 0, got {number}")
    return rate


def _write_mp4(frames: Iterator[Picture], path: Path, fps: float) -> None:
    """Write the frames with ffmpeg, called directly: :func:`imageio_ffmpeg.write_frames` does not report failure."""
    from imageio_ffmpeg import get_ffmpeg_exe

    first = next(frames)
    height, width, _ = first.shape
    if not 1e-3 <= fps <= 1e6:  # approximately the range that ffmpeg can store
        raise ValueError(f"fps of an MP4 must be in 0.001..1000000, got {fps}")
    rate = str(Fraction(fps).limit_denominator())
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", rate, "-i", "-"]
    command = [get_ffmpeg_exe(), "-v", "error", "-y", *raw, "-an", *_H264, str(path)]
    with TemporaryFile() as said, Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=said) as ffmpeg:
        assert ffmpeg.stdin is not None
        with suppress(BrokenPipeError), ffmpeg.stdin as pipe:  # ffmpeg has ended early; its output says why
            for frame in chain([first], frames):
                pipe.write(np.ascontiguousarray(frame).data)
        failed = ffmpeg.wait() != 0
        said.seek(0)
        lines = said.read().decode(errors="replace").strip()
    if failed or not path.exists() or not path.stat().st_size:
        raise OSError(_reason(lines))


def _reason(lines: str) -> str:
    """Return ffmpeg's error in one line: an error of the operating system if the output contains one, else its last
    line.
    """
    system = next((text for text in map(os.strerror, errno.errorcode) if text in lines), None)
    return system or ": ".join(["ffmpeg failed", *lines.splitlines()[-1:]])


def _checked(frames: Iterable[Picture]) -> Iterator[Picture]:
    """Yield the frames; raise :class:`ValueError` if there are none, or if they differ in size."""
    shape = None
    for i, frame in enumerate(frames):
        if not isinstance(frame, np.ndarray):
            raise ValueError(f'frame {i} must be an array, as render_mode="rgb_array" gives, got {brief(frame)}')
        fits = (
            frame.ndim == 3 and frame.shape[2] == 3 and 0 not in frame.shape and frame.shape == (shape or frame.shape)
        )
        if frame.dtype != np.uint8 or not fits:
            expected = shape or "(height, width, 3)"
            raise ValueError(f"frame {i} must be uint8 of shape {expected}, got {frame.dtype} of shape {frame.shape}")
        shape = frame.shape
        yield frame
    if shape is None:
        raise ValueError("a video needs at least one frame, got none")
