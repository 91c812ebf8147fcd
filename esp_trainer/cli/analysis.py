"""``analyse``: measures of an arms race for runs, on the terminal and as figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from esp_trainer.analysis import games, phases, plots, progress
from esp_trainer.analysis.cross_play import CrossPlay, Played, kept_in, met_by_others, own_cross_play
from esp_trainer.analysis.exploiters import exploiters_of
from esp_trainer.analysis.games import Sides
from esp_trainer.analysis.genealogy import of_run
from esp_trainer.analysis.history import History
from esp_trainer.analysis.progress import Progress
from esp_trainer.arrays import PayoffMatrix
from esp_trainer.cli.runs import read_runs
from esp_trainer.cli.streams import say
from esp_trainer.evaluation.registry import make_evaluator
from esp_trainer.files import check_place
from esp_trainer.types import Role
from predprey_env.settings import counted


def analyse(runs: list[Path], generations: int, episodes: int, figures: Path | None) -> int:
    """Print the progress of both sides against the opponents of their run and, with several runs, of the other runs."""
    histories = read_runs(runs)
    sampled = len(histories[0].sample(generations))
    if sampled < 3:
        raise ValueError(f"progress takes at least 3 generations, got {sampled}")
    evaluator = make_evaluator(histories[0].config)
    names = [run.resolve().name for run in runs]
    if len(set(names)) < len(runs):
        names = [f"{name}-{i}" for i, name in enumerate(names)]
    if figures:
        figures.mkdir(parents=True, exist_ok=True)
        check_place(figures / f"{names[0]}-ciao.png")
    for i, (run, history) in enumerate(zip(runs, histories, strict=True)):
        say(f"playing {run} ...")
        cache = kept_in(run)
        own = own_cross_play(history, evaluator, n_generations=generations, n_episodes=episodes, cache=cache)
        others = [other for j, other in enumerate(histories) if j != i]
        _tell(
            run,
            history,
            own,
            {role: met_by_others(history, others, role, own, evaluator) for role in history.champions},
        )
        _tell_exploiters(run, history)
        _tell_genealogy(run, history)
        if figures:
            _draw(figures, names[i], history, own)
    if len(runs) == 1:
        print("give runs of other seeds too, to measure progress against opponents that none of these runs trained on")
    return 0


def _tell(run: Path, history: History, own: Played, met: dict[Role, list[PayoffMatrix]]) -> None:
    config, payoff, total = history.config, own.payoff, own.total
    captures = isinstance(own, CrossPlay)
    print(f"{run}: {config.preset}, seed {config.seed}, {counted(len(history), 'generation')}")
    if len(history.champions) == 1:  # against a script
        rates = payoff.ravel()
        some = rates[np.unique(np.linspace(0, len(rates) - 1, 8).round().astype(int))]
        what = "prey caught" if captures else "payoff to the predators"
        print(f"  {what}, from early to late   {' '.join(f'{share:z.2f}' for share in some)}")
        return
    corners, both = progress.early_late(payoff, total), progress.historical_progress(payoff, total)
    what = "fraction of prey caught" if captures else "payoff to the predators"
    print(f"  {payoff.shape[0]} x {payoff.shape[1]} generations, {counted(own.n_episodes, 'episode')} each; {what}:")
    print(f"    {'':18}early prey   late prey")
    print(f"    early predators   {corners.early_hunt_early:z10.2f}  {corners.early_hunt_late:z10.2f}")
    print(f"    late predators    {corners.late_hunt_early:z10.2f}  {corners.late_hunt_late:z10.2f}")
    print(f"  progress against the run's own opponents   {_progress(both)}")
    if len(met) == 2 and met["predators"]:
        against = progress.global_progress(met["predators"], met["prey"], total)
        print(f"  progress against those of the other runs   {_progress(against)}")
    dominant = [int(own.predators[g]) for g in progress.dominant_generations(payoff, own.noise)]
    number = "generations" if len(dominant) > 1 else "generation"
    print(f"  dominance tournament   {len(dominant)} dominant: {number} {', '.join(map(str, dominant))}")
    print(f"  who beats whom         {_ranking(own)}")
    game = games.solve_matrix(payoff)
    exploit = games.exploitability_of_generations(payoff)
    print(
        f"  as a game              value {game.value:z.2f}; optimal play mixes generations: "
        f"{game.support.predators} of the predators, {game.support.prey} of the prey"
    )
    worst = f"predators {exploit.predators[-1]:z.2f}, prey {exploit.prey[-1]:z.2f}"
    print(f"  the last generation    exploitability within the run: {worst}")
    curve = history.payoff
    if len(curve) >= 2 * phases.MIN_LENGTH:
        found = phases.phases(curve)
        words = ", ".join(f"{p.start}-{p.end - 1}: {p.mean:z.2f}" for p in found)
        print(f"  phases of success      {words} {'of the prey caught' if captures else 'payoff to the predators'}")
        alternation = phases.alternation(curve, np.random.default_rng(0))
        print(f"  alternations           {alternation.count}; as many by chance with p = {alternation.p:.2g}")


def _tell_exploiters(run: Path, history: History) -> None:
    """Print a line on how much the first and the last exploiters reached, if there are enough."""
    if told := exploiters_of(run).first(len(history)).in_words():
        print(f"  exploiters             {told} against the champion, from the first third of the run to the last")


def _tell_genealogy(run: Path, history: History) -> None:
    """Print two lines on the origins of the last generation's genes, if the run keeps them."""
    last = {role: each.first(len(history)) for role, each in of_run(run).items()}
    if not last:
        return
    size, n = history.config.esp.subpopulation_size, len(history) - 1
    left = ", ".join(f"{role} {each.founders[-1]:.1f}" for role, each in last.items())
    print(f"  founders left          {left} of {size} at a place of the gene string")
    parts = []
    for role, each in last.items():
        bred = f"bred in {n - each.skipped[-1]:.0f} of {counted(n, 'generation')}"
        parts.append(f"{role} {100 * each.from_past[-1]:.0f}% of the genes ({bred})")
    print(f"  from past champions    {', '.join(parts)}")


def _ranking(own: Played) -> str:
    share = games.transitive_share(own.payoff, own.noise)
    if not np.isnan(share):
        return f"{100 * share:.0f}% by a ranking, {100 - 100 * share:.0f}% in circles"
    return "no differences beyond chance" if own.n_episodes > 1 else "not known from one episode a pair"


def _progress(both: Sides[Progress]) -> str:
    predators, prey, two_sided = both.predators.strength, both.prey.strength, progress.two_sided(both)
    return f"predators {predators:+z.2f}, prey {prey:+z.2f}; two-sided {two_sided:+z.2f}"


def _draw(place: Path, name: str, history: History, own: Played) -> None:
    payoff, captures = own.payoff, isinstance(own, CrossPlay)
    name_of, what = ("caught", "fraction of prey caught") if captures else ("payoff", "payoff to the predators")
    figure, (axes,) = plots.panels(1, width=4.6, height=3.9)
    bottom, top = (0.0, max(0.5, float(payoff.max()))) if captures else (float(payoff.min()), float(payoff.max()))
    data = plots.payoff_matrix(figure, axes, own.predators, own.prey, payoff, top, bottom, name_of, what)
    axes.set_title("who catches whom" if captures else "who beats whom")
    plots.save(figure, place / f"{name}-ciao.png", data)

    figure, (axes,) = plots.panels(1, width=5.5, height=3)
    curve = history.payoff
    said = "prey caught" if captures else what
    drawn = plots.curve(axes, np.arange(len(curve)), curve[None], f"{said}, 15 generations' mean", 0, window=15)
    axes.set(
        xlabel="generation", ylabel="fraction of prey" if captures else "payoff", title="champion against champion"
    )
    if captures:
        axes.set_ylim(0, 1)
    plots.save(figure, place / f"{name}-success.png", {"generation": np.arange(len(curve)), name_of: curve, **drawn})

    if payoff.shape[0] == payoff.shape[1]:
        both = progress.master_tournament(payoff, own.total)
        figure, (axes,) = plots.panels(1, width=5.5, height=3)
        labels = ("predators: prey caught", "prey: not caught") if captures else ("payoff to predators", "to prey")
        drawn = plots.curve(axes, own.predators, both.predators[None], labels[0], colour=plots.PREDATORS)
        drawn |= plots.curve(axes, own.prey, both.prey[None], labels[1], 1, colour=plots.PREY)
        axes.set(xlabel="generation", ylabel="against all opponents of the run", title="master tournament")
        if captures:
            axes.set_ylim(0, 1)
        plots.legend(axes)
        plots.save(figure, place / f"{name}-master.png", {"generation": own.predators, **drawn})
    print(f"  figures                {place / name}-*.png")
