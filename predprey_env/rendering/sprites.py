"""Shapes of agents: predators are round with a nose in the direction of their move, prey square, caught prey crossed
out.
"""

from __future__ import annotations

from functools import lru_cache

import pygame

from predprey_env.rendering.colours import CAUGHT, GROUND, PREDATOR, PREY, Colour

Heading = tuple[int, int]
"""A move: columns east and rows north; (0, 0) for no move."""

# In radii: distance of the tip of a predator's nose from its centre, and half the side of a prey.
_TIP, _HALF = 1.55, 0.76


@lru_cache(maxsize=1024)
def predator(radius: float, label: str, heading: Heading) -> pygame.Surface:
    """Draw a disc with the predator's number and, if it has moved, a nose.

    The disc's centre is the centre of the surface; its radius is in pixels.
    """
    sprite, centre = _blank(radius * _TIP)
    for size, colour in ((radius + _rim(radius), GROUND), (radius, PREDATOR)):
        if heading != (0, 0):
            pygame.draw.polygon(sprite, colour, _nose(centre, size, heading))
        pygame.draw.circle(sprite, colour, centre, size)
    return _labelled(sprite, label, radius)


@lru_cache(maxsize=1024)
def prey(radius: float, label: str) -> pygame.Surface:
    """Draw a square with the prey's letter."""
    return _labelled(_square(radius, PREY), label, radius)


@lru_cache(maxsize=1024)
def caught_prey(radius: float) -> pygame.Surface:
    """Draw a square with a cross in place of the letter."""
    sprite = _square(radius, CAUGHT)
    centre = pygame.Vector2(sprite.get_rect().center)
    for arm in (pygame.Vector2(0.5, 0.5), pygame.Vector2(0.5, -0.5)):
        pygame.draw.line(sprite, GROUND, centre - radius * arm, centre + radius * arm, max(1, round(radius / 3.5)))
    return sprite


def ring(radius: float, colour: Colour) -> pygame.Surface:
    """Draw the ring that marks a capture."""
    sprite, centre = _blank(radius)
    pygame.draw.circle(sprite, colour, centre, radius, max(1, round(radius / 14)))
    return sprite


def write_sprite(line: str, size: int, colour: Colour) -> pygame.Surface:
    """Draw a line of text of a size in pixels."""
    pygame.font.init()  # each time, because other environments may have quit pygame for the whole process
    return pygame.font.Font(None, size).render(line, True, colour)


def _blank(reach: float) -> tuple[pygame.Surface, pygame.Vector2]:
    """Return a transparent surface that reaches ``reach`` from its centre, with room for a rim, and its centre."""
    half = round(reach + 2 * _rim(reach))
    return pygame.Surface((2 * half, 2 * half), pygame.SRCALPHA, 32), pygame.Vector2(half, half)


def _rim(radius: float) -> float:
    """Return the width of the rim that separates a shape from those it overlaps."""
    return max(1.0, radius / 8)


def _nose(centre: pygame.Vector2, size: float, heading: Heading) -> list[pygame.Vector2]:
    """Return the corners of a nose: its tip, and the points where the tangents from the tip touch the disc."""
    ahead = pygame.Vector2(heading[0], -heading[1]).normalize()
    reach = size * _TIP
    cosine = size / reach
    across = ahead.rotate(90) * size * (1 - cosine**2) ** 0.5
    return [centre + ahead * reach, centre + ahead * size * cosine + across, centre + ahead * size * cosine - across]


def _square(radius: float, colour: Colour) -> pygame.Surface:
    sprite, centre = _blank(radius)
    for half, fill in ((_HALF * radius + _rim(radius), GROUND), (_HALF * radius, colour)):
        box = pygame.Rect(0, 0, 2 * round(half), 2 * round(half))
        box.center = int(centre.x), int(centre.y)
        pygame.draw.rect(sprite, fill, box, border_radius=round(radius / 5))
    return sprite


def _labelled(sprite: pygame.Surface, label: str, radius: float) -> pygame.Surface:
    letters = write_sprite(label, max(1, round(1.9 * radius)), GROUND)
    # Digits and letters lie above the middle of their line, so move them down to centre them.
    sprite.blit(letters, letters.get_rect(center=sprite.get_rect().center).move(0, round(radius / 12)))
    return sprite
