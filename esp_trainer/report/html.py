"""Parts that all pages have in common: where their files are, their head, and the version that wrote them."""

from __future__ import annotations

from html import escape
from importlib.metadata import version
from importlib.resources import files
from string import Template


def asset(name: str) -> str:
    """Return the text of a part of a page."""
    return (files(__package__) / "assets" / name).read_text("utf-8")


def page(template: str, style: str, policy: str, title: str, **values: str) -> str:
    """Return a page that needs no other file.

    Args:
        template: Name of the asset that is filled in.
        style: Name of the asset that is its style sheet.
        policy: What its Content Security Policy allows beside the style sheet; everything else is forbidden.
        title: Title.
        values: Other values to fill in.
    """
    head = Template(asset("head.html")).substitute(title=escape(title), policy=policy, style=asset(style))
    written_by = escape(f"predprey-esp {version('predprey-esp')}")
    return Template(asset(template)).substitute(values, head=head, title=escape(title), version=written_by)
