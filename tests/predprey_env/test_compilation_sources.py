"""Which files machine code is compiled from: with any other of them the key of the cache must change."""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import typeof, types
from numba.core.registry import CPUDispatcher

import predprey_env
from esp_trainer import Team
from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.esp.network import Networks
from predprey_env import EnvConfig
from predprey_env.engine import team_rows
from predprey_env.envs.turn import play_turn
from predprey_env.envs.worlds import make_scratch, make_worlds, move_opponents
from predprey_env.jit import sources
from predprey_env.jit.cache import DigestCache, in_words
from predprey_env.jit.sources import named_tuples, source_files
from predprey_env.policies.protocol import choose
from predprey_env.policies.scripted import Script

LANGUAGE = {"lanes.py", "floats.py", "linking.py", "compilation.py"}  # what rules are written and compiled with
SOURCES = {
    *{"turn.py", "dynamics.py", "observation.py", "fitness.py", "torus.py"},  # the rules of a step
    *{"config.py", "sight.py"},  # the named tuples that they read
    *LANGUAGE,
}
STEP = (typeof(EnvConfig().rules),)
"""Types of the named tuples that a step is called with."""


def names(files: set[str]) -> set[str]:
    return {Path(file).name for file in files}


def codegen() -> Any:
    return play_turn.targetctx.codegen()


# -- a step -------------------------------------------------------------------------------------------------------


def test_the_sources_of_a_step_are_all_files_that_state_a_rule() -> None:
    assert names(source_files(play_turn.py_func, named_tuples(STEP))) == SOURCES


@pytest.mark.parametrize("name", sorted(SOURCES))
def test_the_key_of_the_cache_changes_with_each_source(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    read = Path.read_bytes
    key = DigestCache(play_turn.py_func)._index_key(STEP, codegen())
    assert DigestCache(play_turn.py_func)._index_key(STEP, codegen()) == key
    monkeypatch.setattr(sources, "_DEFINED", {})
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + (b"# edited" if path.name == name else b""))
    assert DigestCache(play_turn.py_func)._index_key(STEP, codegen()) != key


# -- as Python reads files ------------------------------------------------------------------------------------------

PLAYER = """{}
# größer
\f
from encoded_numbers import STEP
from predprey_env.jit.compilation import entry_point

@entry_point
def main(a):
    return a + STEP
"""
BYTES = {
    "UTF-8": PLAYER.format("").encode(),
    "a byte order mark": PLAYER.format("").encode("utf-8-sig"),
    "a byte order mark and a cookie": PLAYER.format("# coding: utf-8").encode("utf-8-sig"),
    "latin-1": PLAYER.format("# -*- coding: latin-1 -*-").encode("latin-1"),
    "cp1252 below a line": PLAYER.format("#!/usr/bin/env python\n# vim: set fileencoding=cp1252 :").encode("cp1252"),
    "lines of Windows": PLAYER.format("").replace("\n", "\r\n").encode("utf-8-sig"),
}


@pytest.fixture
def encoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[bytes], Any]:
    """``encoded(source)``: the module of a file with these bytes, beside one with the number that it imports."""
    monkeypatch.syspath_prepend(str(tmp_path))
    for module in ("encoded_größe", "encoded_numbers"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    (tmp_path / "encoded_numbers.py").write_text("STEP = 3\n")

    def load(source: bytes) -> Any:
        (tmp_path / "encoded_größe.py").write_bytes(source)
        importlib.invalidate_caches()
        return importlib.import_module("encoded_größe")

    return load


@pytest.mark.parametrize("encoding", BYTES)
def test_a_source_may_have_any_encoding_that_python_reads(encoded: Any, tmp_path: Path, encoding: str) -> None:
    main = encoded(BYTES[encoding]).main
    assert main(4) == 7
    assert {str(tmp_path / f"encoded_{name}.py") for name in ("größe", "numbers")} <= source_files(main.py_func)


@pytest.mark.parametrize("left", [None, b"def main(:\n", b"\0\0", b"\xff"], ids=["gone", "broken", "zeros", "no text"])
def test_a_source_that_is_gone_or_broken_by_now_counts_as_it_was(encoded: Any, tmp_path: Path, left: Any) -> None:
    main, path = encoded(BYTES["a byte order mark"]).main, tmp_path / "encoded_größe.py"
    path.unlink()
    if left is not None:
        path.write_bytes(left)
    assert str(tmp_path / "encoded_numbers.py") in source_files(main.py_func)
    assert main(4) == 7


def test_a_number_that_is_imported_from_a_neighbour_in_the_package_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    package = tmp_path / "package_of_numbers"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "numbers.py").write_text("STEP = 3\n")
    (package / "player.py").write_text(PLAYER.format("").replace("encoded_numbers", ".numbers"), "utf-8")
    importlib.invalidate_caches()
    player = importlib.import_module("package_of_numbers.player")
    assert str(package / "numbers.py") in source_files(player.main.py_func)


EITHER = """try:
    {first}
except ImportError:
    {second}
"""
ABSOLUTE = "from encoded_numbers import STEP"


@pytest.mark.parametrize(
    "imports",
    [
        EITHER.format(first=ABSOLUTE, second="from .encoded_numbers import STEP"),
        EITHER.format(first="from .encoded_numbers import STEP", second=ABSOLUTE),
        EITHER.format(first="from ...far.away import STEP", second=ABSOLUTE),
        f"if False:\n    from . import STEP\n{ABSOLUTE}",
        EITHER.format(first=ABSOLUTE, second="from nowhere_at_all import STEP"),
    ],
)
def test_an_import_that_cannot_be_resolved_is_passed_over(encoded: Any, tmp_path: Path, imports: str) -> None:
    main = encoded(PLAYER.format("").replace(ABSOLUTE, imports).encode()).main
    assert main(4) == 7
    assert str(tmp_path / "encoded_numbers.py") in source_files(main.py_func)


# -- all that is compiled -----------------------------------------------------------------------------------------


def entry_points() -> Iterator[CPUDispatcher]:
    """Of the whole package, but for what draws."""
    for module in pkgutil.walk_packages(predprey_env.__path__, "predprey_env."):
        if "rendering" in module.name or module.name.endswith("sb3"):  # which need libraries of their own
            continue
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, CPUDispatcher) and value.py_func.__module__ == module.name and is_kept(value):
                yield value


def is_kept(function: CPUDispatcher) -> bool:
    """Whether its machine code is kept on disk; a rule's is not, as it becomes part of others'."""
    return isinstance(function._cache, DigestCache)


def compiled_into(function: Callable[..., Any], classes: set[type]) -> Iterator[Callable[..., Any]]:
    """A function and all that become part of it."""
    pending, seen = [function], set()
    while pending:
        current = pending.pop()
        if current in seen:
            continue
        seen.add(current)
        yield current
        called = [current.__globals__.get(name) for name in current.__code__.co_names]
        called += [
            rule for value in called if value is choose for kind, rule in choose.registry.items() if kind in classes
        ]
        pending += [value.py_func for value in called if isinstance(value, CPUDispatcher)]


def origin(function: Callable[..., Any], name: str) -> str | None:
    """The file from which a function's module imports a name."""
    module = imports(function.__module__).get(name)
    return None if module is None else importlib.import_module(module).__file__


@cache
def imports(module: str) -> dict[str, str]:
    """From which modules a module imports its names."""
    source = ast.parse(inspect.getsource(sys.modules[module]))
    found = [node for node in ast.walk(source) if isinstance(node, ast.ImportFrom)]
    return {alias.asname or alias.name: str(node.module) for node in found for alias in node.names}


ENTRY_POINTS = list(entry_points())


def test_there_is_something_compiled() -> None:
    assert {"play_turn", "_act", "_find_shared", "move_opponents", "place"} <= {f.__name__ for f in ENTRY_POINTS}


@pytest.mark.parametrize("player", [Script, Networks])
@pytest.mark.parametrize("function", ENTRY_POINTS, ids=lambda function: function.__name__)
def test_nothing_comes_from_a_file_that_does_not_count(function: CPUDispatcher, player: type) -> None:
    """Neither a rule nor a number, which is in the machine code too."""
    files = source_files(function.py_func, {player})
    for part in compiled_into(function.py_func, {player}):
        imported = {name: origin(part, name) for name in part.__code__.co_names if name in part.__globals__}
        assert {name: file for name, file in imported.items() if file is not None and file not in files} == {}


# -- generic functions --------------------------------------------------------------------------------------------


def signature(player: Any) -> tuple[types.Type, ...]:
    """The types with which worlds let a player choose."""
    config = EnvConfig()
    rows = team_rows(config, "prey")
    parts = make_worlds(config, 3), rows, player, config.rules, make_scratch(config)
    return tuple(typeof(part) for part in parts)


def networks() -> Networks:
    """An evolved player, as compiled code knows it."""
    side = SideConfig()
    controller = make_controller(side, wiring_for(side, 3), 4)
    genomes = np.zeros((2, *controller.shape), np.float32)
    return Team("prey", side, controller, genomes).compiled("prey", EnvConfig(), 16)


SCRIPT = Script(1, 3, 4, False)
RULES = {  # for each class of player, the file of its rule and one that it calls
    "script": (SCRIPT, {"scripted.py", "predators.py", "prey.py", "readings.py", "chance.py"}),
    "networks": (networks(), {"network.py", "controller.py", "chance.py", "feedforward.py", "activations.py"}),
}


@pytest.mark.parametrize("player", RULES)
def test_of_a_generic_function_the_rules_for_the_players_class_count(player: str) -> None:
    known, own = RULES[player]
    found = names(source_files(move_opponents.py_func, named_tuples(signature(known))))
    others = set().union(*(files for _, files in RULES.values())) - own
    assert found >= own | {
        "worlds.py",
        "engine.py",
        "dynamics.py",
        "observation.py",
        "torus.py",
        "config.py",
        *LANGUAGE,
    }
    assert not found & others


@pytest.mark.parametrize("player", RULES)
@pytest.mark.parametrize(
    "name", ["predators.py", "readings.py", "network.py", "feedforward.py", "engine.py", "observation.py"]
)
def test_the_key_changes_with_the_rule_of_the_player_and_not_with_anothers(
    monkeypatch: pytest.MonkeyPatch, player: str, name: str
) -> None:
    known, own = RULES[player]
    keys, read = DigestCache(move_opponents.py_func), Path.read_bytes
    key = keys._index_key(signature(known), codegen())
    monkeypatch.setattr(sources, "_DEFINED", {})
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + (b"# edited" if path.name == name else b""))
    edited = keys._index_key(signature(known), codegen())
    assert (edited != key) == (name in own or name in ("engine.py", "observation.py"))


def test_players_of_different_classes_have_different_keys() -> None:
    found = DigestCache(move_opponents.py_func)
    keys = [found._index_key(signature(player), codegen()) for player, _ in RULES.values()]
    assert len({str(key) for key in keys}) == 2
    assert len({digest for _, digest in keys}) == 2


# -- named tuples -------------------------------------------------------------------------------------------------


class Pair(NamedTuple):
    first: Any
    second: Any


class Leaf(NamedTuple):
    value: Any


class Twig(NamedTuple):
    value: Any


def test_named_tuples_are_found_in_named_and_plain_tuples() -> None:
    def found(*values: Any) -> set[type]:
        return named_tuples(typeof(value) for value in values)

    assert found(3, 2.5, np.zeros(3), (1, 2), (1, 2.5), "a") == set()
    assert found(Leaf(3)) == {Leaf}
    assert found(Pair(Leaf(3), 4)) == {Pair, Leaf}
    assert found((1, (2.5, Leaf(3)))) == {Leaf}  # of different types
    assert found((Leaf(3), Leaf(4))) == {Leaf}  # of one
    assert found(Pair(Leaf(3), (Twig(np.zeros(2)), 1))) == {Pair, Leaf, Twig}
    assert found(Leaf(1), 2, Twig(3)) == {Leaf, Twig}


def test_words_tell_classes_of_one_name_and_their_places_apart() -> None:
    class Others:
        class Leaf(NamedTuple):
            value: Any

    ours, theirs, number = Leaf(3), Others.Leaf(3), np.zeros(3)
    told = [((ours, theirs),), ((theirs, ours),), ((ours, ours),), (ours, theirs), (ours,), (3,), (2.5,), (number,)]
    words = [", ".join(in_words(typeof(value)) for value in values) for values in told]
    assert len(set(words)) == len(told)
    assert words[4] == f"{__name__}.Leaf(int64)"
    assert words[3] == f"{__name__}.Leaf(int64), {Others.Leaf.__module__}.{Others.Leaf.__qualname__}(int64)"


def test_the_file_of_a_class_counts_though_no_rule_of_it_is_called() -> None:
    """Its fields are what the machine code reads."""
    classes = {Pair, *named_tuples(STEP)}
    assert names(source_files(play_turn.py_func, classes)) == SOURCES | {Path(__file__).name}
