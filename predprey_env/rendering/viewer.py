"""The episodes of an environment as pictures: in a window, or as arrays."""

from __future__ import annotations

import numpy as np
import pygame

from predprey_env.arrays import Picture
from predprey_env.config import EnvConfig
from predprey_env.rendering.camera import Camera
from predprey_env.rendering.picture import HEADER, SIDE, Painter, trail_length
from predprey_env.rendering.track import Track
from predprey_env.rendering.window import Window
from predprey_env.rules.dynamics import World

_LAST_LOOK = 10  # number of moments for which a window shows the end of an episode


class Viewer:
    """Draws an episode, and remembers its course for the trails.

    Args:
        config: The world.
        fps: Moments, which are time steps or halves of them, that a window shows per second.
        follow: Width in cells of pictures that follow the chase; by default pictures show the whole world.
    """

    def __init__(self, config: EnvConfig, fps: float, follow: int | None = None) -> None:
        self._fps, self._follow = fps, follow
        self._window: Window | None = None
        self.begin(config)

    def begin(self, config: EnvConfig) -> None:
        """Start another episode."""
        self._config, self._painter = config, Painter(config, self._follow)
        self._camera = Camera(config.size)
        self._track: Track | None = None

    def frame(self, world: World, time: float, caption: str = "") -> Picture:
        """Return the world at a time, in steps, as an RGB picture with the caption above: uint8 ``(height, width, 3)``.

        North is up.
        """
        _, track = self._look(world, time)
        centre = self._camera.look(world, time) if self._follow else None
        return _as_array(self._painter.paint(track, caption=caption, centre=centre))

    def show(self, world: World, time: float, *, last: bool) -> None:
        """Show the world at a time, in steps, in the window. The first call opens it; a closed window shows nothing."""
        new, track = self._look(world, time)
        if self._window is None:
            self._window = Window("predators and prey", (SIDE, SIDE + HEADER), self._fps)
        moments = new * (1 + _LAST_LOOK * last)
        self._window.show(lambda progress: self._painter.paint(track, progress), moments)

    def close(self) -> None:
        """Close the window."""
        if self._window is not None:
            self._window.close()

    def _look(self, world: World, time: float) -> tuple[bool, Track]:
        """Add the world to the track. Return whether its time is new, and the track."""
        if self._track is None or time < self._track.time:  # an environment may return to an earlier state
            self._track = Track(world, time, self._config.size, trail_length(self._config))
            return True, self._track
        return self._track.see(world, time), self._track


def _as_array(picture: pygame.Surface) -> Picture:
    return np.ascontiguousarray(pygame.surfarray.array3d(picture).swapaxes(0, 1))
