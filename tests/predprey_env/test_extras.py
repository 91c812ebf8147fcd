"""Imports of optional packages."""

from __future__ import annotations

import sys

import pytest
from gymnasium.error import DependencyNotInstalled

from predprey_env.extras import extra


def test_a_missing_package_is_named_with_what_needs_it_and_how_to_install_it() -> None:
    line = r'^a map needs no_such: pip install "predprey-esp\[maps\]"$'
    with pytest.raises(DependencyNotInstalled, match=line), extra("maps", "a map"):
        import no_such.part  # type: ignore[import-not-found]  # noqa: F401


def test_a_package_that_another_one_lacks_is_named_as_pip_knows_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "PIL", None)
    monkeypatch.delitem(sys.modules, "predprey_env.rendering.gif", raising=False)
    with pytest.raises(DependencyNotInstalled, match=r"^a GIF needs pillow: "), extra("render", "a GIF"):
        import predprey_env.rendering.gif  # noqa: F401


def test_a_mistake_of_our_own_is_no_missing_package() -> None:
    with pytest.raises(ModuleNotFoundError, match=r"predprey_env\.no_such"), extra("maps", "a map"):
        import predprey_env.no_such  # type: ignore[import-not-found]  # noqa: F401
    with pytest.raises(ImportError, match="cannot import name"), extra("maps", "a map"):
        from predprey_env import no_such  # noqa: F401
