"""Validated, immutable settings whose errors fit on one line."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from inspect import Parameter, signature
from typing import Any, Literal, Self, TypeVar, get_args, get_origin

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic.fields import FieldInfo

Maker = TypeVar("Maker", bound=Callable[..., Any])

_BOUNDS = {
    "greater_than_equal": ("at least", "ge"),
    "greater_than": ("greater than", "gt"),
    "less_than_equal": ("at most", "le"),
    "less_than": ("less than", "lt"),
}

_LONGEST = 100  # characters of a value in an error message


class PartError(ValueError):
    """Raised if a user's class that the settings name cannot be imported or used."""


class Settings(BaseModel):
    """Base of every configuration: frozen, no unknown fields, no silent conversion.

    A NumPy scalar counts as the Python value that it holds. Raises :class:`ValueError` with one line that states what
    was expected and what was received.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, use_attribute_docstrings=True)

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise _kind(error)(one_line(error, type(self))) from None

    @model_validator(mode="before")
    @classmethod
    def _without_numpy(cls, fields: object) -> object:
        return {name: plain(value) for name, value in fields.items()} if isinstance(fields, dict) else fields

    @classmethod
    def from_dict(cls, fields: object) -> Self:
        """Make settings from nested plain dictionaries, as JSON holds them."""
        if not isinstance(fields, dict):
            raise ValueError(f"{cls.__name__} must be a mapping of fields, got {fields!r}")
        return cls(**fields)

    def replace(self, **fields: Any) -> Self:
        """Return a validated copy with some fields changed.

        A section given as a mapping changes only the fields in the mapping.
        """
        whole = {name: getattr(self, name) for name in type(self).model_fields}
        for name, value in fields.items():
            section, whole[name] = whole.get(name), value
            if isinstance(value, dict) and isinstance(section, Settings):
                whole[name] = {**section.model_dump(), **value}
        return type(self)(**whole)


def plain(value: object) -> Any:
    """Return the Python value of a NumPy scalar or of a zero-dimensional array; return any other value unchanged."""
    return value.item() if isinstance(value, np.generic | np.ndarray) and value.ndim == 0 else value


def whole_number(name: str, value: object, least: int) -> int:
    """Return a value as a Python integer; it may be a NumPy integer.

    Raises :class:`ValueError` for any other type and for a number below ``least``.
    """
    number = plain(value)
    if isinstance(number, bool) or not isinstance(number, int) or number < least:
        raise ValueError(f"{name} must be an integer of at least {least}, got {brief(number)}")
    return number


def whole_numbers(name: str, values: object, shape: tuple[int, ...]) -> np.ndarray:
    """Return values as an array of integers of their own integer type.

    Raises :class:`ValueError` for values of another shape, and for anything but integers.
    """
    try:
        numbers = np.asarray(values)
    except ValueError:
        raise ValueError(f"{name} must be integers of shape {shape}, got rows of unequal length") from None
    if numbers.shape != shape or not np.issubdtype(numbers.dtype, np.integer):
        raise ValueError(f"{name} must be integers of shape {shape}, got {numbers.dtype} of shape {numbers.shape}")
    return numbers


def _kind(error: ValidationError) -> type[ValueError]:
    """Return :class:`PartError` if the first error is one, else :class:`ValueError`."""
    cause = error.errors(include_url=False)[0].get("ctx", {}).get("error")
    return PartError if isinstance(cause, PartError) else ValueError


def one_line(error: ValidationError, settings: type[BaseModel]) -> str:
    """Return the first error of a validation, in one line."""
    fault = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in fault["loc"])
    kind, got, context = fault["type"], fault["input"], fault.get("ctx", {})
    if kind == "extra_forbidden":
        return unknown_field(field, field_names(settings))
    if kind == "missing":
        return f"{field} is missing"
    if kind in _BOUNDS:
        words, bound = _BOUNDS[kind]
        return f"{field} must be {words} {context[bound]}, got {got!r}"
    if kind == "literal_error":
        return f"{field} must be {context['expected']}, got {got!r}"
    if kind == "value_error":
        return _within(field, str(context["error"]), settings)
    expected = fault["msg"].removeprefix("Input should be ").replace("a valid integer", "an integer")
    return f"{field} must be {expected.replace('a valid ', 'a ')}, got {got!r}"


def _within(section: str, line: str, settings: type[BaseModel]) -> str:
    """Return the error line of a nested section with the section's name in it."""
    if not section:
        return line
    if line.startswith("unknown field "):
        return line.replace("field ", f"field {section}.", 1).replace("mean ", f"mean {section}.", 1)
    dotted = f"{section}.{line}"
    return dotted if dotted.split()[0] in field_names(settings) else f"{section}: {line}"


def unknown_field(field: str, known: list[str]) -> str:
    """Return the error line for a field that does not exist, with the nearest name that does."""
    if field in known:  # a dotted name, given where only the name of the section is allowed
        return f"{field} is a field of {field.rpartition('.')[0]}; set it by with_fields({{{field!r}: ...}})"
    near = difflib.get_close_matches(field, known, n=1) or difflib.get_close_matches(
        field.rpartition(".")[2], known, n=1, cutoff=0.5
    )
    return f"unknown field {field}" + (f"; did you mean {near[0]}?" if near else "")


def flat(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the leaves of a tree of settings, by dotted name."""
    found: dict[str, Any] = {}
    for name, value in tree.items():
        found |= flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {f"{prefix}{name}": value}
    return found


def field_names(settings: type[BaseModel], prefix: str = "") -> list[str]:
    """Return the dotted names of all fields, including those of nested sections."""
    names = []
    for name, field in settings.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            names += field_names(kind, f"{prefix}{name}.")
        else:
            names.append(prefix + name)
    return names


def table_row(name: str, field: FieldInfo) -> str:
    """Return the row of a field in a Markdown table: its name and its meaning, with allowed values and default."""
    meaning = " ".join([*(field.description or "").split(), *_values(field).split()])
    return f"| `{name}` | {meaning} Default: `{_literal(field.default)}`. |"


def _literal(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def _values(field: FieldInfo) -> str:
    """Return a sentence on the values that a field allows; empty for a field without choices or bounds."""
    if get_origin(field.annotation) is Literal:
        return f"One of {', '.join(f'`{_literal(choice)}`' for choice in get_args(field.annotation))}."
    limits = {bound: getattr(m, bound) for m in field.metadata for _, bound in _BOUNDS.values() if hasattr(m, bound)}
    bounds = [f"{words} {limits[bound]}" for words, bound in _BOUNDS.values() if bound in limits]
    if {"ge", "le"} <= limits.keys():
        bounds = [f"from {limits['ge']} to {limits['le']}"]
    sentence = ", ".join(bounds)
    return f"{sentence[:1].upper()}{sentence[1:]}." if bounds else ""


def spell_out(settings: type[BaseModel]) -> Callable[[Maker], Maker]:
    """Return a decorator for functions that take the fields of settings as ``**keywords``.

    ``help()`` and :func:`inspect.signature` then name the fields one by one, with types and defaults.
    """
    fields = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=field.default, annotation=field.annotation)
        for name, field in settings.model_fields.items()
    ]

    def decorate(make: Maker) -> Maker:
        whole = signature(make)
        named = [each for each in whole.parameters.values() if each.kind is not Parameter.VAR_KEYWORD]
        before = [each for each in named if each.kind is not Parameter.KEYWORD_ONLY]
        parameters = [*before, *fields, *(each for each in named if each not in before)]
        make.__signature__ = whole.replace(parameters=parameters)  # type: ignore[attr-defined]
        return make

    return decorate


def brief(value: object) -> str:
    """Return a value's ``repr`` for an error message: on one line and at most about 100 characters long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def error_line(error: BaseException) -> str:
    """Return the type and the message of an error, on one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())


def counted(n: int, noun: str) -> str:
    """Return a number and its noun for a message: ``1 run``, ``2 runs``, ``2 prey``."""
    return f"{n} {noun}{'' if n == 1 or noun == 'prey' else 's'}"
