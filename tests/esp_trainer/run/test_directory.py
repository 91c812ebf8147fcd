"""Where a run keeps itself: what may be begun, what can be read, what is brought back."""

from __future__ import annotations

import errno
import json
import os
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.coevolution.sides import check_parts
from esp_trainer.files import DamagedFileError
from esp_trainer.run.directory import Log, RunDirectory, versions, whole_lines
from esp_trainer.run.lock import Lock
from predprey_env.settings import PartError

if TYPE_CHECKING:
    from collections.abc import Callable

    from esp_trainer.config import RunConfig


def _rewrite(path: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    whole = json.loads(path.read_text())
    change(whole)
    path.write_text(json.dumps(whole))


@pytest.mark.parametrize("where", ["new", "deep/and/new", "empty"])
def test_a_run_begins_in_a_new_or_empty_directory(where: str, tiny: RunConfig, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    directory = RunDirectory(tmp_path / where)
    directory.create(tiny)
    assert directory.read_config() == tiny
    assert sorted(file.name for file in directory.path.iterdir()) == ["champions", "config.json"]


def test_a_directory_may_be_given_as_text(tiny: RunConfig, tmp_path: Path) -> None:
    RunDirectory(str(tmp_path / "run")).create(tiny)
    assert RunDirectory(tmp_path / "run").read_config() == tiny


def test_a_second_run_in_a_directory_is_refused_and_the_first_left_alone(tiny: RunConfig, tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path / "run")
    directory.create(tiny)
    before = directory.config_file.read_bytes()
    with pytest.raises(FileExistsError, match=r"run already holds a run; resume it, or choose another directory$"):
        directory.create(tiny.replace(seed=1))
    assert directory.config_file.read_bytes() == before


@pytest.mark.parametrize("name", ["notes.txt", ".hidden", "champions"])
def test_a_run_does_not_begin_among_other_files(name: str, tiny: RunConfig, tmp_path: Path) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(FileExistsError, match=r"is not an empty directory, and holds no run$"):
        RunDirectory(tmp_path).create(tiny)
    assert [file.name for file in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "mine"


def test_a_run_does_not_begin_where_a_file_is(tiny: RunConfig, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(FileExistsError, match=r"is not an empty directory, and holds no run$"):
        RunDirectory(tmp_path / "file").create(tiny)
    with pytest.raises(OSError, match="Not a directory"):
        RunDirectory(tmp_path / "file/below").create(tiny)
    assert [file.name for file in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "mine"


def test_the_config_says_which_schema_and_version_wrote_it(tiny: RunConfig, tmp_path: Path) -> None:
    RunDirectory(tmp_path).create(tiny)
    whole = json.loads((tmp_path / "config.json").read_text())
    assert whole == {"schema": 1, "versions": versions(), "config": tiny.model_dump()}
    assert versions() == {"predprey-esp": version("predprey-esp"), "numpy": np.__version__}


def test_a_directory_without_a_config_holds_no_run(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(FileNotFoundError, match=r"holds no run: there is no config\.json$"):
            RunDirectory(path).read_config()


DAMAGES: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "another schema": (lambda whole: whole.update(schema=2), "schema must be 1, got 2"),
    "a schema in words": (lambda whole: whole.update(schema="1"), "schema must be 1, got '1'"),
    "an unknown field": (
        lambda whole: whole["config"]["esp"].update(n_trails=5),
        r".*unknown field (esp\.)?n_trails; did you mean (esp\.)?n_trials\?",
    ),
    "a value out of range": (
        lambda whole: whole["config"]["env"].update(n_prey=0),
        r"env\.n_prey must be at least 1, got 0",
    ),
    "a value of another type": (lambda whole: whole["config"].update(seed="3"), "seed must be an integer, got '3'"),
    "NaN": (lambda whole: whole["config"]["esp"].update(init_range=float("nan")), r"esp\.init_range must be .*got nan"),
    "a section of another type": (lambda whole: whole["config"].update(esp=[1]), r"esp must be .*got \[1\]"),
    "no mapping": (lambda whole: whole.update(config=[]), r"RunConfig must be a mapping of fields, got \[\]"),
    "no config": (lambda whole: whole.pop("config"), r".*\b(missing|no|lacks)\b.*"),
    "no schema": (lambda whole: whole.pop("schema"), r".*\b(missing|no|lacks)\b.*|schema must be 1.*"),
}


@pytest.mark.parametrize(("change", "line"), DAMAGES.values(), ids=DAMAGES)
def test_a_config_that_is_wrong_is_refused_with_what_is_wrong(
    change: Callable[[dict[str, Any]], Any], line: str, tiny: RunConfig, tmp_path: Path
) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    _rewrite(directory.config_file, change)
    with pytest.raises(DamagedFileError, match=rf"config\.json is damaged: ({line})$") as refused:
        directory.read_config()
    assert "\n" not in str(refused.value)


CLASSES = {
    "observation": ("env", "observation", "env.observation nowhere:Mine"),
    "game": ("game", "environment", "game.environment nowhere:Mine"),
    "algorithm": ("predators", "algorithm", "predators: algorithm nowhere:Mine"),
    "network": ("predators", "network", "network nowhere:Mine"),
}


@pytest.mark.parametrize(("section", "field", "which"), CLASSES.values(), ids=CLASSES)
def test_a_class_that_cannot_be_imported_is_named_and_no_file_is_called_damaged(
    section: str, field: str, which: str, tiny: RunConfig, tmp_path: Path
) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)

    def name_it(whole: dict[str, Any]) -> None:
        whole["config"].setdefault(section, {})[field] = "nowhere:Mine"
        if section == "game":  # another game has no world, and networks that read all
            whole["config"] = {"game": {"environment": "nowhere:Mine", "predators": "a_", "prey": "b_"}}
            whole["config"] |= {role: {"controller": "monolithic"} for role in ("predators", "prey")}

    _rewrite(directory.config_file, name_it)
    with pytest.raises(ValueError, match="cannot be imported") as refused:
        check_parts(directory.read_config())
    assert not isinstance(refused.value, DamagedFileError)
    line = f"{which} cannot be imported: ModuleNotFoundError: No module named 'nowhere'"
    assert str(refused.value).removeprefix(f"{tmp_path}: ") == line


def test_a_class_that_is_no_observation_is_named(tiny: RunConfig, tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    _rewrite(directory.config_file, lambda whole: whole["config"]["env"].update(observation="json:JSONDecoder"))
    with pytest.raises(PartError) as refused:
        directory.read_config()
    assert str(refused.value) == (
        f"{tmp_path}: env.observation json:JSONDecoder must be a named tuple, got JSONDecoder"
    )


def test_a_policy_that_there_is_not_means_damage_as_none_is_a_class(tiny: RunConfig, tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    _rewrite(directory.config_file, lambda whole: whole["config"]["prey"].update(policy="nowhere:Mine"))
    with pytest.raises(DamagedFileError, match=r"damaged: prey\.policy must be 'esp', .*, got 'nowhere:Mine'$"):
        directory.read_config()


BYTES = {
    "empty": b"",
    "not JSON": b"{'seed': 3}",
    "not text": b"\xff\xfe\x00\x01",
    "another value": b"[]",
    "a number": b"3",
    "nothing": b"null",
    "deep": b"[" * 100_000,
    "a number without end": b'{"schema": ' + b"1" * 10_000 + b"}",
}


@pytest.mark.parametrize("data", BYTES.values(), ids=BYTES)
def test_a_config_of_any_other_bytes_is_refused_in_one_line(data: bytes, tiny: RunConfig, tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    directory.config_file.write_bytes(data)
    with pytest.raises(DamagedFileError, match=r"config\.json is damaged") as refused:
        directory.read_config()
    assert "\n" not in str(refused.value)


def test_a_config_cut_anywhere_is_refused(tiny: RunConfig, tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    whole = directory.config_file.read_bytes()
    for length in range(len(whole) - 2):  # the last two are a brace and a line end
        directory.config_file.write_bytes(whole[:length])
        with pytest.raises(DamagedFileError, match=r"config\.json is damaged"):
            directory.read_config()


def test_champions_sort_by_generation(tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    names = [directory.champion_file("prey", generation).name for generation in (0, 9, 10, 450, 99_999)]
    assert names == sorted(names)
    assert directory.champion_file("predators", 41) == tmp_path / "champions/predators-00041.safetensors"


def test_rewinding_cuts_both_logs_and_drops_what_was_half_written(tiny: RunConfig, tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    directory.metrics_file.write_bytes(b'{"generation": 0}\n{"generation": 1}\n{"generation": 2}\n{"gene')
    directory.timing_file.write_bytes(b'{"generation": 0}\n{"generation": 1}\n{"generation": 2}\n')
    (tmp_path / ".checkpoint.safetensors.part").write_bytes(b"half")
    (tmp_path / "champions/.prey-00002.safetensors.part").write_bytes(b"half")
    directory.rewind(2)
    assert directory.metrics_file.read_bytes() == b'{"generation": 0}\n{"generation": 1}\n'
    assert directory.timing_file.read_bytes() == b'{"generation": 0}\n{"generation": 1}\n'
    assert not list(tmp_path.rglob(".*"))


def test_rewinding_goes_by_the_generations_of_timings_as_a_kill_may_have_cost_a_line(
    tiny: RunConfig, tmp_path: Path
) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    directory.metrics_file.write_bytes(b"".join(b'{"generation": %d}\n' % number for number in range(5)))
    directory.timing_file.write_bytes(b'{"generation": 0}\n{"generation": 2}\n{"generation": 3}\n')
    directory.rewind(3)
    assert directory.timing_file.read_bytes() == b'{"generation": 0}\n{"generation": 2}\n'


def test_rewinding_to_the_beginning_leaves_empty_logs(tiny: RunConfig, tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    directory.champions.rmdir()
    directory.rewind(0)
    assert directory.metrics_file.read_bytes() == directory.timing_file.read_bytes() == b""
    assert directory.champions.is_dir()


def test_rewinding_past_the_log_is_refused_and_changes_nothing(tiny: RunConfig, tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    directory.create(tiny)
    directory.metrics_file.write_bytes(b'{"generation": 0}\n{"generation": 1}')
    with pytest.raises(DamagedFileError, match=r"metrics\.jsonl must hold 2 whole lines, got 1$"):
        directory.rewind(2)
    assert directory.metrics_file.read_bytes() == b'{"generation": 0}\n{"generation": 1}'


def test_a_log_appends_lines_that_are_on_disk_at_once(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    for number in range(2):
        log = Log(path)
        log.append({"generation": number})
        assert len(whole_lines(path)) == number + 1
        log.sync()
        log.close()
    assert path.read_bytes() == b'{"generation": 0}\n{"generation": 1}\n'


def test_a_log_refuses_what_is_not_json_and_stays_whole(tmp_path: Path) -> None:
    log = Log(tmp_path / "log.jsonl")
    with pytest.raises(ValueError, match="JSON"):
        log.append({"mean": float("nan")})
    log.append({"mean": 1.0})
    log.close()
    assert (tmp_path / "log.jsonl").read_bytes() == b'{"mean": 1.0}\n'


def test_whole_lines_end_in_a_line_end(tmp_path: Path) -> None:
    log = tmp_path / "log"
    assert list(whole_lines(log)) == []
    log.write_bytes(b"one\ntwo\nthr")
    assert list(whole_lines(log)) == [b"one\n", b"two\n"]
    log.write_bytes(b"")
    assert list(whole_lines(log)) == []


@pytest.mark.parametrize("answer", ["ENOSYS", "ENOLCK", "EOPNOTSUPP", "EBADF", "EINVAL"])
def test_where_a_file_system_knows_no_locks_a_run_goes_on_without(
    answer: str, tiny: RunConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start: Any, resume: Any
) -> None:
    def refuse(*_: Any) -> None:
        number = getattr(errno, answer)
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("fcntl.flock", refuse)
    list(start(tmp_path, tiny).generations())
    list(resume(tmp_path, 8).generations())
    assert resume(tmp_path).done == 8
    if Path("/proc/self/fd").exists():
        assert tmp_path.resolve() not in [descriptor.resolve() for descriptor in Path("/proc/self/fd").iterdir()]


def test_a_lock_that_fails_for_another_reason_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr("fcntl.flock", refuse)
    with pytest.raises(OSError, match="Input/output error"):
        Lock(tmp_path)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows cannot fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_neither_keeps_a_lock_nor_takes_it_away(tmp_path: Path) -> None:
    directory = RunDirectory(tmp_path)
    directory.lock()
    ends, end = os.pipe()
    child = os.fork()
    if child == 0:
        directory.unlock()  # its own copy
        os.close(end)
        os.read(ends, 1)
        os._exit(0)
    with pytest.raises(BlockingIOError):
        Lock(tmp_path)
    second = os.fork()
    if second == 0:
        os.close(end)
        os.read(ends, 1)  # it holds a copy until it ends
        os._exit(0)
    directory.unlock()
    Lock(tmp_path).release()
    os.close(end)
    assert [os.waitpid(each, 0)[1] for each in (child, second)] == [0, 0]


def test_a_lock_is_free_while_nobody_has_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert Lock.is_free(tmp_path)
    lock = Lock(tmp_path)
    assert not Lock.is_free(tmp_path)
    lock.release()
    assert Lock.is_free(tmp_path)
    assert not Lock.is_free(tmp_path / "nowhere")

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("fcntl.flock", refuse)
    assert not Lock.is_free(tmp_path), "nobody knows"


def test_who_only_looks_whether_a_lock_is_free_keeps_nobody_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looking = Lock(tmp_path)
    monkeypatch.setattr("esp_trainer.run.lock.sleep", lambda _: looking.release())
    Lock(tmp_path).release()
