"""Any field of a config as an option on the command line: ``--esp.n_trials 200``."""

from __future__ import annotations

import difflib
import json
from contextlib import suppress
from typing import Any

from pydantic import BaseModel

from esp_trainer.config import RunConfig
from predprey_env.settings import field_names

FIELDS = [name for name in [*field_names(RunConfig), "esp.pairing"] if name not in ("preset", "league")]
"""What can be set. The preset is said by the first argument, and the league follows from the runs of ``--league``."""

_OWN = ["out", "threads", "address", "quiet", "tensorboard", "league"]


def split(arguments: list[str]) -> tuple[list[str], list[str]]:
    """The options that set fields, each with its value, apart from everything else."""
    fields, others, pending = [], [], list(arguments)
    while pending:
        argument = pending.pop(0)
        name, given, _ = argument.partition("=")
        if name.startswith("--") and name[2:].replace("-", "_") in FIELDS:
            fields += [argument] if given or not pending else [argument, pending.pop(0)]
        else:
            others.append(argument)
    return fields, others


def read_options(options: list[str]) -> dict[str, Any]:
    """Field -> value; :class:`ValueError` for an option that sets none."""
    values, pending = {}, list(options)
    while pending:
        option = pending.pop(0)
        if not option.startswith("--"):
            raise ValueError(f"expected an option like --seed 3, got {option!r}")
        name, given, value = option[2:].partition("=")
        name = name.replace("-", "_")
        if name not in FIELDS:
            raise ValueError(f"unknown option --{name}{_hint(name)}")
        if not given:
            if not pending:
                raise ValueError(f"--{name} needs a value")
            value = pending.pop(0)
        values[name] = _value(value)
    return values


def override(config: RunConfig, options: list[str]) -> RunConfig:
    """The config with the fields that the options name, validated."""
    return config.with_fields(read_options(options))


def _hint(name: str) -> str:
    known = [*FIELDS, *_OWN]
    leaves = {field.rpartition(".")[2]: field for field in reversed(known)}
    near = difflib.get_close_matches(name, known, n=1) or difflib.get_close_matches(name, leaves, n=1)
    begun = [field for field in known if field.startswith(name)]
    found = [leaves.get(field, field) for field in (near or begun)]
    return f"; did you mean --{found[0]}?" if found else ""


def _value(text: str) -> Any:
    """A value as JSON has it, or a number as Python reads it (``.5``, ``+3``, ``1_000``), or a word."""
    for read in (json.loads, int, float):
        with suppress(ValueError, RecursionError):
            return read(text)
    return {"true": True, "false": False}.get(text.lower(), text)


def describe(config: RunConfig) -> str:
    """Every field with its value, as one types them, and what it means."""
    return "\n".join(_describe(config, ""))


def _describe(section: BaseModel, prefix: str) -> list[str]:
    lines = []
    for name, field in type(section).model_fields.items():
        value, meaning = getattr(section, name), " ".join((field.description or "").split())
        if isinstance(value, BaseModel):
            lines += ["", f"{prefix}{name}: {meaning}", *_describe(value, f"{prefix}{name}.")]
        elif prefix + name in FIELDS:
            shown = value if isinstance(value, str) else json.dumps(value)
            lines += [f"  --{prefix}{name} {shown}", f"      {meaning}"]
    return lines
