"""Imports of the optional packages for pictures and videos, with an error that says how to install them."""

from __future__ import annotations

import os
from importlib import import_module
from types import ModuleType

from gymnasium.error import DependencyNotInstalled


def require(module: str, purpose: str, remedy: str) -> ModuleType:
    """Import a module, or raise :class:`gymnasium.error.DependencyNotInstalled` with its purpose and the remedy."""
    try:
        return import_module(module)
    except ImportError:
        raise DependencyNotInstalled(f"{purpose} needs {module}: {remedy}") from None


def require_pygame(purpose: str) -> None:
    """Raise :class:`gymnasium.error.DependencyNotInstalled` unless pygame-ce, which draws pictures, is installed."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # keep pygame's greeting off standard output
    pygame = require("pygame", purpose, "pip install pygame-ce")
    if not hasattr(pygame, "Window"):
        found = f"pygame {pygame.version.ver}"
        raise DependencyNotInstalled(
            f"{purpose} needs pygame-ce 2.5.2 or later, got {found}: "
            "pip uninstall pygame, then pip install --force-reinstall pygame-ce"
        )
