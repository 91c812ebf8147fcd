"""Pages of the site that are made while MkDocs builds it: files from outside ``docs``, and the notebook.

Links are written as they lead in the repository. Those to files that the site has elsewhere are turned here, and each
source file that a page links to becomes a page of the site.
"""

from __future__ import annotations

import ast
import json
import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
PAGES = {
    "README.md": "index.md",
    "docs/README.md": "pages.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "examples/README.md": "examples.md",
}
"""File of the repository -> page of the site that shows it."""
PLACES = PAGES | {
    "examples": "examples.md",
    "docs/notebook.ipynb": "notebook.md",
    "predprey_env/predprey_v0.py": "reference/predprey_v0.md",
    "esp_trainer/cli/parser.py": "reference/command-line.md",
    "esp_trainer/config.py": "reference/config.md",
    "esp_trainer/presets.py": "reference/presets.md",
}
"""File of the repository -> page of the site that a link to it leads to."""
SHOWN = {page: file for file, page in PAGES.items()}
PRE = re.compile(r"(<pre.*?</pre>)", re.DOTALL)
INTERVAL = re.compile(r"(?<=\d) (?=\[[+-]?[\d.]+, )|(?<=\d,) (?=[+-]?[\d.]+\])|(?<=\], p) (?=[\d<])")
"""Spaces of a figure with its interval and p."""
LINK = re.compile(r"^ *```.*?^ *```|`[^`\n]*`|(?P<open>\]\(|src=\")(?P<to>[^)\s\"#]+)", re.MULTILINE | re.DOTALL)


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made here, and a page for each source file that a page links to."""
    files.remove(files.src_uris["README.md"])
    made = {page: (ROOT / file).read_text() for file, page in PAGES.items()}
    made["notebook.md"] = _notebook(ROOT / "docs/notebook.ipynb")
    texts = made | {file.src_uri: file.content_string for file in files.documentation_pages()}
    for page, text in texts.items():
        for link in LINK.finditer(text):
            if place := _place(page, link["to"]):
                file, uri = place
                if uri.startswith("source/") and uri not in made:
                    made[uri] = _source(ROOT / file)
    for page, text in made.items():
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links into those between pages of the site. The home page has no navigation beside it."""
    if page.is_homepage:
        page.meta["hide"] = ["navigation"]

    def turned(link: re.Match[str]) -> str:
        place = _place(page.file.src_uri, link["to"])
        if place is None:
            return link[0]
        return link["open"] + posixpath.relpath(place[1], posixpath.dirname(page.file.src_uri) or ".")

    return LINK.sub(turned, markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Keep a figure, its interval and its p on one line, as in ``0.54 [0.49, 0.59], p 0.02``."""
    parts = PRE.split(html)
    parts[::2] = [INTERVAL.sub("\N{NO-BREAK SPACE}", part) for part in parts[::2]]
    return "".join(parts)


def _place(page: str, link: str | None) -> tuple[str, str] | None:
    """Return the file of the repository that a link of a page leads to, and its place in the site.

    None for code, addresses, and links of pages that no file of the repository stands for.
    """
    shown = SHOWN.get(page, f"docs/{page}")
    if link is None or "://" in link or not (ROOT / shown).is_file():
        return None
    file = posixpath.normpath(posixpath.join(posixpath.dirname(shown), link))
    if not (ROOT / file).exists():  # MkDocs tells where the link is
        return None
    inside = file.startswith("docs/") and (ROOT / file).is_file()
    return file, PLACES.get(file, file.removeprefix("docs/") if inside else f"source/{file}.md")


def _source(path: Path) -> str:
    """Return the page of a source file, or of a folder: its modules with their first lines."""
    head = f"---\nsearch: {{exclude: true}}\n---\n# {path.relative_to(ROOT)}\n\n"
    if path.is_file():
        return f"{head}````{path.suffix[1:] or 'text'}\n{path.read_text()}\n````\n"
    rows = []
    for entry in sorted(path.iterdir()):
        module = entry / "__init__.py" if entry.is_dir() else entry
        if entry.name[0] not in "_.":
            about = (
                ast.get_docstring(ast.parse(module.read_text())) if module.suffix == ".py" and module.exists() else ""
            )
            rows.append(f"| `{entry.name}` | {' '.join((about or '').partition(chr(10) * 2)[0].split())} |\n")
    return f"{head}| file | what it is |\n| --- | --- |\n{''.join(rows)}"


def _notebook(path: Path) -> str:
    """Return a notebook as a page: its text, its code, and what that printed and drew."""
    parts = []
    for cell in json.loads(path.read_text())["cells"]:
        text = "".join(cell["source"])
        parts.append(f"```python\n{text}\n```" if cell["cell_type"] == "code" else text)
        for output in cell.get("outputs", []):
            data = output.get("data", {"text/plain": output.get("text", [])})
            if "image/png" in data:
                about = cell["metadata"]["alt"]
                parts.append(f"![{about}](data:image/png;base64,{''.join(data['image/png']).strip()})")
            else:
                parts.append(f"```text\n{''.join(data['text/plain'])}\n```")
    return "\n\n".join([*parts, f'<a href="{path.name}" download>Download this notebook</a>'])
