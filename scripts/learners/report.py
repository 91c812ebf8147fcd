"""``docs/benchmark.md``: what the matrix says. Every number in it is made here."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from esp_trainer.analysis import plots
from esp_trainer.analysis.inference import Comparison, compare
from learners.contestants import TASK
from learners.matrix import Matrix
from predprey_env.policies import SCRIPTS

_RESAMPLES = 2000
_WHO = """## Who is compared, and what it cost

| name | what it is | seeds | CPU seconds a run | agents' steps a run |
| --- | --- | --- | --- | --- |
"""
_COST = """

PPO apart is two runs, one for each side; a run of evolution, and of self-play, makes both sides. PPO's policies share one network
between the agents of a team, of the kind that evolution has, but wider (64 hidden neurons and a bias for each agent), and draw their
actions; evolved teams take the action with the most votes.

![Prey caught while PPO learns](benchmark/curves.png)

Share of prey caught in training, against the opponents that it trains with: the zoo, or the other side as it is and was."""
_STRENGTH = """## How strong each is

Prey caught by predators, and not caught for prey: against the zoo's held-out teams, which nobody trained against; against scripts; and
against everyone who learns and is not of the same name.

| name | predators: held-out prey | scripted prey | all who learn | prey: held-out predators | scripted predators | all who learn |
| --- | --- | --- | --- | --- | --- | --- |
"""
EQUAL = (
    ("ppo, early", "paper"),
    ("ppo, early", "modern"),
    ("ppo, early", "drawn"),
    ("ppo", "paper, longer"),
    ("ppo", "modern, longer"),
    ("ppo, self-play", "paper, longer"),
    ("ppo, self-play", "modern, longer"),
)
"""Kinds that are compared: PPO, and evolution with no more compute."""
APART = ("ppo", "ppo, early", "ppo, terminal")
"""Those that are two runs, one for each side."""
_EQUAL = """## At equal compute

PPO less evolution in the scores of the table above, where evolution had no more CPU seconds for a team of each side: Hodges & Lehmann's
difference between seeds, with the 95% interval of the rank test. Five seeds a side cannot pass a correction for so many tests, so none is
reported. *Head to head*: the share of the other's prey that PPO's predators catch, less the share of PPO's prey that the other's catch.

| compared | CPU seconds | predators: held-out prey | prey: held-out predators | predators: scripted prey | prey: scripted predators | head to head |
| --- | --- | --- | --- | --- | --- | --- |
"""
_SCRIPTS = (*SCRIPTS["predators"], *SCRIPTS["prey"])


def write(matrix: Matrix, out: Path) -> Path:
    """Write the page, its figure and the figure's data."""
    place = out / "benchmark"
    place.mkdir(parents=True, exist_ok=True)
    rows, columns = _kinds(matrix.predators), _kinds(matrix.prey)
    cells = {(p, q): interval(matrix.caught[np.ix_(rows[p], columns[q])]) for p in rows for q in columns}
    _draw(cells, list(rows), list(columns), place)
    page = out / "benchmark.md"
    page.write_text(
        "\n\n".join(
            [
                _head(matrix),
                _who(matrix),
                _strength(matrix),
                _equal(matrix),
                _matrix(cells, list(rows), list(columns)),
                _METHOD,
            ]
        )
        + "\n"
    )
    return page


def interval(shares: np.ndarray) -> tuple[float, float, float]:
    """The mean over all pairs of seeds, with a 95% interval over both sides' seeds by the pigeonhole bootstrap, which
    draws rows and columns anew at once (Owen, The pigeonhole bootstrap, Annals of Applied Statistics 1, 2007).
    """
    generator, (n, m) = np.random.default_rng(0), shares.shape
    rows, columns = generator.integers(n, size=(_RESAMPLES, n)), generator.integers(m, size=(_RESAMPLES, m))
    means = shares[rows[:, :, None], columns[:, None, :]].mean(axis=(1, 2))
    low, high = np.quantile(means, [0.025, 0.975])
    return float(shares.mean()), float(low), float(high)


def _kinds(names: np.ndarray) -> dict[str, np.ndarray]:
    return {str(name): np.flatnonzero(names == name) for name in dict.fromkeys(names.tolist())}


def _put(known: tuple[float, float, float]) -> str:
    return "{:.2f} [{:.2f}, {:.2f}]".format(*known)


def _head(matrix: Matrix) -> str:
    command = " ".join(
        ["python", "scripts/compare_learners.py", *(word for word in sys.argv[1:] if word != "--report")]
    )
    return f"""# PPO, evolution and scripts against each other

Made by `{command}`: three predators against two prey (task `{TASK}`), every team against every other,
{matrix.n_episodes} episodes a pair from the same starts, which hold the parities in their true proportions. Each kind of team that
learns has several seeds; intervals are over the seeds of both sides (pigeonhole bootstrap)."""


def _who(matrix: Matrix) -> str:
    rows = []
    for name, meaning in matrix.meanings.tolist():
        spent = np.concatenate(
            [matrix.predators_spent[matrix.predators == name], matrix.prey_spent[matrix.prey == name]]
        )
        n_seeds = max((matrix.predators == name).sum(), (matrix.prey == name).sum())
        cost = "- | -" if np.isnan(spent).all() else f"{spent[:, 0].mean():.1f} | {spent[:, 1].mean() / 1e6:,.0f} M"
        rows.append(f"| `{name}` | {meaning} | {n_seeds} | {cost} |")
    return _WHO + "\n".join(rows) + _COST


def _strength(matrix: Matrix) -> str:
    lines = []
    for name, _ in matrix.meanings.tolist():
        cells = []
        for mine, theirs, caught, held_out in (
            (matrix.predators, matrix.prey, matrix.caught, matrix.predators_held_out),
            (matrix.prey, matrix.predators, 1 - matrix.caught.T, 1 - matrix.prey_held_out.T),
        ):
            rows = np.flatnonzero(mine == name)
            if not len(rows):
                cells += ["-"] * 3
                continue
            scripted = np.isin(theirs, _SCRIPTS)
            for table in (held_out[rows], caught[rows][:, scripted], caught[rows][:, ~scripted & (theirs != name)]):
                cells.append(_put(interval(table)))
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    return _STRENGTH + "\n".join(lines)


def _equal(matrix: Matrix) -> str:
    """PPO less evolution, where evolution had no more compute."""
    rows: list[str] = []
    tests: list[Comparison] = []
    for one, other in EQUAL:
        if not all((matrix.predators == name).any() for name in (one, other)):
            continue
        pairs = zip(_scores(matrix, one), _scores(matrix, other), strict=True)
        found = [compare(a, b) for a, b in pairs]
        tests += found
        differences = " | ".join(f"{test.difference:+.2f} [{test.low:+.2f}, {test.high:+.2f}]" for test in found)
        cost = f"{_cost(matrix, one):.0f} and {_cost(matrix, other):.0f}"
        head = "{:+.2f} [{:+.2f}, {:+.2f}]".format(*_head_to_head(matrix, one, other))
        rows.append(f"| `{one}` less `{other}` | {cost} | {differences} | {head} |")
    behind, ahead = sum(test.high < 0 for test in tests), sum(test.low > 0 for test in tests)
    verdict = f"Of these {len(tests)} differences {behind} are wholly below 0, where evolution is ahead, and {ahead} wholly above."
    return _EQUAL + "\n".join([*rows, "", verdict])


def _scores(matrix: Matrix, name: str) -> list[np.ndarray]:
    """What each seed's predators and prey score against held-out teams, and then against scripts."""
    hunts, flees = matrix.predators == name, matrix.prey == name
    scripted = np.isin(matrix.prey, _SCRIPTS), np.isin(matrix.predators, _SCRIPTS)
    return [
        matrix.predators_held_out[hunts].mean(axis=1),
        1 - matrix.prey_held_out[:, flees].mean(axis=0),
        matrix.caught[hunts][:, scripted[0]].mean(axis=1),
        1 - matrix.caught[scripted[1]][:, flees].mean(axis=0),
    ]


def _cost(matrix: Matrix, name: str) -> float:
    """CPU seconds for a team of each side."""
    sides = [
        spent[names == name, 0].mean()
        for names, spent in ((matrix.predators, matrix.predators_spent), (matrix.prey, matrix.prey_spent))
    ]
    return float(sum(sides) if name in APART else sides[0])


def _head_to_head(matrix: Matrix, one: str, other: str) -> tuple[float, float, float]:
    """Prey that one's predators catch of the other's, less prey that the other's catch of one's; over runs of both."""
    ours = matrix.caught[np.ix_(matrix.predators == one, matrix.prey == other)]
    theirs = matrix.caught[np.ix_(matrix.predators == other, matrix.prey == one)]
    return interval(ours - theirs.T)


def _matrix(cells: dict[tuple[str, str], tuple[float, float, float]], rows: list[str], columns: list[str]) -> str:
    lines = [
        "## Who catches whom",
        "",
        "![Share of prey caught](benchmark/matrix.png)",
        "",
        "Share of prey caught; rows are predators.",
        "",
    ]
    lines += [f"| | {' | '.join(columns)} |", f"| --- |{' --- |' * len(columns)}"]
    lines += [f"| **{p}** | {' | '.join(_put(cells[p, q]) for q in columns)} |" for p in rows]
    return "\n".join(lines)


_METHOD = """## How it was done

- **PPO**: [`scripts/train_ppo.py`](../scripts/train_ppo.py), its defaults; apart it meets all teams of the zoo that are not held out,
  eight worlds each. What counts is the last checkpoint, not the best.
- **Evolution**: the last champion of the run, chosen by the re-evaluation of each generation, not by anything on this page.
- **CPU seconds** are of one core, without compiling; **steps** count every agent's, for evolution as if all episodes went to the time limit.
- **Matches** are played in the compiled evaluator; what is random in a team that draws follows from the start."""


def _draw(
    cells: dict[tuple[str, str], tuple[float, float, float]], rows: list[str], columns: list[str], place: Path
) -> None:
    means = np.array([[cells[p, q][0] for q in columns] for p in rows])
    figure, (axes,) = plots.panels(1, width=2.2 + 0.55 * len(columns), height=1.6 + 0.4 * len(rows), columns=1)
    image = axes.pcolormesh(means, vmin=0, vmax=1, cmap="viridis", rasterized=True)
    for (y, x), mean in np.ndenumerate(means):
        axes.text(
            x + 0.5,
            y + 0.5,
            f"{mean:.2f}",
            ha="center",
            va="center",
            fontsize=7,
            color="white" if mean < 0.6 else "black",
        )
    axes.set(yticks=np.arange(len(rows)) + 0.5, xticks=np.arange(len(columns)) + 0.5, xlabel="prey", ylabel="predators")
    axes.set_yticklabels(rows)
    axes.set_xticklabels(columns, rotation=40, ha="right")
    axes.invert_yaxis()
    figure.colorbar(image, ax=axes, label="share of prey caught", shrink=0.8)
    table = [(p, q, *known) for (p, q), known in cells.items()]
    plots.save(
        figure,
        place / "matrix.png",
        dict(zip(("predators", "prey", "caught", "low", "high"), zip(*table, strict=True), strict=True)),
    )
