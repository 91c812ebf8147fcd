"""Reference pages of the site, made while MkDocs builds it from docstrings, the parser, the configs and the presets."""

from __future__ import annotations

import argparse
import inspect
import re
from collections.abc import Iterable, Iterator
from typing import Any

import griffe
from mkdocs.structure.files import File, Files
from pydantic import BaseModel

from esp_trainer.cli.parser import make_parser
from esp_trainer.config import RunConfig
from esp_trainer.presets import PRESETS
from predprey_env import TASKS, predprey_v0
from predprey_env.settings import table_row

PUBLIC = (
    *("predprey_env", "predprey_env.policies", "predprey_env.jit", "predprey_env.rendering", "predprey_env.sb3"),
    *("esp_trainer", "esp_trainer.algorithms", "esp_trainer.networks"),
)
ABOUT_COMMANDS = """\
The commands of `esp-trainer` and their options; `esp-trainer COMMAND --help` prints the same.
[Train teams](../training.md), [Analyse runs](../analysis.md) and
[Measure a policy](../measure.md) show them at work."""
ABOUT_FIELDS = """\
The fields of `RunConfig`. Any of them is an option of `esp-trainer train`, as in `--esp.n_trials 500`, and a line of
`[fields]` in a sweep's file. The fields of `env` are also arguments of every form of the environment."""
ABOUT_PRESETS = """\
`esp-trainer train NAME` starts a run of a preset, or of the recommended preset of a task; `esp-trainer presets NAME`
prints all its fields. `task="NAME"` makes any form of the environment."""
DOCUMENT, LINKED = re.compile(r"docs/([\w-]+\.md)"), r"[docs/\1](../\1)"
ROLE = re.compile(r":\w+:`~?(?:[\w.]*\.(?=\w+`))?(\w+)`|(::)(?=\n\n|$)")


def on_files(files: Files, config: Any) -> Files:
    """Add the reference."""
    for name, parts in _pages():
        files.append(File.generated(config, f"reference/{name}.md", content="\n\n".join(parts)))
    return files


def _pages() -> Iterator[tuple[str, Iterable[str]]]:
    """Yield each page's name and its parts."""
    specification = _plain(inspect.cleandoc(predprey_v0.__doc__ or ""))
    yield (
        "predprey_v0",
        [re.sub("^###", "##", specification, flags=re.MULTILINE)],
    )  # PettingZoo's docstrings skip a level
    for module in PUBLIC:
        yield module, [f"# {module}", f"::: {module}"]
    yield "command-line", ["# Command line", ABOUT_COMMANDS, *_commands(make_parser())]
    yield "config", ["# Config fields", ABOUT_FIELDS, *_fields(RunConfig, "")]
    presets = [
        f"| `{name}` | {DOCUMENT.sub(LINKED, about)} | {config.generations:,} |"
        for name, (about, config) in PRESETS.items()
    ]
    tasks = [f"| `{name}` | {task.about} | {task.world.changes} |" for name, task in TASKS.items()]
    tables = _table("preset", "what it is", "generations:", rows=presets), _table("task", "for", "world", rows=tasks)
    yield "presets", ["# Presets and tasks", ABOUT_PRESETS, *tables]


def _commands(parser: argparse.ArgumentParser) -> Iterator[str]:
    """Yield a section for each command, with its options."""
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    for name, command in commands.choices.items():
        actions = sorted(command._actions, key=lambda action: (bool(action.option_strings), not action.required))
        options = {_written(action): action for action in actions if action.dest != "help"}
        needed = [text for text, action in options.items() if action.required]
        yield f"## {name}\n\n{command.description[:1].upper()}{command.description[1:]}."
        yield f"```bash\n{' '.join([command.prog, *needed])} ...\n```"
        rows = (f"| `{text}` | {' '.join((action.help or '').split())} |" for text, action in options.items())
        yield _table("option", "what it does", rows=rows)
        if command.epilog:
            fields = command.epilog.startswith("Any field")
            yield (
                "Any [field of the config](config.md) is an option too."
                if fields
                else f"```text\n{command.epilog}\n```"
            )


def _written(action: argparse.Action) -> str:
    """Return an option or argument as one writes it."""
    value = action.metavar or "|".join(map(str, action.choices or [action.dest]))
    return " ".join([*action.option_strings[-1:], *([] if action.nargs == 0 else [str(value)])])


def _fields(model: type[BaseModel], prefix: str) -> Iterator[str]:
    """Yield a table of the fields of a config, then a section for each of its parts."""
    parts = {name: type(field.default) for name, field in model.model_fields.items()}
    parts = {name: kind for name, kind in parts.items() if issubclass(kind, BaseModel)}
    rows = (table_row(prefix + name, field) for name, field in model.model_fields.items() if name not in parts)
    yield _table("field", "meaning", rows=rows)
    for name, part in parts.items():
        yield f"## {name}\n\n{model.model_fields[name].description}"
        yield from _fields(part, f"{name}.")


def _table(*names: str, rows: Iterable[str]) -> str:
    """Return a table. A column whose name ends in a colon is aligned to the right."""
    lines = "".join("| ---: " if name.endswith(":") else "| --- " for name in names)
    return "\n".join([f"| {' | '.join(name.rstrip(':') for name in names)} |", f"{lines}|", *rows])


def _plain(docstring: str) -> str:
    """Return a docstring without the marks of reStructuredText that Markdown lacks: roles, and ``::`` before code."""
    return ROLE.sub(lambda found: ":" if found[2] else f"`{found[1]}`", docstring)


class Roles(griffe.Extension):
    """Docstrings as Markdown, and nothing that tells a reader nothing: private values, long ones, special methods."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of an object that was just read."""
        if obj.docstring:
            obj.docstring.value = _plain(obj.docstring.value)
        if isinstance(obj, griffe.Attribute) and re.match("_|.{1000}", str(obj.value), re.DOTALL):
            obj.value = None

    def on_class_members(self, *, cls: griffe.Class, **_: Any) -> None:
        """Leave out special methods, and attributes that have neither a docstring nor a type."""
        for name, member in list(cls.members.items()):
            special = name.startswith("__") and name != "__init__"
            kept = isinstance(member, griffe.Attribute) and not member.docstring and not member.annotation
            if special or kept:
                cls.del_member(name)

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Rewrite the docstring of a package."""
        self.on_object(obj=pkg)
