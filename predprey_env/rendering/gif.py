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


def write_gif(frames: Sequence[np.ndarray], path: Path, fps: float) -> None:
    """Write RGB frames of one size, uint8 ``(height, width, 3)``, as a GIF that repeats for ever.

    One palette and no dithering: the surroundings of what moves stay as they are, and cost nothing.
    """
    ends = np.ceil(np.arange(1, len(frames) + 1) * 100 / fps).astype(int)  # a GIF counts hundredths of a second
    durations = np.diff(ends, prepend=0)
    first, *others = _changes(list(compress(frames, durations)))
    first.save(
        path,
        save_all=True,
        append_images=others,
        duration=(10 * durations[durations > 0]).tolist(),
        loop=0,
        transparency=_UNCHANGED,
        disposal=1,  # each frame is drawn over the one before
        optimize=False,
    )


def _changes(frames: Sequence[np.ndarray]) -> Iterator[Image.Image]:
    """Each frame in the colours of the palette, but for the pixels that are as they were."""
    palette, entries = _palette(frames)
    before = None
    for frame in frames:
        now = entries[_packed(frame)]
        picture = Image.fromarray(now if before is None else np.where(now == before, np.uint8(_UNCHANGED), now))
        picture.putpalette(palette)
        yield picture
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
