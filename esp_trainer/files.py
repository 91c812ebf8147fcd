"""Arrays and JSON on disk: written whole or not at all, and refused when damaged. Nothing is ever unpickled.

Arrays are stored in safetensors with a JSON header, which holds the kind of the file, its schema, and a digest of the
arrays and the header.
"""

from __future__ import annotations

import csv
import errno
import hashlib
import io
import json
import os
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from esp_trainer.arrays import StoredArray

SCHEMA = 1
_HEADER = "esp_trainer"


class DamagedFileError(ValueError):
    """A file is truncated, altered, foreign or of another schema."""


def write(path: Path, data: bytes) -> None:
    """Write a file whole, by syncing and renaming a new file beside it. The file keeps its mode, where the system can.

    A symbolic link stays, and its target is written. Some targets are written to instead of replaced: a target that is
    no regular file (such as a pipe), the file that standard output or standard error goes to, and a file whose
    directory allows no other file.
    """
    with naming(path):
        for descriptor in (1, 2):  # `--csv /dev/stdout > file` must not replace other output
            if _is_open_as(descriptor, path):
                sys.stdout.flush()
                with open(descriptor, "wb", closefd=False) as file:
                    file.write(data)
                return
        if path.exists() and not path.is_file():
            path.write_bytes(data)
            return
        place = _target(path)
        try:
            _replace(place, data)
        except OSError as error:
            if error.errno not in _CANNOT_REPLACE:
                raise
            place.write_bytes(data)


_CANNOT_REPLACE = (errno.EACCES, errno.EPERM, errno.EROFS, errno.EBUSY, errno.ENAMETOOLONG)
"""Errors of a directory in which no file can be made, of a file that is a mount point, and of a long name."""


def _replace(place: Path, data: bytes) -> None:
    beside = place.with_name(f".{place.name}.part")
    try:
        with beside.open("wb") as file:
            if place.exists():
                place.open("ab").close()  # refuse a read-only file, which a rename would replace
                with suppress(OSError):  # some file systems have no modes, or set them themselves
                    shutil.copymode(place, beside)
            file.write(data)
            file.flush()
            sync(file.fileno())
        beside.replace(place)
    except BaseException:  # Ctrl-C included
        beside.unlink(missing_ok=True)
        raise


def _target(path: Path) -> Path:
    """Return the path behind symbolic links. The file need not exist yet."""
    target = Path(os.path.realpath(path))
    if target.is_symlink():  # links that form a loop
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    return target


def _is_open_as(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except OSError:
        return False


def write_text(path: Path, text: str) -> None:
    """Write a text file whole, in UTF-8. Bytes of a path that are not valid text are written as escapes."""
    write(path, text.encode(errors="backslashreplace"))


def write_table(path: Path, rows: Iterable[Iterable[object]]) -> None:
    """Write a CSV file whole."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows(rows)
    write_text(path, text.getvalue())


def check_place(path: Path) -> None:
    """Raise the error that :func:`write` to this path would raise in any case.

    Call it before long work, so that a wrong path does not cost the result.
    """
    with naming(path):
        if path.is_fifo() or path.is_char_device():  # opening and closing a pipe would end it for its reader
            if not os.access(path, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        elif path.exists():
            path.open("ab").close()
        else:
            target = _target(path)
            target.touch()
            target.unlink()


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Raise errors of the operating system with the path that the user knows."""
    try:
        yield
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from None


def error_in_words(error: OSError) -> str:
    """Return an error of the operating system as one line: the file, and what is wrong with it."""
    where = f"{error.filename}: " if error.filename else ""
    return f"{where}{error.strerror}" if error.strerror else str(error)


def sync(descriptor: int) -> None:
    """Wait until an open file is on disk, where the system can."""
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _CANNOT_SYNC:
            raise


_CANNOT_SYNC = (errno.ENOSYS, errno.EINVAL, errno.EBADF, errno.EOPNOTSUPP, errno.ENOTSUP)
"""Errors of file systems that cannot sync directories, or cannot sync at all."""


def sync_directory(directory: Path) -> None:
    """Wait until the names of the files in a directory are on disk, where the system can."""
    if os.name == "nt":
        return
    with naming(directory):
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            sync(descriptor)
        finally:
            os.close(descriptor)


def to_json(value: Any) -> bytes:
    """Return a value as JSON. The same value, in the same order, gives the same bytes."""
    return (json.dumps(value, indent=2, allow_nan=False) + "\n").encode()


def write_arrays(path: Path, kind: str, header: Mapping[str, Any], arrays: Mapping[str, StoredArray]) -> None:
    """Write arrays and a header of JSON values to a file of some kind."""
    whole = {"kind": kind, "schema": SCHEMA, **header}
    whole["digest"] = digest_of_arrays(arrays, whole)
    contiguous = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    write(path, save(contiguous, metadata={_HEADER: json.dumps(whole, allow_nan=False)}))


def write_npz(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays as NumPy's compressed file, and the directories that it needs."""
    path.parent.mkdir(parents=True, exist_ok=True)
    data = io.BytesIO()
    np.savez_compressed(data, **arrays)  # type: ignore[arg-type]
    write(path, data.getvalue())


def read_arrays(path: Path, kind: str, *, finite: bool = True) -> tuple[dict[str, Any], dict[str, StoredArray]]:
    """Return the header and the arrays of a file of that kind.

    Floats must be finite if ``finite``; otherwise nan may stand for a value that could not be measured.

    Raises:
        FileNotFoundError: There is no such file.
        DamagedFileError: The file is damaged, or of another kind. The message is one line.
    """
    if not path.is_file():
        inside = f"; name a file in {path / 'champions'}" if (path / "champions").is_dir() else ""
        raise FileNotFoundError(f"{path} is not a file{inside}" if path.exists() else f"{path} is not there")
    try:
        with safe_open(path, framework="numpy") as file:
            header = json.loads((file.metadata() or {})[_HEADER], parse_constant=_refuse)
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118  # not a mapping
    except KeyError:
        raise DamagedFileError(f"{path} was not written by esp_trainer") from None
    except (SafetensorError, ValueError, TypeError, RecursionError) as error:
        raise DamagedFileError(f"{path} is damaged: {str(error).splitlines()[0]}") from None
    if not isinstance(header, dict) or header.pop("digest", None) != digest_of_arrays(arrays, header):
        raise DamagedFileError(f"{path} is damaged: its contents do not match their digest")
    if header["kind"] != kind:
        raise DamagedFileError(f"{path} must be a {kind}, but is a {header['kind']}")
    if header["schema"] != SCHEMA:
        raise DamagedFileError(f"{path} must have schema {SCHEMA}, but has {header['schema']}")
    for name, array in arrays.items():
        if finite and array.dtype.kind == "f" and not np.isfinite(array).all():
            raise DamagedFileError(f"{path} is damaged: {name} holds values that are not finite")
    return header, arrays


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def digest_of_arrays(arrays: Mapping[str, StoredArray], header: Mapping[str, Any] = MappingProxyType({})) -> str:
    """Return the SHA-256 of arrays with their names, types and shapes, and of a header of JSON values."""
    digest = hashlib.sha256(json.dumps(dict(header), sort_keys=True, allow_nan=False).encode())
    for name in sorted(arrays):
        array = np.asarray(arrays[name], order="C")
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON")
