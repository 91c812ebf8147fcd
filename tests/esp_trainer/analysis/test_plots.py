"""What figures draw, and the data that lies beside them."""

from __future__ import annotations

import csv
import errno
import os
import re
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.collections import QuadMesh

from esp_trainer.analysis.plots import (
    COLOURS,
    PREDATORS,
    PREY,
    as_svg,
    curve,
    dash_of,
    legend,
    panels,
    payoff_matrix,
    save,
    smooth,
    trajectories,
)


def read(path: Path) -> list[list[str]]:
    with path.open(newline="") as file:
        return list(csv.reader(file))


@pytest.mark.parametrize(("n", "rows", "columns"), [(1, 1, 1), (2, 1, 2), (3, 1, 3), (4, 2, 3), (7, 3, 3)])
def test_there_are_as_many_panels_as_asked_for_in_rows_of_three(n: int, rows: int, columns: int):
    figure, axes = panels(n, width=2, height=1)
    assert len(axes) == len(figure.axes) == n
    assert figure.get_size_inches().tolist() == [2 * columns, rows]


# What is saved.


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_a_figure_is_saved_with_its_numbers(suffix: str, tmp_path: Path):
    figure, _ = panels(1)
    path = tmp_path / "new" / f"figure{suffix}"
    columns = {"generation": np.arange(3), "caught": np.array([0.1, 1 / 3, 2e-7]), "what": ["a", 'b, "c"', "ä"]}
    save(figure, path, columns)
    assert path.read_bytes().startswith(b"\x89PNG" if suffix == ".png" else b"<?xml")
    assert sorted(file.name for file in path.parent.iterdir()) == ["figure.csv", f"figure{suffix}"]
    header, *rows = read(path.with_suffix(".csv"))
    assert header == ["generation", "caught", "what"]
    assert rows == [["0", "0.1", "a"], ["1", "0.333333", 'b, "c"'], ["2", "2e-07", "ä"]]


def test_a_figure_that_does_not_fit_on_the_disk_leaves_the_older_one(tmp_path: Path, monkeypatch: Any):
    def no_space(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    figure, _ = panels(1)
    save(figure, tmp_path / "figure.png", {"x": [1]})
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(OSError, match=r"No space left on device: '.*figure\.png'"):
        save(panels(2)[0], tmp_path / "figure.png", {"x": [2]})
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_the_same_figure_is_the_same_file(tmp_path: Path):
    for name in ("a", "b"):
        for suffix in (".png",):
            figure, (axes,) = panels(1)
            drawn = curve(axes, np.arange(4), np.eye(4), "runs")
            save(figure, tmp_path / f"{name}{suffix}", drawn)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_the_picture_shows_what_was_drawn(tmp_path: Path):
    for name, level in (("low", 0.1), ("high", 0.9)):
        figure, (axes,) = panels(1)
        curve(axes, np.arange(4), np.full((1, 4), level), "runs", colour="#ff0000")
        axes.set_ylim(0, 1)
        save(figure, tmp_path / f"{name}.png", {})
    heights = []
    for name in ("low", "high"):
        picture = matplotlib.image.imread(tmp_path / f"{name}.png")
        red = (picture[..., 0] > 0.9) & (picture[..., 1] < 0.1)
        heights.append(np.flatnonzero(red.any(axis=1)).mean() / len(picture))
    assert heights[0] > 0.7
    assert heights[1] < 0.3


def test_columns_of_different_lengths_are_refused(tmp_path: Path):
    figure, _ = panels(1)
    with pytest.raises(ValueError, match="shorter"):
        save(figure, tmp_path / "figure.png", {"a": [1, 2], "b": [1]})


# Running means.


@pytest.mark.parametrize(
    ("window", "expected"),
    [
        (1, [0, 3, 6, 0, 9]),
        (3, [1.5, 3, 3, 5, 4.5]),
        (5, [3, 2.25, 3.6, 4.5, 5]),
        (6, [3, 2.25, 3.6, 4.5, 5]),  # as wide as the data
        (100, [3, 2.25, 3.6, 4.5, 5]),
    ],
)
def test_a_running_mean_is_over_as_many_values_as_there_are(window: int, expected: list[float]):
    assert smooth(np.array([0.0, 3, 6, 0, 9]), window) == pytest.approx(expected)


def test_each_row_is_smoothed_by_itself():
    both = smooth(np.array([[0.0, 3, 6], [1, 1, 4]]), 3)
    np.testing.assert_allclose(both, [[1.5, 3, 4.5], [1, 2, 2.5]])


@given(arrays(np.float64, st.integers(1, 30), elements=st.floats(-1, 1)), st.integers(1, 40))
def test_a_running_mean_keeps_length_and_bounds(values: np.ndarray, window: int):
    found = smooth(values, window)
    assert found.shape == values.shape
    assert (found >= values.min() - 1e-9).all()
    assert (found <= values.max() + 1e-9).all()


# Curves.


def test_a_curve_is_the_mean_with_students_interval():
    _, (axes,) = panels(1)
    x, runs = np.array([0, 10]), np.array([[1.0, 4], [2, 4], [3, 4]])
    drawn = curve(axes, x, runs, "caught")
    # Two degrees of freedom: t = 4.3027; the standard deviation is 1, over the root of three runs.
    half = 4.302652729911275 / 3**0.5
    assert list(drawn) == ["caught", "caught, low", "caught, high"]
    assert drawn["caught"] == pytest.approx([2, 4])
    assert drawn["caught, low"] == pytest.approx([2 - half, 4])
    assert drawn["caught, high"] == pytest.approx([2 + half, 4])
    (line,) = axes.lines
    np.testing.assert_allclose(line.get_xydata(), [[0, 2], [10, 4]])
    (band,) = axes.collections
    corners = {tuple(corner) for corner in band.get_paths()[0].vertices.round(6)}
    assert {(0, round(2 - half, 6)), (0, round(2 + half, 6)), (10, 4)} <= corners


def test_the_interval_is_of_the_smoothed_runs():
    _, (axes,) = panels(1)
    drawn = curve(axes, np.arange(3), np.array([[0.0, 3, 6], [6, 3, 0], [3, 3, 3]]), "caught", window=3)
    # Smoothed, the runs are 1.5, 3, 4.5 and 4.5, 3, 1.5 and 3, 3, 3.
    assert drawn["caught"] == pytest.approx([3, 3, 3])
    half = 4.302652729911275 * 1.5 / 3**0.5  # two degrees of freedom; the standard deviation is 1.5 at the ends
    assert drawn["caught, high"] - 3 == pytest.approx([half, 0, half])


@pytest.mark.parametrize("runs", [[[0.0, 3, 6]], [[0.0, 4, 6], [0, 2, 6]]])
def test_fewer_than_three_runs_have_no_interval(runs: list[list[float]]):
    _, (axes,) = panels(1)
    drawn = curve(axes, np.arange(3), np.array(runs), "caught")
    assert list(drawn) == ["caught"]
    assert drawn["caught"].tolist() == [0, 3, 6]
    assert not axes.collections


def test_curves_differ_in_colour_and_dash():
    _, (axes,) = panels(1)
    for number in range(len(COLOURS)):
        curve(axes, np.arange(2), np.zeros((1, 2)), f"{number}", number)
    assert len({line.get_color() for line in axes.lines}) == len(COLOURS)
    assert len({str(line._dash_pattern) for line in axes.lines}) == len(COLOURS)
    legend(axes)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [str(n) for n in range(len(COLOURS))]


# Matrices.


def test_a_matrix_has_predators_upwards_and_prey_to_the_right():
    figure, (axes,) = panels(1)
    predators, prey = np.array([0, 5, 9]), np.array([0, 7])
    caught = np.array([[0.0, 0.1], [0.2, 0.3], [0.4, 0.5]])
    data = payoff_matrix(figure, axes, predators, prey, caught, top=0.8)
    assert data["predators"].tolist() == [0, 0, 5, 5, 9, 9]
    assert data["prey"].tolist() == [0, 7, 0, 7, 0, 7]
    assert data["caught"].tolist() == [0, 0.1, 0.2, 0.3, 0.4, 0.5]
    (mesh,) = (each for each in axes.collections if isinstance(each, QuadMesh))
    np.testing.assert_array_equal(mesh.get_array().reshape(3, 2), caught)
    x, y = np.moveaxis(mesh.get_coordinates(), -1, 0)
    assert (x[0, 0], x[0, -1]) == (-3.5, 10.5)  # cells are centred on their generations
    assert (y[0, 0], y[-1, 0]) == (-2.5, 11)
    assert mesh.get_clim() == (0, 0.8)
    assert axes.get_xlabel() == "prey of generation"
    assert axes.get_ylabel() == "predators of generation"


# Paths on the torus.


def drawn_paths(cells: np.ndarray, n_predators: int, size: int) -> list[np.ndarray]:
    """The lines of all agents, without the marks at their ends."""
    _, (axes,) = panels(1)
    trajectories(axes, cells, n_predators, size)
    return [np.asarray(line.get_xydata()) for line in axes.lines[::3]]


def test_a_path_that_goes_round_is_broken_at_the_seam():
    cells = np.array([[8, 3], [9, 3], [0, 3], [1, 3], [1, 2]])[:, None]
    (path,) = drawn_paths(cells, 1, 10)
    np.testing.assert_array_equal(path, [[8, 3], [9, 3], [np.nan] * 2, [0, 3], [1, 3], [1, 2]])


def test_a_path_can_go_round_twice():
    cells = np.array([[0, 0], [9, 0], [9, 9], [0, 9]])[:, None]
    (path,) = drawn_paths(cells, 1, 10)
    assert np.isnan(path).all(axis=1).tolist() == [False, True, False, True, False, True, False]


@given(st.integers(3, 20), st.lists(st.lists(st.integers(0, 4), min_size=3, max_size=3), min_size=1, max_size=60))
def test_no_line_is_drawn_across_the_world(size: int, actions: list[list[int]]):
    moves = np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [0, 0]])[np.array(actions)]
    cells = np.cumsum(np.concatenate([np.full((1, 3, 2), size // 2), moves]), axis=0) % size
    for agent, path in enumerate(drawn_paths(cells, 2, size)):
        lengths = np.abs(np.diff(path, axis=0)).max(axis=1)
        assert (lengths[~np.isnan(lengths)] <= size / 2).all()
        np.testing.assert_array_equal(path[~np.isnan(path).any(axis=1)], cells[:, agent])


def test_predators_and_prey_can_be_told_apart():
    cells = np.arange(30).reshape(5, 3, 2) % 7
    figure, (axes,) = panels(1)
    data = trajectories(axes, cells, 2, 100)
    assert [line.get_color() for line in axes.lines[::3]] == [PREDATORS, PREDATORS, PREY]
    assert [line.get_marker() for line in axes.lines[2::3]] == ["^", "^", "s"]
    for agent in range(3):
        path, begins, ends = axes.lines[3 * agent : 3 * agent + 3]
        assert begins.get_xydata().tolist() == [cells[0, agent].tolist()]
        assert ends.get_xydata().tolist() == [cells[-1, agent].tolist()]
        assert path.get_linestyle() == ("-", "--", "-")[agent]
    assert list(data) == ["step", "agent", "x", "y"]
    rows = [tuple(int(value) for value in row) for row in zip(*data.values(), strict=True)]
    assert rows == [(step, agent, *cells[step, agent]) for step in range(5) for agent in range(3)]
    assert len(figure.axes) == 1


def test_no_two_curves_have_the_same_colour_and_dash():
    styles = {(COLOURS[number % len(COLOURS)], str(dash_of(number))) for number in range(49)}
    assert len(styles) == 49
    assert [dash_of(number) for number in range(3)] == ["-", "--", "-."]


def test_figures_stand_in_a_page_with_ids_of_their_own_and_text_that_is_text():
    drawn = []
    for name in ("a", "b"):
        figure, (axes,) = panels(1)
        curve(axes, np.arange(5), np.random.default_rng(0).random((3, 5)), "x")
        axes.set_title("the title")
        drawn.append(as_svg(figure, name))
    ids = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in drawn]
    assert all(each.startswith("a-") for each in ids[0])
    assert not ids[0] & ids[1]
    for svg, known in zip(drawn, ids, strict=True):
        assert svg.startswith("<svg ")
        assert svg.rstrip().endswith("</svg>")
        assert "the title</text>" in svg
        assert set(re.findall(r"url\(#([^)]+)\)", svg)) | set(re.findall(r'href="#([^"]+)"', svg)) <= known
    assert drawn[0].replace("a-", "b-") == drawn[1].replace("a-", "b-")
