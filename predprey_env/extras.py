"""Imports of optional packages, with an error that says in one line how to install them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from gymnasium.error import DependencyNotInstalled

_DISTRIBUTIONS = {"PIL": "pillow", "imageio_ffmpeg": "imageio-ffmpeg", "pygame": "pygame-ce"}
"""Module -> name of the package that pip installs, where the two differ."""
_OWN = "predprey_env", "esp_trainer"


@contextmanager
def extra(name: str, purpose: str) -> Iterator[None]:
    """Return a context manager for imports of packages that the extra ``name`` of this distribution installs.

    Raises :class:`gymnasium.error.DependencyNotInstalled`, with the purpose and the remedy, if a package is missing::

        with extra("ray", "a Ray cluster"):
            import ray
    """
    try:
        yield
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if not missing or missing in _OWN:  # not a missing package, but a bug of this project
            raise
        package = _DISTRIBUTIONS.get(missing, missing)
        raise DependencyNotInstalled(f'{purpose} needs {package}: pip install "predprey-esp[{name}]"') from None


def require_pygame(purpose: str) -> None:
    """Raise :class:`gymnasium.error.DependencyNotInstalled` unless pygame-ce, which draws pictures, is installed."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # keep pygame's greeting off standard output
    with extra("render", purpose):
        import pygame
    if not hasattr(pygame, "Window"):
        found = f"pygame {pygame.version.ver}"
        raise DependencyNotInstalled(
            f"{purpose} needs pygame-ce 2.5.2 or later, got {found}: "
            "pip uninstall pygame, then pip install --force-reinstall pygame-ce"
        )
