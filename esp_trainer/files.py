"""Arrays and JSON on disk: written whole or not at all, and refused when damaged. Nothing is ever unpickled.

Arrays go into safetensors with one JSON header that names its kind and schema and carries a digest of all it describes.
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

SCHEMA = 1
_HEADER = "esp_trainer"


class DamagedFileError(ValueError):
    """A file that is truncated, altered, foreign or of another schema."""


def write(path: Path, data: bytes) -> None:
    """Put a file in place whole: written beside it, synced, renamed. It keeps its mode, where the system can.

    A symbolic link stays, and the file that it points to is written. Some things are written to instead of replaced:
    what is no file (a pipe, say), where standard output goes, and a file whose directory takes no other.
    """
    with naming(path):
        for descriptor in (1, 2):  # --csv /dev/stdout > file, say, keeps what else is printed
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
"""Errors of a directory that takes no other file, of a file that is mounted by itself, and of a long name."""


def _replace(place: Path, data: bytes) -> None:
    beside = place.with_name(f".{place.name}.part")
    try:
        with beside.open("wb") as file:
            if place.exists():
                place.open("ab").close()  # a file that may not be written stays
                with suppress(OSError):  # some file systems know no modes, or give them themselves
                    shutil.copymode(place, beside)
            file.write(data)
            file.flush()
            sync(file.fileno())
        beside.replace(place)
    except BaseException:  # Ctrl-C too
        beside.unlink(missing_ok=True)
        raise


def _target(path: Path) -> Path:
    """The path behind symbolic links. There need not be a file yet."""
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    return target


def _is_open_as(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except OSError:
        return False


def write_text(path: Path, text: str) -> None:
    """Put a text in place whole, in UTF-8; bytes of a path that are no text are written as escapes."""
    write(path, text.encode(errors="backslashreplace"))


def write_table(path: Path, rows: Iterable[Iterable[object]]) -> None:
    """Put a CSV file in place whole."""
    text = io.StringIO(newline="")
    csv.writer(text).writerows(rows)
    write_text(path, text.getvalue())


def check_place(path: Path) -> None:
    """Raise now, before the work whose outcome it is to hold, what a :func:`write` there would raise in any case."""
    with naming(path):
        if path.is_fifo() or path.is_char_device():  # a pipe that is opened and closed has ended for who reads it
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
    """Let an error of the operating system name the file that the user knows."""
    try:
        yield
    except OSError as error:
        raise type(error)(error.errno, error.strerror, str(path)) from None


def in_words(error: OSError) -> str:
    """An error of the operating system in one line: the file, and what is wrong with it."""
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
"""Errors of file systems that sync no directories, or nothing at all."""


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
    """JSON that is the same for equal values."""
    return (json.dumps(value, indent=2, allow_nan=False) + "\n").encode()


def write_arrays(path: Path, kind: str, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays with a header of JSON values."""
    whole = {"kind": kind, "schema": SCHEMA, **header}
    whole["digest"] = digest_of_arrays(arrays, whole)
    contiguous = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    write(path, save(contiguous, metadata={_HEADER: json.dumps(whole, allow_nan=False)}))


def read_arrays(path: Path, kind: str, *, finite: bool = True) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The header and the arrays of a file of that kind, or :class:`DamagedFileError` in one line.

    Numbers must be ``finite``, unless nan stands for what could not be measured.
    """
    if not path.is_file():
        raise FileNotFoundError(f"{path} is not there" if not path.exists() else f"{path} is not a file")
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
    """SHA-256 of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def digest_of_arrays(arrays: Mapping[str, np.ndarray], header: Mapping[str, Any] = MappingProxyType({})) -> str:
    """SHA-256 of arrays with their names, types and shapes, and of a header of JSON values."""
    digest = hashlib.sha256(json.dumps(dict(header), sort_keys=True, allow_nan=False).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON")
