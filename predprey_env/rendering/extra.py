"""What pictures and videos need, and the line for those who have not installed it."""

from __future__ import annotations

import os
from importlib import import_module
from types import ModuleType

from gymnasium.error import DependencyNotInstalled


def require(module: str, purpose: str, remedy: str) -> ModuleType:
    """The module, or :class:`gymnasium.error.DependencyNotInstalled` with what it was wanted for and what to do."""
    try:
        return import_module(module)
    except ImportError:
        raise DependencyNotInstalled(f"{purpose} needs {module}: {remedy}") from None


def require_pygame(purpose: str) -> None:
    """Check that pictures can be drawn, or :class:`gymnasium.error.DependencyNotInstalled`."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # standard output is the program's own
    pygame = require("pygame", purpose, "pip install pygame-ce")
    if not hasattr(pygame, "Window"):
        found = f"pygame {pygame.version.ver}"
        raise DependencyNotInstalled(
            f"{purpose} needs pygame-ce 2.5.2 or later, got {found}: "
            "pip uninstall pygame, then pip install --force-reinstall pygame-ce"
        )
