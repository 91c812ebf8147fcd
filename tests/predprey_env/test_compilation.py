"""Machine code on disk is that of the rules as they are."""

from __future__ import annotations

import errno
import importlib.util
import os
import pickle
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import pytest
from numba.core import caching
from numba.core.compiler_lock import global_compiler_lock

from predprey_env.envs.turn import play_turn
from predprey_env.jit import cache, exclusion, rule
from predprey_env.jit.sources import digest, source_files

# -- the cache ----------------------------------------------------------------------------------------------------


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(autouse=True)
def cache_beside_the_source(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where these tests look for it, whatever NUMBA_CACHE_DIR says."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")


def test_processes_that_save_at_once_do_not_take_the_same_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other has read the empty index, and saves while ours is about to write its code."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    ours, theirs = (cache.DigestCache(play_turn.py_func)._cache_file for _ in range(2))
    ours._save_index({})
    write, empty = ours._save_data, theirs._load_index()

    def write_after_the_other(name: str, data: object) -> None:
        with monkeypatch.context() as late:
            late.setattr(theirs, "_load_index", lambda: dict(empty))
            theirs.save("float", "code for float")
        write(name, data)

    monkeypatch.setattr(ours, "_save_data", write_after_the_other)
    ours.save("int", "code for int")
    assert theirs.load("float") == "code for float"
    assert theirs.load("int") == "code for int"


def test_what_another_process_compiles_is_waited_for_and_loaded(program, monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = program(1), program(1)
    waited = []

    def lock_of_the_other(*_: Any) -> None:
        if not waited:
            raise BlockingIOError

    def wait(seconds: float) -> None:
        waited.append(seconds)
        theirs(10)

    monkeypatch.setattr(exclusion.fcntl, "lockf", lock_of_the_other)
    monkeypatch.setattr(exclusion, "sleep", wait)
    assert ours(10) == 11
    assert len(waited) == 1
    assert (ours.stats.cache_hits.total(), theirs.stats.cache_hits.total()) == (1, 0)


HOLDS = "import fcntl, sys; file = open(sys.argv[1], 'ab'); fcntl.lockf(file, fcntl.LOCK_EX); print(); input()"


def test_a_process_that_never_ends_is_waited_for_in_vain(
    program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    main, waited = program(1), []
    monkeypatch.setattr(exclusion, "sleep", waited.append)
    assert main(10) == 11
    assert not waited
    (file,) = tmp_path.glob("__pycache__/outer_entry.main*.lock")
    with subprocess.Popen([sys.executable, "-c", HOLDS, file], stdin=-1, stdout=-1) as other:
        other.stdout.readline()
        monkeypatch.setattr(exclusion, "PATIENCE", 0.01)
        assert main(0.5) == 1.5
        assert waited, "another signature, but the other holds all"
        other.stdin.close()


def test_one_thread_at_a_time_reads_sources(program, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two that parse at once are a SystemError in Python 3.11."""
    locked = []

    def digest_and_look(*given: Any) -> str:
        locked.append(global_compiler_lock.is_locked())
        return digest(*given)

    monkeypatch.setattr(cache, "digest", digest_and_look)
    assert program(1)(10) == 11
    assert locked
    assert all(locked)


def test_an_index_with_a_class_that_is_gone_is_written_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another program may have written it after ours looked for its machine code."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    files = cache.DigestCache(play_turn.py_func)._cache_file
    files._save_index({})
    index = Path(files._index_path)
    gone = b"\x80\x04c" + b"no_such_module\nGone\n."  # a pickle that names a class
    index.write_bytes(index.read_bytes()[: len(pickle.dumps(files._version, -1))] + gone)
    files.save("int", "code for int")
    assert files.load("int") == "code for int"


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """``program(number)``: an entry point in one file over a rule in another, which adds a number to its argument."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def write(number: int) -> Any:
        (tmp_path / "inner_rule.py").write_text(
            f"from predprey_env.jit.compilation import rule\n\n@rule\ndef add(a):\n    return a + {number}\n"
        )
        outer = tmp_path / "outer_entry.py"
        if not outer.exists():
            outer.write_text(
                "from inner_rule import add\nfrom predprey_env.jit.compilation import entry_point\n\n"
                "@entry_point\ndef main(a):\n    return add(a)\n"
            )
        monkeypatch.delitem(sys.modules, "inner_rule", raising=False)
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


def test_a_rule_that_is_edited_before_it_is_compiled_is_not_kept_as_the_edited_one(program, tmp_path: Path) -> None:
    old = program(1)
    rule = tmp_path / "inner_rule.py"
    rule.write_text(rule.read_text().replace("a + 1", "a + 2"))
    assert old(10) == 11  # it was defined before
    assert program(2)(10) == 12


def test_a_rule_that_is_called_through_its_module_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "module_rule.py").write_text(
        "from predprey_env.jit.compilation import rule\n\n@rule\ndef add(a):\n    return a + 1\n"
    )
    (tmp_path / "module_entry.py").write_text(
        "import module_rule\nfrom predprey_env.jit.compilation import entry_point\n\n"
        "@entry_point\ndef main(a):\n    return module_rule.add(a)\n"
    )
    importlib.invalidate_caches()
    main = _load(tmp_path / "module_entry.py").main
    assert main(10) == 11
    assert str(tmp_path / "module_rule.py") in source_files(main.py_func)


def test_an_unchanged_program_is_loaded_from_disk(program) -> None:
    program(1)(10)
    again = program(1)
    assert again(10) == 11
    assert sum(again.stats.cache_hits.values()) == 1


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("length", [0, 40])
def test_machine_code_that_was_cut_off_is_compiled_again(program, tmp_path: Path, kind: str, length: int) -> None:
    """As a machine leaves it that loses power."""
    program(1)(10)
    (file,) = tmp_path.glob(f"__pycache__/outer_entry.main*.{kind}")
    file.write_bytes(file.read_bytes()[:length])
    for hits in (0, 1):
        again = program(1)
        assert again(10) == 11
        assert sum(again.stats.cache_hits.values()) == hits


# -- where it cannot be kept --------------------------------------------------------------------------------------

UNKEPT = "machine code is not kept, and compiled again each time: {}; set NUMBA_CACHE_DIR to a writable directory"


@pytest.fixture
def warned(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[warnings.WarningMessage]]:
    """What a process that has not yet been warned is warned of."""
    monkeypatch.setattr(cache, "_warned", False)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield caught


def refuse(number: int) -> Callable[..., Any]:
    """A function that the system refuses, as with this error."""

    def fail(*_: Any) -> None:
        raise OSError(number, os.strerror(number))

    return fail


@pytest.mark.parametrize("given", ["", "a file/below"])
def test_without_a_place_for_machine_code_the_first_that_is_compiled_is_one_warning(
    program, warned, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", given and str(tmp_path / given))
    monkeypatch.setattr(caching._CacheLocator, "ensure_cache_path", refuse(errno.EROFS))
    mains = [program(number) for number in (1, 2)]
    assert warned == []
    assert [main(10) for main in mains] == [11, 12]
    assert mains[0](1.5) == 2.5
    (warning,) = warned
    reason = f"{tmp_path / given} cannot be written to" if given else "there is no place for it"
    assert str(warning.message) == UNKEPT.format(reason)
    shown = warnings.formatwarning(warning.message, warning.category, warning.filename, warning.lineno)
    assert shown == f"predprey_env:0: RuntimeWarning: {warning.message}\n", "one line"


def test_an_entry_point_that_is_in_no_file_is_compiled_each_time_without_a_warning(warned) -> None:
    """It is of a notebook's cell, and no directory would help."""
    known: dict[str, Any] = {"__name__": "cell"}
    source = "from predprey_env.jit.compilation import entry_point\n\n@entry_point\ndef main(a):\n    return a + 1\n"
    exec(compile(source, "<cell 3>", "exec"), known)
    assert known["main"](10) == 11
    assert warned == []


def test_machine_code_that_finds_no_room_is_one_warning(
    program, warned, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mains = [program(number) for number in (1, 2)]
    monkeypatch.setattr(os, "replace", refuse(errno.ENOSPC))
    assert [main(10) for main in mains] == [11, 12]
    (warning,) = warned
    assert str(warning.message) == UNKEPT.format(f"{tmp_path}/__pycache__: No space left on device")


def test_machine_code_that_cannot_be_read_is_compiled_again(program, warned, tmp_path: Path) -> None:
    program(1)(10)
    (index,) = tmp_path.glob("__pycache__/outer_entry.main*.nbi")
    index.unlink()
    index.mkdir()
    assert program(1)(10) == 11
    (warning,) = warned
    assert str(warning.message) == UNKEPT.format(f"{tmp_path}/__pycache__: Is a directory")


def test_machine_code_that_was_cut_off_and_finds_no_room_is_compiled_again(
    program, warned, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program(1)(10)
    (index,) = tmp_path.glob("__pycache__/outer_entry.main*.nbi")
    index.write_bytes(index.read_bytes()[:40])
    monkeypatch.setattr(os, "replace", refuse(errno.ENOSPC))
    assert program(1)(10) == 11
    (warning,) = warned
    assert str(warning.message) == UNKEPT.format(f"{tmp_path}/__pycache__: No space left on device")


# -- whose it is --------------------------------------------------------------------------------------------------


def test_a_class_that_is_not_there_any_more_spoils_nothing_for_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A player that somebody wrote for an experiment is in the index of a function of this package, by its name."""
    monkeypatch.syspath_prepend(str(tmp_path))
    named = "from typing import NamedTuple\n\nclass {}(NamedTuple):\n    value: int\n"
    (tmp_path / "gone_player.py").write_text(named.format("Gone"))
    (tmp_path / "kept_player.py").write_text(named.format("Kept"))
    main = tmp_path / "ask_player.py"
    main.write_text(
        "from predprey_env.jit.compilation import entry_point\n\n"
        "@entry_point\ndef ask(player):\n    return player.value\n"
    )
    importlib.invalidate_caches()
    assert _load(main).ask(importlib.import_module("kept_player").Kept(4)) == 4
    assert _load(main).ask(importlib.import_module("gone_player").Gone(3)) == 3
    (tmp_path / "gone_player.py").unlink()
    for compiled in tmp_path.glob("__pycache__/gone_player*"):
        compiled.unlink()
    monkeypatch.delitem(sys.modules, "gone_player")
    importlib.invalidate_caches()
    ask = _load(main).ask
    assert ask(importlib.import_module("kept_player").Kept(4)) == 4
    assert sum(ask.stats.cache_hits.values()) == 1, "loaded, and not compiled again"


def test_a_rule_that_is_in_no_file_is_compiled_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a notebook: it cannot be known whether it was edited."""
    (tmp_path / "outer_entry.py").write_text(
        "from cell import add\nfrom predprey_env.jit.compilation import entry_point\n\n"
        "@entry_point\ndef main(a):\n    return add(a)\n"
    )
    for number in (1, 2):
        cell = ModuleType("cell")
        source = f"from predprey_env.jit.compilation import rule\n\n@rule\ndef add(a):\n    return a + {number}\n"
        exec(compile(source, "<cell 3>", "exec"), cell.__dict__)
        monkeypatch.setitem(sys.modules, "cell", cell)
        assert _load(tmp_path / "outer_entry.py").main(10) == 10 + number


def test_a_class_that_is_in_no_file_is_known_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "outer_entry.py").write_text(
        "from predprey_env.jit.compilation import entry_point\n\n"
        "@entry_point\ndef main(player):\n    return player.value\n"
    )
    cell = ModuleType("cell")
    monkeypatch.setitem(sys.modules, "cell", cell)
    source = "from typing import NamedTuple\n\nclass Number(NamedTuple):\n    value: int\n"
    exec(compile(source, "<cell 3>", "exec"), cell.__dict__)
    assert _load(tmp_path / "outer_entry.py").main(cell.Number(5)) == 5


def test_rules_and_entry_points_run_without_the_lock_of_python() -> None:
    @rule
    def add(a: int) -> int:
        return a + 1

    assert add.targetoptions["nogil"]
    assert play_turn.targetoptions["nogil"]
