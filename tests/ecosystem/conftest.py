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

README = Path(__file__).parents[2] / "README.md"


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Read a tool's tests only where they are asked for (by marker or by name), as elsewhere the tool is not installed.

    A marker expression that only excludes them, such as `not ecosystem`, does not ask for them.
    """
    asked = re.search(r"(?<!not )\becosystem\b", config.option.markexpr)
    return None if asked else collection_path.name.startswith("test_") or None


def snippet_of(tool: str) -> str:
    """The Python text that README.md shows for a tool."""
    found: list[str] = re.findall(rf"<!-- tool: {tool} -->\s*```python\n(.*?)```", README.read_text(), re.DOTALL)
    if len(found) != 1:
        raise ValueError(f"README.md must show one snippet under <!-- tool: {tool} -->, got {len(found)}")
    return found[0]


@pytest.fixture(scope="module")
def snippet(request: pytest.FixtureRequest) -> Iterator[dict[str, Any]]:
    """The names that README.md's snippet for the tool of this test file leaves behind; it has been run as it stands.

    It runs as a module, as the classes of one can be pickled.
    """
    tool = request.path.stem.removeprefix("test_")
    module = ModuleType(f"snippet_of_{tool}")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, module.__name__, module)
        exec(compile(snippet_of(tool), f"README.md, {tool}", "exec"), vars(module))
        yield vars(module)


@pytest.fixture
def caught_by_example(request: pytest.FixtureRequest, tmp_path: Path) -> list[float]:
    """Fractions of prey that the example of the tool of this test file prints in its quick form, in order."""
    tool = request.path.stem.split("_")[1]
    command = [sys.executable, str(README.parent / "examples" / f"train_{tool}.py"), "--quick"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr
    return [float(each) for each in re.findall(r"CPU-seconds: (\d\.\d\d) of the prey caught", done.stdout)]
