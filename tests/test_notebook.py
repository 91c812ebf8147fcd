"""The notebook: small, described, and it runs on a fresh machine."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

FILE = Path(__file__).parents[1] / "docs/notebook.ipynb"


def printed(notebook: Any) -> list[str]:
    outputs = [output for cell in notebook["cells"] for output in cell.get("outputs", [])]
    return ["".join(output["text"]) for output in outputs if output["output_type"] == "stream"]


def pictures(notebook: Any) -> int:
    return sum(
        "image/png" in output.get("data", {}) for cell in notebook["cells"] for output in cell.get("outputs", [])
    )


def test_the_notebook_is_small_and_its_pictures_are_described() -> None:
    assert FILE.stat().st_size < 150_000
    notebook = json.loads(FILE.read_text())
    assert pictures(notebook) == 4
    assert all(cell["metadata"].get("alt") for cell in notebook["cells"] if pictures({"cells": [cell]}))


@pytest.mark.slow
def test_the_notebook_runs_and_prints_what_it_shows(tmp_path: Path) -> None:
    nbclient = pytest.importorskip("nbclient", reason='needs pip install -e ".[docs]"')
    import nbformat

    notebook = nbformat.read(FILE, as_version=4)
    shown = printed(notebook)
    nbclient.NotebookClient(notebook, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert printed(notebook) == shown
    assert pictures(notebook) == 4
    assert [len(re.findall(r"\d\.\d\d|\d+%", text)) for text in shown] == [0, 3]
