"""Try the environment with the tools of the ecosystem, each in a virtual environment of its own.

    python scripts/ecosystem.py            # all tools
    python scripts/ecosystem.py sb3 rllib  # some
    python scripts/ecosystem.py --list

A tool is a file in tests/ecosystem/requirements with pinned versions, as tools ask for versions that conflict. Its
environment is made in .ecosystem, once for the same requirements. On Linux, PyPI's PyTorch brings gigabytes of CUDA;
with PIP_EXTRA_INDEX_URL=https://download.pytorch.org/whl/cpu pip takes the small one.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
import tomllib
import venv
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
TESTS = ROOT / "tests" / "ecosystem"
PLACE = ROOT / ".ecosystem"

VERSIONS = (
    "import importlib.metadata, sys; print(*(f'{n} {importlib.metadata.version(n)}' for n in sys.argv[1:]), sep=', ')"
)


class Row(NamedTuple):
    """What became of a tool."""

    tool: str
    versions: str
    passed: int
    failed: int
    making: float
    testing: float


def requirements(tool: str) -> Path:
    """The file that names the versions of a tool and of what decides."""
    return TESTS / "requirements" / f"{tool}.txt"


def tools() -> list[str]:
    """All tools that have requirements."""
    return sorted(file.stem for file in requirements("*").parent.glob("*.txt"))


def packages(tool: str) -> list[str]:
    """The names in a tool's requirements."""
    return re.findall(r"^([A-Za-z0-9][\w.-]*)", requirements(tool).read_text(), re.MULTILINE)


def run(tool: str, *arguments: str | Path, stdout: int | None = None) -> subprocess.CompletedProcess[str]:
    """Run the Python of a tool's virtual environment."""
    python = PLACE / tool / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    one_thread = os.environ | {"OMP_NUM_THREADS": "1"}  # for networks this small, PyTorch's threads only wait
    return subprocess.run([python, *arguments], cwd=ROOT, env=one_thread, stdout=stdout, text=True, check=False)


def make(tool: str) -> None:
    """Make a tool's virtual environment, unless it was made from the same requirements by the same Python."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    own = project["dependencies"] + project["optional-dependencies"]["test"]
    wanted = "\n".join([sys.version, *own, requirements(tool).read_text()])
    made_from = PLACE / tool / "made-from.txt"  # written last, so a broken environment is made again
    if made_from.exists() and made_from.read_text() == wanted:
        return
    print(f"making {made_from.parent.relative_to(ROOT)} ...", file=sys.stderr, flush=True)
    venv.create(PLACE / tool, with_pip=True, clear=True)
    # In one command, so that pip finds versions that suit the project and the tool.
    wants = ["--editable", f"{ROOT}[test]", "--requirement", str(requirements(tool))]
    run(tool, "-m", "pip", "install", "--quiet", *wants).check_returncode()
    made_from.write_text(wanted)


def test(tool: str) -> tuple[int, int]:
    """Run a tool's tests; how many passed, and how many did not: a skipped test shows nothing."""
    report = PLACE / tool / "report.xml"
    report.unlink(missing_ok=True)
    files = sorted(TESTS.glob(f"test_{tool}*.py"))
    done = run(tool, "-m", "pytest", "-m", "ecosystem", "-n", "0", *files, "--junit-xml", report)
    if not report.exists():
        return 0, 1
    suite = ElementTree.parse(report).getroot().find("testsuite")
    assert suite is not None
    count = {name: int(suite.attrib[name]) for name in ("tests", "failures", "errors", "skipped")}
    failed = count["failures"] + count["errors"] + count["skipped"]
    return count["tests"] - failed, failed or int(done.returncode != 0)


def versions(tool: str) -> str:
    """What is installed, as the environment itself says."""
    return run(tool, "-c", VERSIONS, *packages(tool), stdout=subprocess.PIPE).stdout.strip()


def try_out(tool: str) -> Row:
    """Make a tool's virtual environment and run its tests in it."""
    start = time.perf_counter()
    try:
        make(tool)
    except subprocess.CalledProcessError:
        return Row(tool, "could not be installed", 0, 1, time.perf_counter() - start, 0.0)
    made = time.perf_counter()
    passed, failed = test(tool)
    return Row(tool, versions(tool), passed, failed, made - start, time.perf_counter() - made)


def main() -> int:
    """Try the tools, and print the table."""
    parser = argparse.ArgumentParser(description="Try the environment with the tools of the ecosystem.")
    parser.add_argument("tools", nargs="*", metavar="TOOL", help="tools to try (default: all)")
    parser.add_argument("--list", action="store_true", help="only name the tools")
    options = parser.parse_args()
    if options.list:
        print(*tools(), sep="\n")
        return 0
    unknown = sorted(set(options.tools) - set(tools()))
    if unknown:
        parser.error(f"tools must be among {', '.join(tools())}, got {', '.join(unknown)}")

    rows = [try_out(tool) for tool in options.tools or tools()]
    print("\n| tool | versions | passed | failed | making, s | tests, s |")
    print("| --- | --- | --- | --- | --- | --- |")
    for row in rows:
        figures = f"{row.passed} | {row.failed} | {row.making:.0f} | {row.testing:.0f}"
        print(f"| {row.tool} | {row.versions} | {figures} |")
    return int(any(row.failed for row in rows))


if __name__ == "__main__":
    sys.exit(main())
