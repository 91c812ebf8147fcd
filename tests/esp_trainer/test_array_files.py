"""Files of arrays come back as they were, and are refused when a bit of them is wrong."""

from __future__ import annotations

import ast
import json
import os
import pickle
import random
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from safetensors.numpy import save

import esp_trainer
import predprey_env
from esp_trainer import files
from esp_trainer.files import (
    DamagedFileError,
    read_arrays,
    to_json,
    write_arrays,
)

if TYPE_CHECKING:
    from collections.abc import Callable

ARRAYS = {
    "weights": np.array([[1.5, -2.0], [0.0, 3.25]], np.float32),
    "wiring": np.arange(3),
    "nothing": np.zeros((0, 2), np.float32),
}
HEADER = {"name": "small", "best": None, "rate": 0.1}


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A file of a few hundred bytes."""
    path = tmp_path / "small.safetensors"
    write_arrays(path, "thing", HEADER, ARRAYS)
    return path


def _refusal(path: Path, kind: str = "thing") -> str:
    with pytest.raises(DamagedFileError) as refused:
        read_arrays(path, kind)
    line = str(refused.value)
    assert "\n" not in line
    assert str(path) in line
    return line


# Reading back.


def test_arrays_come_back_as_they_were(small: Path) -> None:
    header, arrays = read_arrays(small, "thing")
    assert header == {"kind": "thing", "schema": 1, **HEADER}
    assert set(arrays) == set(ARRAYS)
    for name, array in arrays.items():
        assert array.dtype == ARRAYS[name].dtype
        assert array.shape == ARRAYS[name].shape
        assert (array == ARRAYS[name]).all()


@pytest.mark.parametrize(
    "view",
    [
        np.arange(12.0).reshape(3, 4).T,
        np.arange(12.0)[::-1],
        np.arange(12.0)[::3],
        np.broadcast_to(np.float32(1.5), (2, 3)),
        np.arange(24, dtype=np.int16).reshape(2, 3, 4)[:, 1],
    ],
    ids=["transposed", "reversed", "strided", "broadcast", "sliced"],
)
def test_a_view_comes_back_with_its_values(view: np.ndarray, tmp_path: Path) -> None:
    write_arrays(tmp_path / "file", "thing", {}, {"view": view})
    _, arrays = read_arrays(tmp_path / "file", "thing")
    assert (arrays["view"] == view).all()
    assert arrays["view"].shape == view.shape


def test_every_type_and_shape_of_number_comes_back(tmp_path: Path) -> None:
    arrays = {
        dtype: np.arange(6).reshape(1, 2, 3).astype(dtype)
        for dtype in ("float16", "float32", "float64", "int8", "int16", "int32", "int64", "uint8", "uint64", "bool")
    }
    arrays["one number"] = np.array(0.5)
    write_arrays(tmp_path / "file", "thing", {}, arrays)
    read = read_arrays(tmp_path / "file", "thing")[1]
    for name, array in arrays.items():
        assert (read[name].dtype, read[name].shape) == (array.dtype, array.shape)
        assert np.array_equal(read[name], array)


def test_a_file_without_arrays_is_a_file(tmp_path: Path) -> None:
    write_arrays(tmp_path / "file", "thing", {"n": 1}, {})
    assert read_arrays(tmp_path / "file", "thing") == ({"kind": "thing", "schema": 1, "n": 1}, {})


def test_words_of_any_script_come_back(tmp_path: Path) -> None:
    header = {"name": 'Räuber "und" Beute \\ 捕食者 \U0001f43a\n', "deep": {"list": [1, [2.5, {}]]}}
    write_arrays(tmp_path / "file", "thing", header, ARRAYS)
    assert read_arrays(tmp_path / "file", "thing")[0] == {"kind": "thing", "schema": 1, **header}


def test_equal_contents_are_equal_bytes(small: Path, tmp_path: Path) -> None:
    again = {name: ARRAYS[name].copy() for name in reversed(ARRAYS)}
    write_arrays(tmp_path / "again", "thing", HEADER, again)
    assert (tmp_path / "again").read_bytes() == small.read_bytes()


def test_a_header_that_is_not_json_is_never_written(tmp_path: Path) -> None:
    for value in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match="JSON"):
            write_arrays(tmp_path / "file", "thing", {"score": value}, ARRAYS)
    assert not list(tmp_path.iterdir())


# Refusing.


def test_a_file_with_any_one_bit_flipped_is_refused_or_holds_the_same(small: Path) -> None:
    data = small.read_bytes()
    whole = read_arrays(small, "thing")
    survivors = 0
    for bit in range(0, 8 * len(data), 3):  # some of every byte, and each of the eight equally often
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        small.write_bytes(flipped)
        try:
            header, arrays = read_arrays(small, "thing")
        except DamagedFileError as refused:
            line = str(refused)
            assert "\n" not in line, bit
            assert str(small) in line, bit
            continue
        survivors += 1
        assert header == whole[0], bit
        assert {name: (array.dtype, array.shape, array.tobytes()) for name, array in arrays.items()} == {
            name: (array.dtype, array.shape, array.tobytes()) for name, array in whole[1].items()
        }, bit
    assert survivors < len(data) / 30


def test_a_file_cut_at_any_length_is_refused(small: Path) -> None:
    data = small.read_bytes()
    for length in range(len(data)):
        small.write_bytes(data[:length])
        _refusal(small)


@pytest.mark.parametrize("more", [b"\0", b"x", b" " * 8, bytes(100)])
def test_a_file_with_more_at_its_end_is_refused(more: bytes, small: Path) -> None:
    small.write_bytes(small.read_bytes() + more)
    _refusal(small)


def test_two_arrays_that_trade_places_are_refused(tmp_path: Path) -> None:
    one, two = np.ones(4, np.float32), np.full(4, 2, np.float32)
    write_arrays(tmp_path / "file", "thing", {}, {"one": one, "two": two})
    data = (tmp_path / "file").read_bytes()
    (tmp_path / "file").write_bytes(data.replace(one.tobytes() + two.tobytes(), two.tobytes() + one.tobytes()))
    assert "contents do not match their digest" in _refusal(tmp_path / "file")


def test_a_header_that_was_edited_is_refused(small: Path) -> None:
    small.write_bytes(small.read_bytes().replace(b"0.1", b"0.2"))
    assert "contents do not match their digest" in _refusal(small)


FOREIGN: dict[str, bytes] = {
    "no metadata": save({"a": np.ones(3, np.float32)}),
    "other metadata": save({"a": np.ones(3, np.float32)}, metadata={"format": "pt"}),
    "metadata that is not JSON": save({}, metadata={"esp_trainer": "hello"}),
    "metadata that is no mapping": save({}, metadata={"esp_trainer": "[1]"}),
    "metadata that is null": save({}, metadata={"esp_trainer": "null"}),
    "metadata that is empty": save({}, metadata={"esp_trainer": ""}),
    "metadata with NaN": save({}, metadata={"esp_trainer": '{"score": NaN, "digest": "x"}'}),
    "metadata that is deep": save({}, metadata={"esp_trainer": "[" * 100_000}),
    "metadata as deep as can be read": save({}, metadata={"esp_trainer": '{"a":' * 900 + "1" + "}" * 900}),
    "metadata with a long number": save({}, metadata={"esp_trainer": '{"a": ' + "1" * 10_000 + "}"}),
    "no digest": save({}, metadata={"esp_trainer": '{"kind": "thing", "schema": 1}'}),
    "a digest of another type": save({}, metadata={"esp_trainer": '{"kind": "thing", "digest": [1]}'}),
    "bfloat16": struct.pack("<Q", 63) + b'{"a":{"dtype":"BF16","shape":[2],"data_offsets":[0,4]}}'.ljust(63) + bytes(4),
    "nothing": b"",
    "eight zeros": bytes(8),
    "zeros": bytes(1000),
    "a header as long as can be": struct.pack("<Q", 2**64 - 1) + bytes(100),
    "a header of an exabyte": struct.pack("<Q", 2**60) + b"{}" + bytes(100),
    "a header of 99 MB": struct.pack("<Q", 99_000_000) + b"{}" + bytes(100),
    "a header past the end": struct.pack("<Q", 200) + b"{}".ljust(100),
    "a header that is not JSON": struct.pack("<Q", 8) + b"{hello} ",
    "a header that is not text": struct.pack("<Q", 8) + b"\xff" * 8,
    "an array of negative place": struct.pack("<Q", 62)
    + b'{"a":{"dtype":"F32","shape":[1],"data_offsets":[-4,0]}}'.ljust(62)
    + bytes(4),
    "an array larger than memory": struct.pack("<Q", 90)
    + b'{"a":{"dtype":"F32","shape":[9999999999999],"data_offsets":[0,39999999999996]}}'.ljust(90)
    + bytes(4),
    "an array whose size overflows": struct.pack("<Q", 90)
    + b'{"a":{"dtype":"F32","shape":[4294967296,4294967296],"data_offsets":[0,0]}}'.ljust(90),
    "text": b"hello\n" * 100,
    "JSON": to_json({"kind": "thing", "schema": 1}),
    "an npy file": b"\x93NUMPY\x01\x00v\x00{'descr': '|O', 'fortran_order': False, 'shape': (1,), }".ljust(128) + b"\n",
    "a zip file": b"PK\x03\x04" + bytes(200),
}


@pytest.mark.parametrize("data", FOREIGN.values(), ids=FOREIGN)
def test_a_foreign_file_is_refused_in_one_line(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "foreign").write_bytes(data)
    _refusal(tmp_path / "foreign")


def test_random_bytes_are_refused(tmp_path: Path) -> None:
    generator = random.Random(0)
    for length in range(0, 400, 3):
        (tmp_path / "noise").write_bytes(generator.randbytes(length))
        _refusal(tmp_path / "noise")


def test_a_foreign_safetensors_file_is_told_from_a_damaged_one(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(FOREIGN["other metadata"])
    assert _refusal(tmp_path / "file").endswith("was not written by esp_trainer")


def test_another_kind_is_refused_with_both_names(small: Path) -> None:
    assert _refusal(small, "team").endswith("must be a team, but is a thing")


@pytest.mark.parametrize("schema", [0, 2, "1", None])
def test_another_schema_is_refused_with_both_numbers(
    schema: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as later:
        later.setattr(files, "SCHEMA", schema)
        write_arrays(tmp_path / "file", "thing", HEADER, ARRAYS)
    assert _refusal(tmp_path / "file").endswith(f"must have schema 1, but has {schema}")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_numbers_that_are_not_finite_are_refused_with_the_array(value: float, dtype: Any, tmp_path: Path) -> None:
    weights = np.ones((4, 5), dtype)
    weights[2, 3] = value
    write_arrays(tmp_path / "file", "thing", HEADER, {**ARRAYS, "spoilt": weights})
    assert _refusal(tmp_path / "file").endswith("is damaged: spoilt holds values that are not finite")


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda path: None, "is not there"),
        (lambda path: path.mkdir(), "is not a file"),
        (lambda path: os.mkfifo(path), "is not a file"),
        (lambda path: path.symlink_to("nowhere"), "is not there"),
        (lambda path: path.symlink_to("/dev/zero"), "is not a file"),
    ],
    ids=["nothing", "a directory", "a pipe", "a link to nothing", "a link to a device"],
)
def test_what_is_no_file_is_refused(make: Callable[[Path], Any], says: str, tmp_path: Path) -> None:
    make(tmp_path / "file")
    with pytest.raises(FileNotFoundError, match=f"file {says}$"):
        read_arrays(tmp_path / "file", "thing")


# Pickles.


class _Trap:
    """Leaves a mark where it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.mark,)


def test_a_pickle_is_refused_and_never_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        pytest.fail("something was unpickled")

    mark, path = tmp_path / "mark", tmp_path / "pickle"
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        path.write_bytes(pickle.dumps(_Trap(mark), protocol))
        with monkeypatch.context() as watched:
            for name in ("load", "loads", "Unpickler"):
                watched.setattr(pickle, name, refuse)
            assert "is damaged" in _refusal(path)
        assert not mark.exists()
    pickle.loads(path.read_bytes())
    assert mark.exists(), "the trap works"


def test_a_numpy_file_of_objects_is_refused_and_never_opened(tmp_path: Path) -> None:
    mark, path = tmp_path / "mark", tmp_path / "objects"
    with path.open("wb") as file:
        np.save(file, np.array([_Trap(mark)], object), allow_pickle=True)
    assert "is damaged" in _refusal(path)
    assert not mark.exists()


def test_no_module_of_ours_knows_how_to_unpickle() -> None:
    """PyTorch does; it is imported to play, and loads weights only (tests/ecosystem springs a trap)."""
    plays_torch = Path(esp_trainer.__file__).parent / "benchmark" / "batched.py"
    unpicklers = {"pickle", "_pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve", "torch"}
    sources = [file for package in (esp_trainer, predprey_env) for file in Path(package.__file__).parent.rglob("*.py")]
    assert len(sources) > 30
    for source in sources:
        for node in ast.walk(ast.parse(source.read_text())):
            named: set[str] = set()
            if isinstance(node, ast.Import):
                named = {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                named = {node.module.partition(".")[0]}
            elif isinstance(node, ast.keyword):
                assert node.arg != "allow_pickle", source
            assert not named & (unpicklers - {"torch"} if source == plays_torch else unpicklers), source


def test_the_header_is_one_entry_of_json_that_others_can_read(small: Path) -> None:
    data = small.read_bytes()
    (length,) = struct.unpack("<Q", data[:8])
    metadata = json.loads(data[8 : 8 + length])["__metadata__"]
    assert list(metadata) == ["esp_trainer"]
    header = json.loads(metadata["esp_trainer"])
    assert len(header.pop("digest")) == 64
    assert header == {"kind": "thing", "schema": 1, **HEADER}
