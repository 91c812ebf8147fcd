"""A window on the screen."""

from __future__ import annotations

import os
from collections.abc import Callable
from time import perf_counter, sleep

import pygame

_REFRESH = 60  # pictures a second during the transition between two moments


class Window:
    """A window that shows moments of an episode at a given rate, with a smooth transition between them.

    When the user closes the window, with its button or Escape, the program goes on and nothing more is shown. Raises
    :class:`RuntimeError` if there is no display.
    """

    def __init__(self, title: str, size: tuple[int, int], fps: float) -> None:
        self._title, self._size, self._period = title, size, 1 / fps
        self._end = 0.0  # time at which the last moment's period ends
        self._window: pygame.Window | None = _open(title, size)

    def show(self, paint: Callable[[float], pygame.Surface], moments: float) -> None:
        """Show ``paint(progress)`` for the time of ``moments`` moments; progress goes from 0 to 1 during the first."""
        if self._window is not None and not pygame.display.get_init():  # another environment has quit pygame
            # Drop the old window first: the new one may get its address, and would be destroyed with it.
            self._window = None
            self._window = _open(self._title, self._size)
        now = perf_counter()
        start = self._end if now < self._end + self._period else now
        self._end = start + moments * self._period
        while self._is_open() and now < self._end:
            self._put(paint(min(1.0, (now - start) / self._period)))
            sleep(max(0.0, min(now + 1 / _REFRESH, self._end) - perf_counter()))
            now = perf_counter()
        if self._is_open():
            self._put(paint(1.0))

    def close(self) -> None:
        """Close the window for good."""
        if self._window is not None and pygame.display.get_init():
            self._window.destroy()
        self._window = None

    def _is_open(self) -> bool:
        """Process the user's events since the last call, and return whether the window is still open."""
        if self._window is None:
            return False
        for event in pygame.event.get():
            closes = event.type == pygame.WINDOWCLOSE or (event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE)
            if event.type == pygame.QUIT or (closes and event.window is self._window):
                self.close()
            elif closes:
                pygame.event.post(event)  # leave it to the window that it is meant for
        return self._window is not None

    def _put(self, picture: pygame.Surface) -> None:
        if self._window is not None:
            self._window.get_surface().blit(picture, (0, 0))
            self._window.flip()


def _open(title: str, size: tuple[int, int]) -> pygame.Window:
    fault = "found none"
    try:
        pygame.display.init()
        # If SDL finds no display, it may choose an offscreen one, which is not visible.
        if pygame.display.get_driver() != "offscreen" or "SDL_VIDEODRIVER" in os.environ:
            return pygame.Window(title, size)
    except pygame.error as error:
        fault = str(error)
    raise RuntimeError(f'render_mode "human" needs a display, {fault}; "rgb_array" and "ansi" need none')
