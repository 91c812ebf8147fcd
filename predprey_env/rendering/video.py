"""Frames as a file that moves."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from fractions import Fraction
from itertools import chain
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from tempfile import TemporaryDirectory, TemporaryFile

import numpy as np

from predprey_env.actions import brief
from predprey_env.rendering.extra import require

FORMATS: dict[str, list[str]] = {
    # One palette for all frames, and no dithering: the surroundings of what moves stay as they are, and cost nothing.
    ".gif": [
        *("-vcodec", "gif", "-pix_fmt", "pal8"),
        *("-vf", "split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=none"),
    ],
    # The codec wants even sides.
    ".mp4": [
        *("-vcodec", "libx264", "-pix_fmt", "yuv420p", "-crf", "10"),
        *("-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-movflags", "+faststart"),
    ],
}
"""What ffmpeg is told of a file, by its suffix."""


def save_video(frames: Iterable[np.ndarray], path: str | os.PathLike[str], fps: float = 15) -> None:
    """Write RGB frames, uint8 ``(height, width, 3)``, as a GIF or MP4, by the suffix of the path.

    Raises :class:`ValueError` for another suffix or unfit frames, :class:`OSError` if the file cannot be written, and
    :class:`gymnasium.error.DependencyNotInstalled` without the extra ``render``. No file is left half written.
    """
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise ValueError(f"a video must be a {' or '.join(FORMATS)} file, got {str(path)!r}")
    if not fps > 0:
        raise ValueError(f"fps must be greater than 0, got {fps}")
    require("imageio_ffmpeg", "a video")
    try:
        with TemporaryDirectory(dir=path.parent, prefix=f".{path.name}-") as place:
            whole = Path(place, f"video{path.suffix.lower()}")
            _write(frames, whole, fps)
            whole.replace(path)
    except OSError as error:
        raise OSError(f"cannot write {path}: {error.strerror or error}") from None


def _write(frames: Iterable[np.ndarray], path: Path, fps: float) -> None:
    """By ffmpeg. :func:`imageio_ffmpeg.write_frames` would not say whether it succeeded."""
    from imageio_ffmpeg import get_ffmpeg_exe

    checked = _checked(frames)
    first = next(checked)
    height, width, _ = first.shape
    rate = str(Fraction(fps).limit_denominator())
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", rate, "-i", "-"]
    command = [get_ffmpeg_exe(), "-v", "error", "-y", *raw, "-an", *FORMATS[path.suffix], str(path)]
    with TemporaryFile() as said, Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=said) as ffmpeg:
        assert ffmpeg.stdin is not None
        with suppress(BrokenPipeError), ffmpeg.stdin as pipe:  # of one that has given up, and says why
            for frame in chain([first], checked):
                pipe.write(np.ascontiguousarray(frame).data)
        failed = ffmpeg.wait() != 0
        said.seek(0)
        lines = said.read().decode(errors="replace").strip()
    if failed or not path.exists() or not path.stat().st_size:
        raise OSError(_reason(lines))


def _reason(lines: str) -> str:
    """What ffmpeg says, in one line: what the system told it, if that is among many words."""
    system = next((text for text in map(os.strerror, errno.errorcode) if text in lines), None)
    return system or ": ".join(["ffmpeg failed", *lines.splitlines()[-1:]])


def _checked(frames: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
    """The frames; :class:`ValueError` unless there are any, all of one size."""
    shape = None
    for i, frame in enumerate(frames):
        if not isinstance(frame, np.ndarray):
            raise ValueError(f'frame {i} must be an array, as render_mode="rgb_array" gives, got {brief(frame)}')
        if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3 or frame.shape != (shape or frame.shape):
            expected = shape or "(height, width, 3)"
            raise ValueError(f"frame {i} must be uint8 of shape {expected}, got {frame.dtype} of shape {frame.shape}")
        shape = frame.shape
        yield frame
    if shape is None:
        raise ValueError("a video needs at least one frame, got none")
