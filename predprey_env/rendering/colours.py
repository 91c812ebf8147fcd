"""Colours that colour-blind readers can tell apart (Okabe & Ito 2008), with a background for light and dark pages."""

from __future__ import annotations

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

GROUND: Colour = (20, 24, 33)
GRID: Colour = (37, 44, 58)
INK: Colour = (205, 210, 218)
CAUGHT: Colour = (128, 134, 145)
PREDATOR: Colour = (230, 159, 0)
PREY: Colour = (86, 180, 233)


def mix(colour: Colour, opacity: float, ground: Colour = GROUND) -> Colour:
    """Blend a colour, with an opacity in [0, 1], over a background."""
    red, green, blue = (round(under + (over - under) * opacity) for over, under in zip(colour, ground, strict=True))
    return red, green, blue
