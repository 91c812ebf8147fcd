"""The page's own matches, beside those of the trainer's kernel and of the environment: equal, step for step."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from gymnasium.utils import seeding
from wide_sight import WIDE

from esp_trainer.analysis.behaviours.detection import detected
from esp_trainer.analysis.behaviours.paths import Paths
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.roles import ATTACKS, BLOCKS
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.history import History
from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.presets import PRESETS, preset
from esp_trainer.report import matches
from esp_trainer.seeding import stream
from esp_trainer.teams.zoo import load_team
from esp_trainer.types import ROLES, Role, ScriptedTeams, TrialBatch
from predprey_env import EnvConfig
from predprey_env.jit.floats import fma
from predprey_env.policies import SCRIPTS, ScriptedTeam
from predprey_env.policies.scripted import NUMBERS
from predprey_env.rules.starts import draw_starts

N_STARTS = 12
PLAY = """([world, sides, starts, generations]) => {
  const { Game, Side, behavioursOf } = predprey, game = new Game(world);
  const predators = new Side(sides.predators), prey = new Side(sides.prey), played = [];
  for (let n = 0; n < generations; n++) for (const start of starts) {
    const match = game.match(predators.team(n), prey.team(n), start), last = match.length - 1;
    const marks = behavioursOf(match, world);
    const thoughts = start.map((_, agent) => game.thoughts(match, last, agent)?.votes ?? null);
    played.push({ cells: match.cells, caught: match.caughtAt.map((at) => at < Infinity), actions: match.actions[last],
      found: marks.found, role: marks.role, votes: thoughts.map((votes) => votes && [...votes]) });
  }
  return played;
}"""


def small(name: str, generations: int = 2, **env: Any) -> RunConfig:
    config = preset(name)
    return config.replace(
        generations=generations,
        env=config.env.replace(**{"size": 20, "max_cycles": 60, **env}),
        esp=config.esp.replace(n_trials=40, n_episodes=2),
        champion=config.champion.replace(n_candidates=3, n_held_out=8),
    )


def sides(predators: SideConfig | None = None, prey: SideConfig | None = None, **env: Any) -> RunConfig:
    return small("paper-3v2", **env).replace(predators=predators or SideConfig(), prey=prey or SideConfig())


REPEATED = ("race-pond", "race-steppe", "race-meadow", "smoke")
"""Presets with the world and the sides of others here: they differ in how they evolve alone."""

CONFIGS = {name: small(name) for name in PRESETS if name not in ("game", *REPEATED)}
CONFIGS |= {
    "in turns": small("paper-3v2", move_order="prey_first"),
    "swaps": small("paper-3v2", swap_captures=True, size=9),
    "no idling, odd torus, many": small("paper-3v2", predator_idle=False, size=11, n_predators=4, n_prey=3),
    "one of each": small("paper-3v2", n_predators=1, n_prey=1, size=7),
}
CONFIGS |= {
    f"{script}, {order}": sides(predators=SideConfig(policy=script), move_order=order)  # type: ignore[arg-type]
    for script in SCRIPTS["predators"]
    for order in ("simultaneous", "prey_first")
}
CONFIGS |= {
    "everything seen": sides(see_teammates=True, see_moves=True, see_identity=True, see_nearest_first=True),
    "seen in turns": sides(SideConfig(controller="central"), see_moves=True, see_scaled=True, move_order="prey_first"),
}
CONFIGS["elman"] = sides(SideConfig(network="elman"), SideConfig(network="elman", controller="combiner"))
CONFIGS["elman against the paper's"] = sides(SideConfig(network="elman", choice="drawn"))
CONFIGS["a sight of one's own"] = sides(observation=WIDE)
CONFIGS |= {script: sides(prey=SideConfig(policy=script)) for script in SCRIPTS["prey"]}  # type: ignore[arg-type]
CONFIGS |= {
    controller: sides(
        SideConfig(controller=controller, bias=True, captured_vote="skip", input_scale=0.3),  # type: ignore[arg-type]
        SideConfig(controller=controller, choice="drawn", output="linear"),  # type: ignore[arg-type]
    )
    for controller in ("split", "monolithic", "combiner", "double", "pairs", "central")
}


def played_here(history: History, generation: int, starts: np.ndarray) -> tuple[np.ndarray, Paths, np.ndarray]:
    """Traces, paths and who was caught, by the trainer's kernel."""
    env = history.config.env
    predators = history.player("predators", generation).as_teams(len(starts))
    prey = history.player("prey", generation).as_teams(len(starts))
    result, trace = FusedEvaluator(env).play(TrialBatch(predators, prey, starts))
    captured = result.captured[:, 0]
    paths = Paths.of_trace(trace.cells[:, 0], env.n_predators, env.size, trace.caught_at[:, 0])
    return trace.cells[:, 0], paths, captured


QUICK = ("paper-3v2", "in turns", "flee_nearest", "central", "everything seen")
"""One of each kind of world and player for which the kernel is not compiled again: the others are slow."""


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in CONFIGS])
def test_matches_networks_and_marks_are_the_trainers(name: str, blank_tab: Any) -> None:
    config = CONFIGS[name]
    env, evaluator = config.env, FusedEvaluator(config.env)
    history = History.evolve(config, evaluator)
    starts = evaluator.starts.held_out(stream(1, "page"), N_STARTS)
    generations = np.arange(len(history))
    world, both = matches.world_for_page(env), matches.both(history, generations)
    found = blank_tab(PLAY, [world, both, starts[:, 0].tolist(), len(generations)])
    for generation in generations.tolist():
        trace, paths, captured = played_here(history, generation, starts)
        ours = found[generation * N_STARTS : (generation + 1) * N_STARTS]
        for i, match in enumerate(ours):
            assert match["cells"] == trace[i, : paths.lengths[i] + 1].tolist()
            assert match["caught"] == captured[i].tolist()
            assert_votes_decide(match, history)
        assert_same_marks(ours, paths)
    blank_tab.assert_quiet()


def assert_votes_decide(match: dict[str, Any], history: History) -> None:
    """What the panel shows of networks that follow the most votes is why an agent moved."""
    n_predators = history.config.env.n_predators
    for agent, votes in enumerate(match["votes"]):
        settings = history.config.predators if agent < n_predators else history.config.prey
        assert (votes is None) == (settings.policy != "esp")
        hidden = agent >= n_predators and match["caught"][agent - n_predators]
        if votes and settings.choice == "most_votes" and not hidden:
            assert int(np.argmax(votes)) == match["actions"][agent]


def assert_same_marks(matches_: list[dict[str, Any]], paths: Paths) -> None:
    for name, detector in BEHAVIOURS.items():
        if detector.of_interaction:
            for match, rows in zip(matches_, detector.rows(paths), strict=True):
                marked = [t for first, last in match["found"].get(name, []) for t in range(first, last + 1)]
                assert marked == np.flatnonzero(rows).tolist(), name
    roles = detected(paths, Thresholds()).episodes
    attacks, blocks = (each.any(axis=3) for each in (roles.attacks, roles.blocks))
    for match, role in zip(matches_, np.where(attacks, ATTACKS, np.where(blocks, BLOCKS, 0)), strict=True):
        assert match["role"] == role[: len(match["cells"])].tolist()


PAIRS = [
    ("modern-3v2/predators/seed-502-late", "paper-3v2/prey/seed-500-middle"),
    ("held-out/modern-3v2/predators/seed-901-early", "paper-3v2/prey/seed-501-middle"),
    ("modern-3v1/predators/seed-501-early", "modern-3v1/prey/seed-500-early"),
    ("held-out/modern-3v1/predators/seed-901-middle", "paper-3v1/prey/seed-502-middle"),
    ("paper-3v1/predators/seed-502-early", "modern-3v1/prey/seed-500-early"),
    ("surround", "random"),
    ("intercept", "flee_nearest"),
]
"""The pairs of the gallery, and scripts that catch a lot."""


@pytest.mark.slow
def test_every_behaviour_is_marked_alike_where_it_is_seen(blank_tab: Any) -> None:
    seen: set[str] = set()
    for names in PAIRS:
        scripted = all(name in NUMBERS for name in names)
        env = EnvConfig(n_prey=1 if "3v1" in names[0] else 2, size=24 if scripted else 100)
        evaluator = FusedEvaluator(env)
        starts = np.stack([draw_starts(seeding.np_random(seed)[0], 1, env) for seed in range(48)])
        players = [ScriptedTeams(name) if name in NUMBERS else load_team(name) for name in names]
        batch = TrialBatch(*(player.as_teams(len(starts)) for player in players), starts)
        _, trace = evaluator.play(batch)
        paths = Paths.of_trace(trace.cells[:, 0], env.n_predators, env.size, trace.caught_at[:, 0])
        both = {role: given(role, player, env) for role, player in zip(ROLES, players, strict=True)}
        found = blank_tab(PLAY, [matches.world_for_page(env), both, starts[:, 0].tolist(), 1])
        assert_same_marks(found, paths)
        seen |= {name for match in found for name in match["found"]}
    assert seen == {name for name, detector in BEHAVIOURS.items() if detector.of_interaction}


def given(role: Role, player: Team | ScriptedTeams, env: EnvConfig) -> dict[str, Any]:
    """A player as a page holds it."""
    if isinstance(player, ScriptedTeams):
        script = ScriptedTeam.of(player.script, role, env).compiled(role, env, 0)
        return {"role": role, "name": player.script, "script": list(script)}
    genes = base64.b64encode(player.genomes.astype("<f4").tobytes()).decode()
    return {"role": role, "generations": [0], "controller": matches.controller(player.controller), "genes": genes}


def test_multiply_add_is_rounded_once(blank_tab: Any) -> None:
    generator = np.random.default_rng(0)
    ones = generator.normal(size=(3, 4000)).astype(np.float32) * 10.0 ** generator.integers(-6, 7, (3, 4000))
    numbers = ones.astype(np.float32)
    numbers[2, :2000] = -(numbers[0, :2000] * numbers[1, :2000])  # all but cancels
    numbers[0, 3000:] = 1 + 2.0**-12
    numbers[1, 3000:] = 1 + 2.0**-12  # the product ends in a tie
    found = blank_tab("(rows) => rows[0].map((a, i) => predprey.fma(a, rows[1][i], rows[2][i]))", numbers.tolist())
    expected = [float(fma(*column)) for column in numbers.T]
    assert found == expected
    naive = (numbers[0] * numbers[1] + numbers[2]).tolist()
    assert found != naive
