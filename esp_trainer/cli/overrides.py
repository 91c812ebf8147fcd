"""Command-line options that set fields of a config, for example ``--esp.n_trials 200``."""

from __future__ import annotations

import difflib
import json
from contextlib import suppress
from typing import Any

from pydantic import BaseModel

from esp_trainer.config import RunConfig
from predprey_env.settings import field_names

FIELDS = [name for name in [*field_names(RunConfig), "esp.pairing"] if name not in ("preset", "league")]
"""Fields that can be set. The preset is the first argument, and the league results from the runs of ``--league``."""

_OWN = ["out", "threads", "address", "quiet", "tensorboard", "league"]


def split(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Split arguments into the options that set fields, each with its value, and all others."""
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
    """Return the value of each field that the options set; raise :class:`ValueError` for an option that sets none."""
    values, pending = {}, list(options)
    while pending:
        option = pending.pop(0)
        if not option.startswith("--"):
            raise ValueError(f"expected an option like --seed 3, got {option!r}")
        typed, given, value = option[2:].partition("=")
        name = typed.replace("-", "_")
        if name not in FIELDS:
            raise ValueError(f"unknown option --{typed}{_hint(name)}")
        if not given:
            if not pending:
                raise ValueError(f"--{name} needs a value")
            value = pending.pop(0)
        values[name] = _value(value)
    return values


def override(config: RunConfig, options: list[str]) -> RunConfig:
    """Return the config with the fields that the options set, validated."""
    return config.with_fields(read_options(options))


def _hint(name: str) -> str:
    known = [*FIELDS, *_OWN]
    leaves = {field.rpartition(".")[2]: field for field in reversed(known)}
    near = difflib.get_close_matches(name, known, n=1) or difflib.get_close_matches(name, leaves, n=1)
    begun = [field for field in known if field.startswith(name)]
    found = [leaves.get(field, field) for field in (near or begun)]
    return f"; did you mean --{found[0]}?" if found else ""


def _value(text: str) -> Any:
    """Parse a value as JSON, else as a Python number (``.5``, ``+3``, ``1_000``), else return it as text."""
    for read in (json.loads, int, float):
        with suppress(ValueError, RecursionError):
            return read(text)
    return {"true": True, "false": False}.get(text.lower(), text)


def describe_fields(config: RunConfig) -> str:
    """Return the description of all fields: each option with its value, as typed, and its meaning."""
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
