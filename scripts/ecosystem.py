"""Try the environment with the tools of the ecosystem, each in a virtual environment of its own.

    python scripts/ecosystem.py            # all tools
    python scripts/ecosystem.py sb3 rllib  # some
    python scripts/ecosystem.py --quick sb3  # without its slow tests, as CI does
    python scripts/ecosystem.py --list

A tool is a file in tests/ecosystem/requirements with pinned versions, as tools ask for versions that conflict. Its
environment is made in .ecosystem, once for the same requirements. On Linux, PyPI's PyTorch brings gigabytes of CUDA;
with PIP_EXTRA_INDEX_URL=https://download.pytorch.org/whl/cpu pip takes the small one.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
import tomllib
import venv
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
TESTS = ROOT / "tests" / "ecosystem"
PLACE = ROOT / ".ecosystem"
TOOLS = {file.stem: file for file in sorted((TESTS / "requirements").glob("*.txt"))}


def run(tool: str, *arguments: str | Path) -> int:
    """Run the Python of a tool's virtual environment; return its exit code."""
    python = PLACE / tool / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    one_thread = os.environ | {"OMP_NUM_THREADS": "1"}  # for networks this small, PyTorch's threads only wait
    return subprocess.run([python, *arguments], cwd=ROOT, env=one_thread, check=False).returncode


def make(tool: str) -> bool:
    """Make a tool's virtual environment, unless it was made from the same requirements by the same Python."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    own = project["dependencies"] + project["optional-dependencies"]["test"]
    wanted = "\n".join([sys.version, *own, TOOLS[tool].read_text()])
    made_from = PLACE / tool / "made-from.txt"  # written last, so a broken environment is made again
    if made_from.exists() and made_from.read_text() == wanted:
        return True
    print(f"making {made_from.parent.relative_to(ROOT)} ...", file=sys.stderr, flush=True)
    venv.create(PLACE / tool, with_pip=True, clear=True)
    # In one command, so that pip finds versions that suit the project and the tool. What is imported compiles itself.
    install = ("pip", "install", "--quiet", "--no-compile", "--editable", f"{ROOT}[test]", "--requirement", TOOLS[tool])
    if run(tool, "-m", *install):
        return False
    made_from.write_text(wanted)
    return True


def test(tool: str, *, quick: bool) -> tuple[int, int]:
    """Run a tool's tests; return how many passed, and how many did not: a skipped test shows nothing."""
    report = PLACE / tool / "report.xml"
    report.unlink(missing_ok=True)
    files = sorted(TESTS.glob(f"test_{tool}*.py"))
    # Quick tests run in a process for each core; some of the others start clusters of their own.
    chosen = ["-m", "ecosystem and not slow"] if quick else ["-m", "ecosystem", "-n", "0"]
    code = run(tool, "-m", "pytest", *chosen, *files, "--junit-xml", report)
    suite = ElementTree.parse(report).getroot().find("testsuite") if report.exists() else None
    if suite is None:
        return 0, 1
    failed = sum(int(suite.attrib[name]) for name in ("failures", "errors", "skipped"))
    return int(suite.attrib["tests"]) - failed, failed or int(code != 0)


def main() -> int:
    """Try the tools, and print a table."""
    parser = argparse.ArgumentParser(description="Try the environment with the tools of the ecosystem.")
    parser.add_argument("tools", nargs="*", metavar="TOOL", help="tools to try (default: all)")
    parser.add_argument("--quick", action="store_true", help="leave out slow tests")
    parser.add_argument("--list", action="store_true", help="only name the tools")
    options = parser.parse_args()
    if options.list:
        print(*TOOLS, sep="\n")
        return 0
    if unknown := sorted(set(options.tools) - set(TOOLS)):
        parser.error(f"tools must be among {', '.join(TOOLS)}, got {', '.join(unknown)}")
    rows = []
    for tool in options.tools or TOOLS:
        start = time.perf_counter()
        passed, failed = test(tool, quick=options.quick) if make(tool) else (0, 1)
        rows.append((tool, passed, failed, f"{time.perf_counter() - start:.0f} s"))
    print("\n| tool | passed | failed | time |\n| --- | ---: | ---: | ---: |")
    for row in rows:
        print(f"| {' | '.join(map(str, row))} |")
    return int(any(failed for _, _, failed, _ in rows))


if __name__ == "__main__":
    sys.exit(main())
