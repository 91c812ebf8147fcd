"""Any field of a config as an option on the command line: ``--esp.n_trials 200``."""

from __future__ import annotations

import json
from typing import Any

from pydantic import BaseModel

from esp_trainer.config import RunConfig
from predprey_env.settings import field_names, unknown_field

_OWN = ("--out", "--threads", "--quiet")


def override(config: RunConfig, options: list[str]) -> RunConfig:
    """The config with the fields that the options name, validated."""
    fields = config.model_dump()
    known = field_names(RunConfig)
    pending = list(options)
    while pending:
        option = pending.pop(0)
        if not option.startswith("--"):
            raise ValueError(f"expected an option like --seed 3, got {option!r}")
        name, given, value = option[2:].replace("-", "_").partition("=")
        if given:
            value = option.partition("=")[2]
        if name not in known:
            hint = unknown_field(name, [*known, *(own[2:] for own in _OWN)])
            raise ValueError(hint.replace("unknown field ", "unknown option --").replace("mean ", "mean --"))
        if not given:
            if not pending:
                raise ValueError(f"--{name} needs a value")
            value = pending.pop(0)
        *path, leaf = name.split(".")
        section = fields
        for part in path:
            section = section[part]
        section[leaf] = _value(value)
    return RunConfig.from_dict(fields)


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def describe(config: RunConfig) -> str:
    """Every field with its value and what it means, as options."""
    return "\n".join(_describe(config, ""))


def _describe(section: BaseModel, prefix: str) -> list[str]:
    lines = []
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            lines += ["", f"{prefix}{name}: {field.description}", *_describe(value, f"{prefix}{name}.")]
        else:
            meaning = " ".join((field.description or "").split())
            lines.append(f"  --{prefix}{name} {value!r}\n      {meaning}".replace("'", ""))
    return lines
