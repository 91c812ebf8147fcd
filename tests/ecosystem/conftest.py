"""What the tests of the ecosystem share. Each tool has an environment of its own: run `python scripts/ecosystem.py`."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from waiting import PATIENCE

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/tools.md"


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Read a tool's tests only where they are asked for (by marker or by name), as elsewhere the tool is not installed.

    A marker expression that only excludes them, such as `not ecosystem`, does not ask for them.
    """
    asked = re.search(r"(?<!not )\becosystem\b", config.option.markexpr)
    return None if asked else collection_path.name.startswith("test_") or None


def snippet_of(tool: str) -> str:
    """The Python text that docs/tools.md shows for a tool."""
    found: list[str] = re.findall(rf"<!-- tool: {tool} -->\s*```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    if len(found) != 1:
        raise ValueError(f"docs/tools.md must show one snippet under <!-- tool: {tool} -->, got {len(found)}")
    return found[0]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """An empty directory, in which the tests of a file work."""
    place = tmp_path_factory.mktemp("place")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        yield place


@pytest.fixture(scope="module")
def snippet(request: pytest.FixtureRequest) -> Iterator[dict[str, Any]]:
    """The names that the snippet for the tool of this test file in docs/tools.md leaves behind, once it has run.

    It runs as a module, as the classes of one can be pickled.
    """
    tool = request.path.stem.removeprefix("test_")
    module = ModuleType(f"snippet_of_{tool}")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, module.__name__, module)
        exec(compile(snippet_of(tool), f"docs/tools.md, {tool}", "exec"), vars(module))
        yield vars(module)


@pytest.fixture
def caught_by_example(request: pytest.FixtureRequest, tmp_path: Path) -> list[float]:
    """Fractions of prey that the example of the tool of this test file prints in its quick form, in order."""
    tool = request.path.stem.split("_")[1]
    (example,) = (ROOT / "examples").glob(f"*{tool}*.py")
    command = [sys.executable, str(example), "--quick"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    return [float(each) for each in re.findall(r"CPU-seconds: (\d\.\d\d) of the prey caught", done.stdout)]
