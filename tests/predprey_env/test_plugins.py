"""Parts of a user's own that cannot be found: the error says what to write."""

from __future__ import annotations

from pathlib import Path

import pytest

from predprey_env.plugins import find_object
from predprey_env.settings import PartError


@pytest.mark.parametrize(
    ("place", "hint"),
    [
        ("own_part.py:Split", "; write own_part:Split, without .py"),
        ("own_part:Splt", "; did you mean Split?"),
        ("own_part:Other", ""),
    ],
)
def test_the_error_says_what_to_write(place: str, hint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own_part.py").write_text("class Split: ...\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(PartError) as refused:
        find_object("algorithm", place)
    line = str(refused.value)
    assert line.startswith(f"algorithm {place} cannot be imported: ")
    assert line.endswith(hint)
    assert ("did you mean" in line) == ("did you mean" in hint)
