"""The world as a picture, drawn without a display."""

from __future__ import annotations

import numpy as np
import pygame

from predprey_env.arrays import Places
from predprey_env.config import EnvConfig
from predprey_env.rendering import sprites
from predprey_env.rendering.ansi import PREY_LETTERS
from predprey_env.rendering.colours import GRID, GROUND, INK, PREDATOR, PREY, mix
from predprey_env.rendering.track import Track

SIDE = 640
"""Side of the world in a picture, in pixels. Like ``HEADER`` it is a multiple of 16, for video codecs."""

HEADER = 32
"""Height of the line above the world, in pixels."""

_FINE = 2  # the world is drawn at twice the size and scaled down: that makes edges smooth
_BOUNDS = pygame.Rect(0, 0, SIDE * _FINE, SIDE * _FINE)
_RING_STEPS = 12


def agent_radius(config: EnvConfig, width: int | None = None) -> float:
    """Return the radius of an agent, in pixels, in a picture that is ``width`` cells wide.

    It is about half a cell, but large enough to be seen.
    """
    crowd = (0.1 * SIDE**2 / (np.pi * config.n_agents)) ** 0.5  # all agents together cover a tenth of the world
    return float(np.clip(0.42 * SIDE / (width or config.size), np.clip(crowd, 2, 13), 48))


def trail_length(config: EnvConfig) -> float:
    """Return the length of a trail in steps: a fraction of the world's side, less if there are many agents."""
    return float(min(max(8, 0.4 * config.size), 6000 / config.n_agents))


class Painter:
    """Draws the worlds of one configuration. Each picture overwrites the previous one.

    Args:
        config: The world.
        width: Width of the picture in cells; by default the whole world.
    """

    def __init__(self, config: EnvConfig, width: int | None = None) -> None:
        self._config = config
        self._width = width or config.size
        self._scale = _BOUNDS.width / self._width
        self._side = round(config.size * self._scale)  # of the world, in finely drawn pixels
        self._radius = agent_radius(config, width) * _FINE
        self._centre: Places | None = None
        self._ground = _ground(config.size)
        self._world = self._ground.copy()
        self._picture = pygame.Surface((SIDE, SIDE + HEADER), depth=32)

    def paint(
        self, track: Track, progress: float = 1.0, caption: str = "", centre: Places | None = None
    ) -> pygame.Surface:
        """Return the picture at the latest moment of a track, or between the previous moment and the latest.

        Args:
            track: The course of the episode.
            progress: 0 for the previous moment, 1 for the latest.
            caption: Text in the line above the world.
            centre: The point in the middle of the picture, column and row in cells; by default the world's middle.
        """
        now = track.time - (1 - progress) * track.duration
        self._centre = centre
        self._draw_ground()
        self._draw_trails(track, now, progress)
        self._draw_agents(track, self._centres(track.cells - (1 - progress) * track.way), now)
        place = self._picture.subsurface((0, HEADER, SIDE, SIDE))
        pygame.transform.smoothscale(self._world, place.get_size(), place)
        self._write_header(track, now, caption)
        return self._picture

    def _centres(self, cells: Places) -> Places:
        """Return the positions of cells ``(n_agents, 2)`` in the finely drawn picture, whose rows count downwards."""
        points = cells + 0.5
        if self._centre is not None:
            half = self._config.size / 2  # the shortest way from the centre
            points = (points - self._centre + half) % self._config.size - half + self._width / 2
        centres = points * self._scale
        centres[:, 1] = _BOUNDS.height - centres[:, 1]
        return np.asarray(centres)

    def _draw_ground(self) -> None:
        if self._centre is None:
            self._world.blit(self._ground, (0, 0))
            return
        self._world.fill(GROUND)
        first = self._centre - self._width / 2
        spacing = _spacing(self._width)
        for axis in range(2):
            for line in np.arange(-(-first[axis] // spacing) * spacing, first[axis] + self._width, spacing):
                at = round((line - first[axis]) * self._scale)
                if axis == 0:
                    self._world.fill(GRID, (at - 1, 0, 2, _BOUNDS.height))
                else:
                    self._world.fill(GRID, (0, _BOUNDS.height - at - 1, _BOUNDS.width, 2))

    def _draw_trails(self, track: Track, now: float, progress: float) -> None:
        """Draw a bar for each stretch of each agent's path, recent ones over older ones."""
        for stretch in track.stretches:
            fresh = min(1.0, 1 - (now - stretch.time) / track.length)
            part = progress if stretch.time == track.time else 1.0
            begin = self._centres(stretch.start)
            ends = begin, begin + part * self._scale * stretch.way * (1, -1)
            half = max(1, round(self._radius * (0.08 + 0.12 * fresh)))
            corners = np.minimum(*ends).round() - half
            sizes = np.maximum(*ends).round() + half - corners
            colours = [mix(colour, 0.75 * fresh) for colour in (PREDATOR, PREY)]
            for agent in np.flatnonzero(stretch.way.any(axis=1)):
                box = pygame.Rect(corners[agent].tolist(), sizes[agent].tolist())
                for shift in self._shifts(box):
                    self._world.fill(colours[int(agent >= self._config.n_predators)], box.move(shift))

    def _draw_agents(self, track: Track, centres: Places, now: float) -> None:
        """Draw caught prey at the bottom, each in a ring that grows and fades, then predators, then free prey."""
        hunters, ages = self._config.n_predators, now - track.caught_at
        for prey in np.flatnonzero(ages >= 0).tolist():
            left = 1 - float(ages[prey]) / _RING_STEPS
            if left > 0:
                self._stamp(sprites.ring(self._radius * (3.4 - 1.4 * left), mix(INK, left)), centres[hunters + prey])
            self._stamp(sprites.caught_prey(self._radius), centres[hunters + prey])
        named = self._radius >= 7 * _FINE
        for agent in reversed(range(hunters)):
            east, north = track.heading[agent].tolist()
            label = str(agent) if named and agent < 100 else ""
            self._stamp(sprites.predator(self._radius, label, (east, north)), centres[agent])
        for prey in np.flatnonzero(ages < 0).tolist():
            label = PREY_LETTERS[prey : prey + 1] if named else ""
            self._stamp(sprites.prey(self._radius, label), centres[hunters + prey])

    def _stamp(self, sprite: pygame.Surface, centre: Places) -> None:
        box = sprite.get_rect(center=centre.round().tolist())
        self._world.blits([(sprite, box.move(shift)) for shift in self._shifts(box)])

    def _shifts(self, box: pygame.Rect) -> list[tuple[int, int]]:
        """Return the shifts by the size of the world, which wraps around, that put a part of a box into the picture."""
        if _BOUNDS.contains(box):
            return [(0, 0)]
        ways = (-self._side, 0, self._side)
        return [(x, y) for x in ways for y in ways if _BOUNDS.colliderect(box.move(x, y))]

    def _write_header(self, track: Track, now: float, caption: str) -> None:
        caught, n_prey = int((track.caught_at <= now).sum()), self._config.n_prey
        step = f"step {int(np.ceil(now))} / {self._config.max_cycles}"
        self._picture.fill(GRID, (0, 0, SIDE, HEADER))
        left, right = (sprites.write_sprite(line, 26, INK) for line in (step, f"caught {caught} / {n_prey}"))
        middle = HEADER // 2
        self._picture.blit(left, left.get_rect(midleft=(12, middle)))
        self._picture.blit(right, right.get_rect(midright=(SIDE - 12, middle)))
        if caption:
            written = sprites.write_sprite(caption, 26, PREDATOR)
            self._picture.blit(written, written.get_rect(center=(SIDE // 2, middle)))


def _spacing(width: int) -> int:
    """Return the number of cells between two grid lines: 1, 10, 100 or 1000, so that lines are not too dense."""
    return next(cells for cells in (1, 10, 100, 1000) if cells * _BOUNDS.width >= 24 * width)


def _ground(size: int) -> pygame.Surface:
    """Return the picture of the empty world with its grid lines."""
    ground = pygame.Surface(_BOUNDS.size, depth=32)
    ground.fill(GROUND)
    spacing = _spacing(size)
    for line in np.arange(spacing, size, spacing) * _BOUNDS.width / size:
        ground.fill(GRID, (round(line) - 1, 0, 2, _BOUNDS.height))
        ground.fill(GRID, (0, _BOUNDS.height - round(line) - 1, _BOUNDS.width, 2))
    return ground
