"""Frames as a GIF, by Pillow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import compress
from pathlib import Path

import numpy as np
from PIL import Image

_EXACT = 128
"""How many colours, the most frequent, stay as they are; the many blends of what moves share the rest of a palette."""

_UNCHANGED = 255
"""The entry of the palette that lets the frame before show through."""


_LARGEST = 65_535
"""The largest side of a picture, in pixels, and the longest time that it is shown, in hundredths of a second, that the
format has room for."""

_LONGEST_FILM = 1_000_000
"""Seconds; each 655 of them cost a picture, though nothing moves."""


def write_gif(frames: Sequence[np.ndarray], path: Path, fps: float) -> None:
    """Write RGB frames of one size, uint8 ``(height, width, 3)``, as a GIF that repeats for ever.

    One palette and no dithering: the surroundings of what moves stay as they are, and cost nothing. Raises
    :class:`ValueError` for what a GIF cannot hold.
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


def _pictures(frames: Sequence[np.ndarray], times: Sequence[int]) -> Iterator[tuple[Image.Image, int]]:
    """Each frame in the colours of the palette, but for the pixels that are as they were, with its time.

    A frame with more time than a picture has room for becomes several. Pillow makes one of equal pictures and adds up
    their times: where that would be too much, one pixel is drawn anew, or no more, to make them unequal.
    """
    palette, entries = _palette(frames)
    before = drawn = np.empty(0)
    held = 0  # the time of equal pictures, at most
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


def _palette(frames: Sequence[np.ndarray]) -> tuple[bytes, np.ndarray]:
    """Up to 255 colours, three bytes each, and the entry of every colour that a frame holds: uint8 ``(2**24,)``."""
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


def _packed(frame: np.ndarray) -> np.ndarray:
    """A number for each pixel's colour."""
    red, green, blue = np.moveaxis(frame.astype(np.uint32), -1, 0)
    packed: np.ndarray = red << 16 | green << 8 | blue
    return packed
