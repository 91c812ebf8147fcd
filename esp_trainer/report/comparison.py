"""The page of a comparison: Matplotlib figures as SVG in one HTML file without scripts, which works offline.

Colours are variables of the page's style sheet, which has a light and a dark palette.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from esp_trainer.analysis import plots
from esp_trainer.analysis.comparison import HELD_OUT, SCRIPTED, Condition, measure_name
from esp_trainer.analysis.inference import summary
from esp_trainer.arrays import Curve, GenerationIndices
from esp_trainer.report.comparison_tables import Table
from esp_trainer.report.html import page
from esp_trainer.types import ROLES, Role
from predprey_env.settings import counted

_WINDOW = 15  # generations over which success is averaged, as on the page of a run
_INCHES = 4.0  # width at which text of 9 points is readable on a phone, where a figure is 300 pixels wide
_LEVEL = "Lines: mean over seeds, from three seeds on with its 95% interval. Dots: the last sixth of each seed."
_PANELS = {
    HELD_OUT: ("Level against held-out opponents", f"Opponents that none of these runs trained on. {_LEVEL}"),
    SCRIPTED: ("Level against scripts", f"All scripts of the other side. {_LEVEL}"),
}
_ABOUT_SUCCESS = (
    f"The opponent changes too, so this cannot show who became better. Lines: means over {_WINDOW} generations. Dots: "
    "the last third of each seed."
)
_ABOUT_SIGNAL = (
    "Fraction of the variance of neuron fitness that is not sampling noise, mean over the run. A few percent are usual."
)
_RESULTS: dict[Role, str] = {"predators": "fraction of prey caught", "prey": "fraction of prey not caught"}
_PAYOFF = "payoff"


@dataclass(frozen=True)
class _Measure:
    """A measure to show: a chart of its curves by generation, and a dot plot of its final value per seed."""

    title: str
    axis: str
    """Label of the axis of the measure's values."""
    curves: Callable[[Condition], tuple[GenerationIndices, list[Curve]]] | None
    """Function that returns the generations and one curve per run; None for a measure without curves."""
    measure: str
    """Name of the measure of the dot plot, see :func:`~esp_trainer.analysis.comparison.measures`."""
    beside: tuple[str, ...] = ()
    """Names of all measures whose dot plots share an axis with this one."""


def comparison_page(
    title: str, answer: str, conditions: Sequence[Condition], tables: Sequence[Table], notes: Sequence[str]
) -> str:
    """Return the page as HTML.

    Args:
        title: Title of the page.
        answer: Conclusion of the comparison, in a sentence.
        conditions: Conditions in the order of their colours.
        tables: Tables to show below the figures.
        notes: Notes for the reader.
    """
    n_runs = sum(len(condition.runs) for condition in conditions)
    return page(
        "comparison.html",
        "comparison.css",
        "img-src data:",
        title,
        answer=escape(answer),
        subtitle=f"{counted(len(conditions), 'condition')}, {counted(n_runs, 'run')}",
        legend="\n".join(f"<li>{_swatch(i)} {escape(each.name)}</li>" for i, each in enumerate(conditions)),
        notes="\n".join(f"<li>{escape(note)}</li>" for note in notes),
        sections="\n".join(_sections(conditions)),
        tables="\n".join(map(_table, tables)),
    )


def _told(*, captures: bool) -> list[tuple[str, str, list[_Measure]]]:
    """Return title, explanation and measures of each section."""
    axis, name = ("fraction of prey caught", "caught") if captures else (f"{_PAYOFF} to predators", "payoff")
    success = _Measure("Both sides", axis, _success, name)
    names = tuple(f"{role}_signal" for role in ROLES)
    signals = [
        _Measure(role.capitalize(), "fraction", None, name, names) for role, name in zip(ROLES, names, strict=True)
    ]
    return [
        *(
            (title, words, [_against(role, panel, captures=captures) for role in ROLES])
            for panel, (title, words) in _PANELS.items()
        ),
        ("Success, champion against champion", _ABOUT_SUCCESS, [success]),
        ("What selection sees", _ABOUT_SIGNAL, signals),
    ]


def _sections(conditions: Sequence[Condition]) -> list[str]:
    """Return the sections, with figures for each measure that has a value in any condition."""
    sections = []
    for title, words, measures in _told(captures=conditions[0].runs[0].captures):
        known = [each for each in measures if any(len(condition.known(each.measure)) for condition in conditions)]
        if known:
            figures = "\n".join(_figures(each, conditions, title) for each in known)
            head = f'<h2>{title}</h2>\n<p class="hint">{words}</p>'
            sections.append(f'<section>\n{head}\n<div class="charts">\n{figures}\n</div>\n</section>')
    return sections


def _against(role: Role, panel: str, *, captures: bool) -> _Measure:
    def curves(condition: Condition) -> tuple[GenerationIndices, list[Curve]]:
        name = f"{role}_{panel}"
        return condition.runs[0].generations, [run.curves[name] for run in condition.runs if name in run.curves]

    axis = _RESULTS[role] if captures else _PAYOFF
    both = tuple(measure_name(each, panel, "level") for each in ROLES)
    return _Measure(role.capitalize(), axis, curves, measure_name(role, panel, "level"), both)


def _success(condition: Condition) -> tuple[GenerationIndices, list[Curve]]:
    known = [run.payoff for run in condition.runs if not np.isnan(run.payoff).any()]
    return np.arange(len(condition.runs[0].payoff)), known


def _figures(measure: _Measure, conditions: Sequence[Condition], title: str) -> str:
    """Return the chart by generation and the dot plot of a measure."""
    said = "; ".join(f"{each.name} {summary(each.known(measure.measure))}" for each in conditions)
    drawn = []
    if measure.curves:
        figure, (axes,) = plots.panels(1, width=_INCHES, height=2.6)
        for number, condition in enumerate(conditions):
            x, curves = measure.curves(condition)
            if curves:
                window = _WINDOW if measure.measure in ("caught", "payoff") else 1
                plots.curve(axes, x, np.stack(curves), condition.name, number, window=window)
        axes.set(xlabel="generation", ylabel=measure.axis)
        if "fraction" in measure.axis:
            axes.set_ylim(0, 1)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        words = f"{title}: {measure.title}, {measure.axis} by generation. In the end: {said}"
        drawn.append(_svg(figure, f"{measure.measure}-curves", words))
    figure, (axes,) = plots.panels(1, width=_INCHES, height=0.6 + 0.42 * len(conditions))
    _dots(axes, measure, conditions)
    words = f"{title}: {measure.title}, {measure.axis} of each seed in the end: {said}"
    drawn.append(_svg(figure, f"{measure.measure}-dots", words))
    return f"<figure><figcaption>{measure.title}</figcaption>{''.join(drawn)}</figure>"


def _dots(axes: Axes, measure: _Measure, conditions: Sequence[Condition]) -> None:
    """Draw a row for each condition: its name, and below it a dot per seed and a bar at their mean."""
    for row, condition in enumerate(conditions):
        values, colour = condition.known(measure.measure), plots.COLOURS[row % len(plots.COLOURS)]
        axes.plot(values, np.full(len(values), row), "o", color=colour, alpha=0.75, markersize=5)
        if len(values):
            axes.plot([values.mean()] * 2, [row - 0.18, row + 0.18], color=colour, linewidth=2)
        name = textwrap.shorten(condition.name, 56, placeholder=" ...")
        axes.text(0, row - 0.24, name, transform=axes.get_yaxis_transform(), fontsize=8, va="bottom", parse_math=False)
    axes.set(xlabel=measure.axis, yticks=[], ylim=(len(conditions) - 0.6, -0.75))
    axes.spines["left"].set_visible(False)
    axes.margins(x=0.06)
    beside = [each.known(name) for each in conditions for name in measure.beside]
    axes.update_datalim([(value, 0) for values in beside for value in values])
    axes.autoscale_view(scaley=False)
    axes.locator_params(axis="x", nbins=5)


def _swatch(number: int) -> str:
    """Return a short piece of a condition's curve for the legend."""
    figure, (axes,) = plots.panels(1, width=0.5, height=0.2)
    axes.plot([0, 1], [0, 0], color=plots.COLOURS[number % len(plots.COLOURS)], linestyle=plots.dash_of(number), lw=2)
    axes.axis("off")
    return _svg(figure, f"swatch-{number}", "")


def _svg(figure: Figure, name: str, words: str) -> str:
    """Return a figure as SVG with ``words`` as its description for screen readers; hide it from them if it has none."""
    said = f'role="img" aria-label="{escape(words)}"' if words else 'aria-hidden="true"'
    svg = plots.as_svg(figure, name).replace("<svg", f"<svg {said}", 1)
    for number, colour in enumerate(plots.COLOURS):
        svg = svg.replace(colour, "currentColor" if colour == "#000000" else f"var(--c{number})")
    return svg


def _table(table: Table) -> str:
    """Return a table as HTML."""
    heads = "".join(f'<th scope="col">{escape(head)}</th>' for head in table.heads)
    rows = "".join(
        f'<tr><th scope="row">{escape(name)}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in cells)}</tr>\n'
        for name, *cells in table.rows
    )
    return (
        f'<h3>{escape(table.caption)}</h3>\n<div class="table"><table aria-label="{escape(table.caption)}">\n'
        f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>"
    )
