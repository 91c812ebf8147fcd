"""Writing of frames as a GIF, with Pillow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import compress
from pathlib import Path

import numpy as np
from PIL import Image

from predprey_env.arrays import Picture

_EXACT = 128
"""Number of the most frequent colours that stay exact; the many blends along the edges of moving shapes share the rest
of the palette."""

_UNCHANGED = 255
"""Palette entry that lets the previous frame show through."""


_LARGEST = 65_535
"""Limits of the format: largest side of a picture, in pixels, and longest time of a picture, in hundredths of a
second."""

_LONGEST_FILM = 1_000_000
"""Longest duration of a GIF, in seconds; limited, because each 655 seconds need a picture even if nothing moves."""


def write_gif(frames: Sequence[Picture], path: Path, fps: float) -> None:
    """Write RGB frames of one size, uint8 ``(height, width, 3)``, as a GIF that repeats for ever.

    All frames share one palette without dithering, so the surroundings of a moving shape stay unchanged and take no
    space. Raises :class:`ValueError` for frames that a GIF cannot hold.
    """
    height, width, _ = frames[0].shape
    if max(height, width) > _LARGEST:
        raise ValueError(f"a GIF is at most {_LARGEST} pixels high and wide, got frames of {height} x {width}")
    if len(frames) > fps * _LONGEST_FILM:
        raise ValueError(f"a GIF lasts at most {_LONGEST_FILM} s, got {len(frames)} frames at {fps} a second")
    ends = np.ceil(np.arange(1, len(frames) + 1) * 100 / fps).astype(int)  # a GIF counts hundredths of a second
    times = np.diff(ends, prepend=0)
    pictures, durations = zip(*_pictures(list(compress(frames, times)), times[times > 0].tolist()), strict=True)
    pictures[0].save(
        path,
        save_all=True,
        append_images=pictures[1:],
        duration=[10 * time for time in durations],
        loop=0,
        transparency=_UNCHANGED,
        disposal=1,  # each frame is drawn over the one before
        optimize=False,
    )


def _pictures(frames: Sequence[Picture], times: Sequence[int]) -> Iterator[tuple[Image.Image, int]]:
    """Yield each frame with its time, in palette colours; pixels that did not change are transparent.

    A frame that lasts longer than a picture can becomes several pictures. Pillow merges equal successive pictures and
    adds up their times. Where the sum would be too long, one pixel is switched between drawn and transparent to make
    the pictures unequal.
    """
    palette, entries = _palette(frames)
    before = drawn = np.empty(0)
    held = 0  # upper bound on the total time of the latest equal pictures
    for frame, whole in zip(frames, times, strict=True):
        now = entries[_packed(frame)]
        for time in [_LARGEST] * (whole // _LARGEST) + [whole % _LARGEST] * (whole % _LARGEST > 0):
            last, drawn = drawn, now if before.size == 0 else np.where(now == before, np.uint8(_UNCHANGED), now)
            held = time if (drawn != _UNCHANGED).any() else held + time
            if held > _LARGEST:
                drawn[0, 0] = now[0, 0] if last[0, 0] == _UNCHANGED else _UNCHANGED
                held = time
            picture = Image.fromarray(drawn)
            picture.putpalette(palette)
            yield picture, time
            before = now


def _palette(frames: Sequence[Picture]) -> tuple[bytes, np.ndarray]:
    """Return a palette of up to 255 colours, three bytes each, and the entry of every colour in the frames, uint8
    ``(2**24,)``.
    """
    counts = np.zeros(1 << 24, np.int64)
    for frame in frames:
        colours, n = np.unique(_packed(frame), return_counts=True)
        counts[colours] += n
    colours = np.flatnonzero(counts)
    colours = colours[np.argsort(-counts[colours], kind="stable")]
    rgb = np.stack([colours >> 16, colours >> 8, colours], axis=-1).astype(np.uint8)
    entries = np.zeros(1 << 24, np.uint8)
    entries[colours[:_EXACT]] = np.arange(len(colours[:_EXACT]))
    palette = rgb[:_EXACT].tobytes()
    if len(colours) > _EXACT:
        blended = Image.fromarray(rgb[None, _EXACT:]).quantize(_UNCHANGED - _EXACT, dither=Image.Dither.NONE)
        entries[colours[_EXACT:]] = _EXACT + np.asarray(blended)[0]
        palette += bytes(blended.getpalette() or ())[: 3 * (_UNCHANGED - _EXACT)]
    return palette.ljust(3 * 256, b"\0"), entries


def _packed(frame: Picture) -> np.ndarray:
    """Return each pixel's colour as one number."""
    red, green, blue = np.moveaxis(frame.astype(np.uint32), -1, 0)
    packed: np.ndarray = red << 16 | green << 8 | blue
    return packed
