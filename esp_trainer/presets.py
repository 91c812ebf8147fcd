"""Presets: the experiments, each one frozen config with a name for the command line."""

from __future__ import annotations

import difflib

from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.game import GameConfig
from esp_trainer.tasks import WORLDS
from predprey_env.config import EnvConfig

_ONE_PREY = EnvConfig(n_prey=1)


def _own_reward(task: str) -> EnvConfig:
    """Return the world of a task in which each predator is paid for its own distance."""
    return WORLDS[task].replace(credit="individual")


_MONOLITHIC = SideConfig(controller="monolithic")
_ONE_NETWORK = SideConfig(controller="monolithic", bias=True)
_SCALED = SideConfig(input_scale=0.2)
_DRAWN = SideConfig(output="linear", choice="drawn")
_UNMATED = EspConfig(hof_mates=0)
_BIASED = SideConfig(bias=True)
_RACE = RunConfig(
    generations=1500,
    env=_ONE_PREY,
    predators=_BIASED,
    prey=_BIASED.replace(input_scale=0.2),
    esp=EspConfig(
        hof_mates=0,
        past_share=0.5,
        past_choice="contested",
        past_each_episode=True,
        block_size=10,
        memory=0.8,
        prior_trials=100.0,
        exploiters_every=25,
    ),
    champion=ChampionConfig(n_past=10),
)

PRESETS: dict[str, tuple[str, RunConfig]] = {
    "race-3v1": (
        "recommended: three predators and one prey, past champions and exploiters as opponents (docs/race.md)",
        _RACE,
    ),
    "race-3v2": (
        "the same with two prey on the paper's torus, where the prey win after some 500 generations; not proved yet",
        _RACE.replace(env=_own_reward("3v2")),
    ),
    "race-steppe": (
        "recommended with two prey: 40 x 40 cells, where both sides go on improving (docs/race.md)",
        _RACE.replace(generations=800, env=_own_reward("steppe")),
    ),
    "race-meadow": (
        "the same on 30 x 30 cells: three minutes",
        _RACE.replace(generations=500, env=_own_reward("meadow")),
    ),
    "race-pond": ("one prey on 20 x 20 cells: one minute", _RACE.replace(generations=500, env=WORLDS["pond"])),
    "paper-3v2": ("three predators and two prey, split networks on both sides (section VI.C)", RunConfig()),
    "paper-3v1": (
        "three predators and one prey with a network for each predator (section VI.B)",
        RunConfig(env=_ONE_PREY),
    ),
    "monolithic-3v2": (
        "the first preliminary experiment: one network an agent; the paper saw stagnation (section VI.A)",
        RunConfig(predators=_MONOLITHIC, prey=_MONOLITHIC),
    ),
    "monolithic-3v1": (
        "the second: a single prey with one network; the paper saw it caught with ease (section VI.A)",
        RunConfig(env=_ONE_PREY, predators=_MONOLITHIC, prey=_MONOLITHIC),
    ),
    "monolithic-3v1-wide": (
        "the same with three times the hidden neurons; the paper saw no improvement (section VI.A)",
        RunConfig(env=_ONE_PREY, predators=_MONOLITHIC, prey=SideConfig(controller="monolithic", n_hidden=30)),
    ),
    "matched-3v2": (
        "monolithic networks with as many genes as the split ones of paper-3v2",
        RunConfig(
            predators=SideConfig(controller="monolithic", n_hidden=16),  # 16 x (4 + 5) genes for 2 x 10 x (2 + 5)
            prey=SideConfig(controller="monolithic", n_hidden=18),  # 18 x (6 + 4) for 3 x 10 x (2 + 4)
        ),
    ),
    "matched-3v1": (
        "a single prey whose one network has as many genes as its three in paper-3v1",
        RunConfig(env=_ONE_PREY, prey=SideConfig(controller="monolithic", n_hidden=18)),
    ),
    "combiner-3v2": (
        "split networks whose outputs a further network combines (section VIII)",
        RunConfig(predators=SideConfig(controller="combiner"), prey=SideConfig(controller="combiner")),
    ),
    "combiner-3v1": (
        "the same for a single prey",
        RunConfig(env=_ONE_PREY, prey=SideConfig(controller="combiner")),
    ),
    "modern-3v2": (
        "recommended before race-3v2, levels off: no past mates, offsets times 0.2 (docs/reproduction.md)",
        RunConfig(predators=_SCALED, prey=_SCALED, esp=_UNMATED),
    ),
    "modern-3v1": (
        "the same for a single prey",
        RunConfig(env=_ONE_PREY, predators=_SCALED, prey=_SCALED, esp=_UNMATED),
    ),
    "drawn-3v2": (
        "actions sampled by their votes (linear outputs), so that opponents cannot foresee them",
        RunConfig(predators=_DRAWN, prey=_DRAWN),
    ),
    "drawn-3v1": (
        "the same for a single prey: strong predators (docs/reproduction.md)",
        RunConfig(env=_ONE_PREY, predators=_DRAWN, prey=_DRAWN),
    ),
    "fleeing-prey": (
        "predators evolve against the fixed prey of Yong & Miikkulainen, which runs from the nearest",
        RunConfig(env=_ONE_PREY, prey=SideConfig(policy="flee_nearest")),
    ),
    "fleeing-prey-central": (
        "the same with one network for the whole team, which Yong & Miikkulainen found slower (section III)",
        RunConfig(env=_ONE_PREY, predators=SideConfig(controller="central"), prey=SideConfig(policy="flee_nearest")),
    ),
    "game": (
        "another game: MPE's simple_tag (pip install mpe2), or yours by --game.environment (docs/experiment.md)",
        RunConfig(
            generations=200,
            game=GameConfig(environment="esp_trainer.games.simple_tag", predators="adversary_", prey="agent_"),
            predators=_ONE_NETWORK,
            prey=_ONE_NETWORK,
            esp=_RACE.esp.replace(
                subpopulation_size=50, n_trials=400, n_episodes=4, prior_trials=20.0, exploiters_every=0
            ),
            champion=ChampionConfig(n_candidates=10, n_held_out=100),
        ),
    ),
    "smoke": (
        "everything, small: seconds to see that it works",
        RunConfig(
            generations=20,
            checkpoint_every=5,
            env=EnvConfig(size=12, max_cycles=30),
            esp=EspConfig(subpopulation_size=20, n_trials=100, n_episodes=2, hof_mates=2),
            champion=ChampionConfig(n_candidates=5, n_held_out=64),
        ),
    ),
}
"""Name -> description and config."""

_FORMER = {"race-3v2-40": "race-steppe"}


def preset(name: str) -> RunConfig:
    """Return the config of a preset, or of the one that is recommended for a task.

    Raises :class:`ValueError`, which suggests the nearest name, for an unknown one.
    """
    name = _FORMER.get(name, f"race-{name}" if name in WORLDS else name)
    if name not in PRESETS:
        known = [*PRESETS, *WORLDS]
        near = [each for each in known if each.startswith(name)] or difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
        raise ValueError(f"unknown preset {name}; {hint}")
    return PRESETS[name][1].replace(preset=name)
