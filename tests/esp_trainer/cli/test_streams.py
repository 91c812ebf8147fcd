"""Standard streams that are closed, full, or without the characters that commands print."""

from __future__ import annotations

import ast
import io
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import pytest

import esp_trainer
import predprey_env
from esp_trainer.cli import main, streams, teams
from esp_trainer.cli.streams import standard_streams
from esp_trainer.cli.training import quoted
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import preset
from esp_trainer.sweep.work import carry_out

linux = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full and /proc")
TRAIN = ("train", "smoke", "--generations", "1", "--out", "run")


def encoded(encoding: str, errors: str = "strict") -> io.TextIOWrapper:
    return io.TextIOWrapper(io.BytesIO(), encoding=encoding, errors=errors)


def read(stream: io.TextIOWrapper) -> str:
    stream.flush()
    data = stream.buffer.getvalue()  # type: ignore[attr-defined]
    return data.decode(stream.encoding)


# Characters.


@pytest.mark.parametrize(
    ("encoding", "lines"),
    [
        ("utf-8", ["┌─────────────────────────┐", "│ · · · · · · · · · · · · │"]),
        ("cp1252", ["+-------------------------+", "| · · · · · · · · · · · · |"]),
        ("ascii", ["+-------------------------+", "| . . . . . . . . . . . . |"]),
    ],
)
def test_a_replay_is_drawn_in_the_characters_that_there_are(
    encoding: str, lines: list[str], predators: Path, prey: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdout", encoded(encoding))
    assert main(["replay", str(predators), "--against", str(prey), "--until", "0"]) == 0
    drawn = read(sys.stdout).splitlines()  # type: ignore[arg-type]
    assert drawn[1] == lines[0]
    assert lines[1] in drawn
    assert {len(line) for line in drawn[1:]} == {27}


def test_every_character_that_is_printed_has_a_plain_one() -> None:
    """Those of all words in our sources; a docstring is not printed."""
    found: set[str] = set()
    for package in (esp_trainer, predprey_env):
        for source in Path(package.__file__).parent.rglob("*.py"):
            if source == Path(streams.__file__):
                continue
            tree = ast.parse(source.read_text("utf-8"))
            texts = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
            for node in ast.walk(tree):
                if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                    texts -= {ast.get_docstring(node, clean=False)}
            found |= {
                character for text in texts if isinstance(text, str) for character in text if ord(character) > 126
            }
    assert set("│·▁█±") <= found
    assert b"\\" not in "".join(sorted(found)).encode("ascii", streams._HANDLER)


@pytest.mark.parametrize(
    ("encoding", "said"), [("utf-8", r"é-\udcff"), ("cp1252", r"é-\udcff"), ("ascii", r"\xe9-\udcff")]
)
def test_a_path_is_escaped_where_it_is_no_text(encoding: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = os.fsdecode("é-".encode() + b"\xff")
    for name, errors in (("stdout", "strict"), ("stderr", "backslashreplace")):
        monkeypatch.setattr(sys, name, encoded(encoding, errors))
    assert main(["train", "smoke", "--generations", "1", "--out", path]) == 0
    assert read(sys.stdout).startswith(f"1 generation in {said}\n")  # type: ignore[arg-type]
    assert main(["show", path]) == 1
    assert read(sys.stderr).endswith(f"esp-trainer: {said} is not a file; name a file in {said}/champions\n")  # type: ignore[arg-type]


@pytest.mark.parametrize(("encoding", "e"), [("utf-8", "é".encode()), ("ascii", rb"\xe9")])
def test_a_stream_that_takes_bytes_gets_those_of_a_path(encoding: str, e: bytes, monkeypatch: Any) -> None:
    """Under ``LC_ALL=C``, where Python lets all bytes of paths pass."""
    monkeypatch.setattr(sys, "stdout", stdout := encoded(encoding, "surrogateescape"))
    assert main(["train", "smoke", "--generations", "1", "--out", os.fsdecode("é-".encode() + b"\xff\xfe")]) == 0
    stdout.flush()
    assert stdout.buffer.getvalue().splitlines()[0] == b"1 generation in " + e + b"-\xff\xfe"  # type: ignore[attr-defined]
    assert stdout.errors == "surrogateescape"


@pytest.mark.parametrize(
    "name", [b"b\xff", b"it's \xff\\1", b"-\n", "é ü".encode(), b"\xe2\x80\xae", b"-plain", b"$'a'"]
)
@pytest.mark.skipif(not shutil.which("bash"), reason="needs a shell that knows $'...'")
def test_a_hint_can_be_pasted_into_a_shell_whatever_bytes_a_path_has(name: bytes) -> None:
    path = Path(os.fsdecode(name))
    hint = quoted(path)
    assert hint.isprintable()
    said = subprocess.run(["bash", "-c", f"printf %s {hint}"], capture_output=True, check=True).stdout
    assert said.removeprefix(b"./") == name


def test_streams_are_as_before_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    before = encoded("ascii"), encoded("ascii", "backslashreplace"), None
    for name, stream in zip(("stdout", "stderr", "stdin"), before, strict=True):
        monkeypatch.setattr(sys, name, stream)
    assert main(["presets"]) == 0
    with pytest.raises(SystemExit):
        main(["--version"])
    assert (sys.stdout, sys.stderr, sys.stdin) == before
    assert (sys.stdout.errors, sys.stderr.errors) == ("strict", "backslashreplace")


def test_commands_that_overlap_share_the_streams_until_the_last_has_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """In two threads, of which the first to begin is the first to end."""
    before = encoded("ascii"), None, None
    for name, stream in zip(("stdout", "stderr", "stdin"), before, strict=True):
        monkeypatch.setattr(sys, name, stream)
    first, last = standard_streams(), standard_streams()
    first.__enter__()
    last.__enter__()
    first.__exit__(None, None, None)
    print("á ±")
    print("lost", file=sys.stderr, flush=True)
    last.__exit__(None, None, None)
    assert read(before[0]) == "\\xe1 +-\n"
    assert (sys.stdout, sys.stderr, sys.stdin) == before
    assert before[0].errors == "strict"


def test_a_warning_of_ours_is_a_line_like_others_and_those_of_others_are_as_before(
    esp_trainer: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    others: list[str] = []
    monkeypatch.setattr(warnings, "showwarning", before := lambda text, *_: others.append(str(text)))

    def warn(*_: Any) -> int:
        for package in ("predprey_env", "numpy"):
            warnings.warn_explicit(f"{package} is slow", RuntimeWarning, package, 0)
        return 0

    monkeypatch.setattr(teams, "show", warn)
    assert esp_trainer("show", "x") == (0, "", "esp-trainer: predprey_env is slow\n")
    assert others == ["numpy is slow"]
    assert warnings.showwarning is before


def test_a_warning_that_is_an_error_is_told_in_one_line(esp_trainer: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """As PYTHONWARNINGS=error has it."""

    def warn(*_: Any, **__: Any) -> None:
        warnings.warn_explicit("machine code is not kept", RuntimeWarning, "predprey_env", 0)

    for method in ("compile", "evaluate"):
        monkeypatch.setattr(FusedEvaluator, method, warn)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        outcome = esp_trainer("train", "smoke", "--out", "run")
        assert outcome.code == 1
        assert outcome.err.splitlines()[-1] == "esp-trainer: machine code is not kept"
        assert not Path("run").exists()
        assert carry_out(Path("run").resolve(), preset("smoke")) == "machine code is not kept"
    assert [path.name for path in Path().iterdir()] == ["run"], "no traceback beside it"


def test_a_stream_that_has_no_encoding_is_written_to(monkeypatch: pytest.MonkeyPatch) -> None:
    """A notebook's, say."""
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    assert main(["presets"]) == 0
    assert sys.stdout.getvalue().startswith("race-3v1 ")  # type: ignore[attr-defined]


# Streams that are closed or full.


@pytest.mark.parametrize("closed", [["stderr"], ["stdout"], ["stdin"], ["stdin", "stdout", "stderr"]], ids=",".join)
def test_a_run_is_trained_whichever_stream_is_closed(closed: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    for name in closed:
        monkeypatch.setattr(sys, name, None)  # as Python has it
    assert main(list(TRAIN)) == 0
    assert [getattr(sys, name) for name in closed] == [None] * len(closed)
    assert len(Path("run/metrics.jsonl").read_bytes().splitlines()) == 1


@linux
def test_no_file_gets_the_descriptor_of_a_closed_stream(tmp_path: Path) -> None:
    code = """
import os, pathlib, subprocess
from esp_trainer.cli.streams import standard_streams
with standard_streams():
    file = pathlib.Path("file").open("w")
    print(file.fileno() > 2, *(os.readlink(f"/proc/self/fd/{n}") for n in range(3)), file=file)
    file.close()
    subprocess.run(["sh", "-c", "readlink /proc/self/fd/2 > child"])
"""
    script = tmp_path / "script.py"
    script.write_text(code)
    subprocess.run(["sh", "-c", f"exec {sys.executable} {script} <&- >&- 2>&-"], check=True)
    assert (tmp_path / "file").read_text() == "True /dev/null /dev/null /dev/null\n"
    assert (tmp_path / "child").read_text() == "/dev/null\n"


@linux
def test_a_run_is_trained_whose_messages_nobody_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk of their log is full, or who read them is gone."""
    reader, writer = os.pipe()
    os.close(reader)
    for number, descriptor in enumerate((os.open("/dev/full", os.O_WRONLY), writer)):
        with os.fdopen(descriptor, "w", buffering=1) as messages:
            monkeypatch.setattr(sys, "stderr", messages)
            assert main([*TRAIN[:-1], f"run{number}"]) == 0
            assert main(["show", "nowhere"]) == 1
        assert len(Path(f"run{number}/metrics.jsonl").read_bytes().splitlines()) == 1
