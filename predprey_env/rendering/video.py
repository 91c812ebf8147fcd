"""Frames as a file that moves."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import closing
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypedDict

import numpy as np

from predprey_env.actions import brief
from predprey_env.rendering.extra import require


class _Format(TypedDict):
    """The options of :func:`imageio_ffmpeg.write_frames` for a format."""

    codec: str
    pix_fmt_out: str
    quality: int | None
    output_params: list[str]


FORMATS: dict[str, _Format] = {
    # One palette for all frames, and no dithering: the surroundings of what moves stay as they are, and cost nothing.
    ".gif": _Format(
        codec="gif",
        pix_fmt_out="pal8",
        quality=None,
        output_params=["-vf", "split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=none"],
    ),
    # The codec wants even sides.
    ".mp4": _Format(
        codec="libx264",
        pix_fmt_out="yuv420p",
        quality=8,
        output_params=["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-movflags", "+faststart"],
    ),
}
"""How a file is written, by its suffix."""


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
    from imageio_ffmpeg import write_frames

    checked = _checked(frames)
    first = next(checked)
    height, width, _ = first.shape
    writer = write_frames(
        str(path), (width, height), fps=fps, macro_block_size=1, ffmpeg_log_level="error", **FORMATS[path.suffix]
    )
    with closing(writer):
        writer.send(None)
        for frame in chain([first], checked):
            writer.send(np.ascontiguousarray(frame))
    if not path.exists() or not path.stat().st_size:
        raise OSError("ffmpeg failed")


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
