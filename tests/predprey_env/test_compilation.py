from __future__ import annotations

import importlib.util
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba.core.registry import CPUDispatcher

from predprey_env import EnvConfig, compilation
from predprey_env.compilation import _DigestCache, source_files
from predprey_env.dynamics import World, draw_starts
from predprey_env.parallel_env import EVERYBODY, NOBODY, PREDATORS, PREY, _advance

if TYPE_CHECKING:
    from types import ModuleType

SOURCES = {
    *{"parallel_env.py", "dynamics.py", "observation.py", "fitness.py", "torus.py"},  # the rules of a step
    "config.py",  # the named tuple that they read
    *{"lanes.py", "floats.py", "compilation.py"},  # what they are written and compiled with
}


# -- the cache ----------------------------------------------------------------------------------------------------


def test_the_sources_of_a_step_are_all_files_that_state_a_rule() -> None:
    assert {Path(file).name for file in source_files(_advance.py_func)} == SOURCES


@pytest.mark.parametrize("name", sorted(SOURCES))
def test_the_key_of_the_cache_changes_with_each_source(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    read, signature = Path.read_bytes, _advance.signatures[0] if _advance.signatures else ()
    key = _DigestCache(_advance.py_func)._index_key(signature, _codegen())
    assert _DigestCache(_advance.py_func)._index_key(signature, _codegen()) == key
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + (b"# edited" if path.name == name else b""))
    assert _DigestCache(_advance.py_func)._index_key(signature, _codegen()) != key


def _codegen() -> Any:
    return _advance.targetctx.codegen()


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """``program(number)``: an entry point in one file over a rule in another, which adds a number to its argument."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def write(number: int) -> Any:
        (tmp_path / "inner_rule.py").write_text(
            f"from predprey_env.compilation import rule\n\n@rule\ndef add(a):\n    return a + {number}\n"
        )
        outer = tmp_path / "outer_entry.py"
        if not outer.exists():
            outer.write_text(
                "from inner_rule import add\nfrom predprey_env.compilation import entry_point\n\n"
                "@entry_point\ndef main(a):\n    return add(a)\n"
            )
        monkeypatch.delitem(__import__("sys").modules, "inner_rule", raising=False)
        importlib.invalidate_caches()
        for compiled in tmp_path.glob("__pycache__/inner_rule*"):
            compiled.unlink()
        return _load(outer).main

    return write


def test_an_edited_rule_is_never_answered_with_yesterdays_machine_code(program) -> None:
    assert program(1)(10) == 11
    edited = program(2)
    assert edited(10) == 12
    assert not edited.stats.cache_hits


def test_an_unchanged_program_is_loaded_from_disk(program) -> None:
    program(1)(10)
    again = program(1)
    assert again(10) == 11
    assert sum(again.stats.cache_hits.values()) == 1


def test_rules_and_entry_points_run_without_the_lock_of_python() -> None:
    @compilation.rule
    def add(a: int) -> int:
        return a + 1

    assert add.targetoptions["nogil"]
    assert _advance.targetoptions["nogil"]


# -- compiled and uncompiled --------------------------------------------------------------------------------------


def as_python(function: CPUDispatcher, known: dict[CPUDispatcher, FunctionType]) -> FunctionType:
    """The Python source of a compiled function, all compiled functions that it calls being Python too."""
    if function not in known:
        names = dict(function.py_func.__globals__)
        known[function] = FunctionType(function.py_func.__code__, names)
        for name in function.py_func.__code__.co_names:
            if isinstance(names.get(name), CPUDispatcher):
                names[name] = as_python(names[name], known)
    return known[function]


PYTHON = as_python(_advance, {})


@given(config=st.from_type(EnvConfig), seed=st.integers(0, 2**32 - 1))
def test_compiled_rules_equal_their_python_source(config: EnvConfig, seed: int) -> None:
    random = np.random.default_rng(seed)
    x, y = draw_starts(random, 1, config)[0].T.copy()
    worlds = [World(x.copy(), y.copy(), np.ones(config.n_prey, np.int32)) for _ in range(2)]
    seen = np.empty((2, 4 * config.n_predators * config.n_prey), np.float32)
    scores = np.empty((2, config.n_agents))
    turns = [PREY, PREDATORS] * 10 if config.rules.prey_first else [EVERYBODY] * 15
    for steps, turn in enumerate([NOBODY, *turns]):
        actions = random.integers(0, 5, config.n_agents, np.int32)
        for advance, world, view, score in zip((_advance, PYTHON), worlds, seen, scores, strict=True):
            advance(world, actions, turn, steps, config.rules, view, score)
        compiled, python = worlds
        assert all(rows.tobytes() == others.tobytes() for rows, others in zip(compiled, python, strict=True))
        assert seen[0].tobytes() == seen[1].tobytes()
        assert scores[0].tobytes() == scores[1].tobytes()
