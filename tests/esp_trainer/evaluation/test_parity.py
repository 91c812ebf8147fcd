"""The compiled evaluator against the plain one: same starts, same teams, same trajectory, same fitness, bit for bit."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import RunConfig, SideConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.evaluation.kernel import seed_of
from esp_trainer.evaluation.reference import predprey_reference, team_of_trial
from esp_trainer.presets import PRESETS, preset
from esp_trainer.types import ScriptedTeams, TrialBatch, TrialResult
from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.config import SIGHT_OPTIONS
from predprey_env.envs.team import observed_by
from predprey_env.policies import SCRIPTS, Policy, ScriptedTeam

if TYPE_CHECKING:
    from collections.abc import Callable

    from esp_trainer.types import Role, TeamBatch


class Switches(NamedTuple):
    """What differs from three predators and two prey on a tiny torus, where captures abound."""

    env: dict[str, Any] = {}  # noqa: RUF012  # never changed
    predators: dict[str, Any] = {}  # noqa: RUF012
    prey: dict[str, Any] = {}  # noqa: RUF012

    def config(self) -> RunConfig:
        return RunConfig(
            env=EnvConfig(**{"size": 6, "max_cycles": 20, **self.env}),
            predators=SideConfig(**self.predators),
            prey=SideConfig(**self.prey),
        )


def both(**side: Any) -> Switches:
    return Switches({}, side, side)


VARIANTS = {
    "default": Switches(),
    "prey first": Switches({"move_order": "prey_first"}),
    "prey first on an odd torus": Switches({"move_order": "prey_first", "size": 7, "predator_idle": False}),
    "swaps": Switches({"swap_captures": True}),
    "closeness to all": Switches({"closeness": "all"}),
    "closeness of the nearest": Switches({"closeness": "nearest"}),
    "individual credit": Switches({"credit": "individual"}),
    "individual credit, closeness of the nearest": Switches({"credit": "individual", "closeness": "nearest"}),
    "complementary prey": Switches({"prey_fitness": "complementary"}),
    "no idling": Switches({"predator_idle": False}),
    "collisions at the start": Switches({"start_collisions": "allow", "size": 3}),
    "one prey": Switches({"n_prey": 1}),
    "three prey": Switches({"n_prey": 3}),
    "one predator": Switches({"n_predators": 1}),
    "five predators": Switches({"n_predators": 5}),
    "odd torus": Switches({"size": 5}),
    "one step": Switches({"max_cycles": 1}),
    "monolithic": both(controller="monolithic"),
    "monolithic predators": Switches({}, {"controller": "monolithic"}, {}),
    "combiner": both(controller="combiner"),
    "combiner, linear, bias, skip": both(controller="combiner", output="linear", bias=True, captured_vote="skip"),
    "combiner of one": Switches({"n_prey": 1}, {"controller": "combiner"}, {"controller": "combiner", "n_hidden": 3}),
    "two networks for each": both(controller="double"),
    "a network for each pair": both(controller="pairs"),
    "central": both(controller="central"),
    "central, bias, skip": both(controller="central", bias=True, captured_vote="skip"),
    "central, in turns": Switches(
        {"move_order": "prey_first", "n_prey": 3}, {"controller": "central"}, {"controller": "central"}
    ),
    "central against a script": Switches({"n_prey": 1}, {"controller": "central"}, {"policy": "flee_nearest"}),
    "bias": both(bias=True),
    "linear": both(output="linear"),
    "scaled": both(input_scale=0.2),
    "skip": both(captured_vote="skip"),
    "skip, linear, bias": both(captured_vote="skip", output="linear", bias=True),
    "drawn": both(choice="drawn"),
    "drawn, linear, in turns": Switches(
        {"move_order": "prey_first"}, {"choice": "drawn", "output": "linear", "input_scale": 0.01}, {"choice": "drawn"}
    ),
    "drawn, central": both(choice="drawn", controller="central"),
    "drawn, combiner": both(choice="drawn", controller="combiner"),
    "one hidden neuron": both(n_hidden=1),
    "elman": both(network="elman"),
    "elman, drawn, in turns": Switches(
        {"move_order": "prey_first", "n_prey": 3},
        {"network": "elman", "choice": "drawn", "bias": True},
        {"network": "elman", "controller": "combiner"},
    ),
    "elman, central": Switches({}, {"network": "elman", "controller": "central"}, {"captured_vote": "skip"}),
    "team-mates seen": Switches({"see_teammates": True, "n_prey": 3}),
    "moves seen": Switches({"see_moves": True}),
    "everything seen, monolithic, in turns": Switches(
        {**dict.fromkeys(SIGHT_OPTIONS, True), "move_order": "prey_first"},
        {"controller": "monolithic"},
        {"controller": "combiner", "captured_vote": "skip"},
    ),
    "everything seen, central": Switches(
        dict.fromkeys(SIGHT_OPTIONS, True), {"controller": "central"}, {"controller": "pairs", "choice": "drawn"}
    ),
    "everything seen, against a script": Switches(dict.fromkeys(SIGHT_OPTIONS, True), {}, {"policy": "flee_nearest"}),
    "wide prey": Switches({}, {}, {"n_hidden": 30}),
    "fixed prey": Switches({}, {}, {"policy": "flee_nearest"}),
    "fixed prey first": Switches({"move_order": "prey_first"}, {}, {"policy": "flee_nearest"}),
    "fixed predators": Switches({}, {"policy": "greedy_chase"}, {}),
    "fixed predators, no idling": Switches({"predator_idle": False}, {"policy": "greedy_chase"}, {}),
}


def walk(
    env: PredPreyEnv, predators: Policy, prey: Policy, start: np.ndarray, seed: int
) -> tuple[np.ndarray, list[dict[int, int]], list[int]]:
    """Everybody's cells at the start and after every time step, ``(steps + 1, n_agents, 2)``, read from the state; the
    actions of each step, by agent; and the step in which each prey was caught, 0 for none.
    """
    n, n_prey = env.config.n_agents, env.config.n_prey
    calls_a_step = 2 if env.config.move_order == "prey_first" else 1

    def cells() -> np.ndarray:
        return env.state()[: 2 * n].reshape(2, n).T

    observations, infos = env.reset(options={"starts": start})
    predators.reset(seed)
    prey.reset(seed)
    path, caught_at, actions, calls = [cells()], [0] * n_prey, [], 0
    while env.agents:
        chosen = {}
        for player in (predators, prey):
            seen = observed_by(player, env, observations)
            chosen |= player.act({agent: view for agent, view in seen.items() if infos[agent]["in_turn"]})
        observations, *_, infos = env.step(chosen)
        actions.append(chosen)
        calls += 1
        free = env.state()[2 * n : -1]
        caught_at = [
            at or (0 if alive else -(-calls // calls_a_step)) for at, alive in zip(caught_at, free, strict=True)
        ]
        if calls % calls_a_step == 0:
            path.append(cells())
    turns = [actions[at : at + calls_a_step] for at in range(0, calls, calls_a_step)]
    number = {agent: i for i, agent in enumerate(env.possible_agents)}
    taken = [{number[agent]: action for part in turn for agent, action in part.items()} for turn in turns]
    return np.array(path), taken, caught_at


def policy(role: Role, teams: TeamBatch, trial: int, config: EnvConfig) -> Policy:
    if isinstance(teams, ScriptedTeams):
        return ScriptedTeam.of(teams.script, role, config)
    return team_of_trial(role, teams, trial)


def assert_same_results(fused: TrialResult, reference: TrialResult) -> None:
    assert np.array_equal(fused.steps, reference.steps)
    assert np.array_equal(fused.captured, reference.captured)
    assert fused.fitness.tobytes() == reference.fitness.tobytes()


def assert_same_walks(config: EnvConfig, batch: TrialBatch) -> None:
    cells, actions, caught_at = FusedEvaluator(config, threads=1).play(batch)[1]
    env = PredPreyEnv(config)
    for trial in range(len(batch.starts)):
        predators = policy("predators", batch.predators, trial, config)
        prey = policy("prey", batch.prey, trial, config)
        for episode, start in enumerate(batch.starts[trial]):
            path, taken, caught = walk(env, predators, prey, start, seed=seed_of(start))
            assert np.array_equal(cells[trial, episode, : len(path)], path)
            assert (cells[trial, episode, len(path) :] == -1).all()
            assert caught_at[trial, episode].tolist() == caught
            for step, chosen in enumerate(taken):
                assert {agent: actions[trial, episode, step, agent] for agent in chosen} == chosen
            assert (actions[trial, episode, len(taken) :] == -1).all()


def assert_parity(config: EnvConfig, batch: TrialBatch) -> TrialResult:
    result = FusedEvaluator(config, threads=1).evaluate(batch)
    assert_same_results(result, predprey_reference(config).evaluate(batch))
    assert_same_walks(config, batch)
    return result


COMPILED_APART = ("elman", "elman, drawn, in turns", "elman, central")
"""Variants for which the kernel is compiled again; `elman, central` is for networks of two kinds."""


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n in COMPILED_APART else ()) for n in VARIANTS]
)
def test_every_switch_plays_the_same_in_both(name: str, random_batch: Callable[..., TrialBatch]):
    config = VARIANTS[name].config()
    # Two whole blocks of sixteen worlds, and one that is not full.
    assert_parity(config.env, random_batch(config, n_trials=21, n_episodes=2, seed=len(name)))


def test_tiny_worlds_hold_all_outcomes(random_batch: Callable[..., TrialBatch]):
    """Else the tests above would compare little."""
    config = VARIANTS["default"].config()
    result = FusedEvaluator(config.env).evaluate(random_batch(config, 200, 2))
    n_caught = result.captured.sum(axis=-1)
    assert all((n_caught == k).sum() > 20 for k in range(3))
    assert len(np.unique(result.steps)) > 10
    assert len(np.unique(result.fitness)) > 30


WORLDS_OF_PRESETS = {preset(name).env: name for name in PRESETS if name not in ("smoke", "game")}
"""Of the presets on each world the last: the others differ in their teams alone, which play on a tiny world below."""


@pytest.mark.parametrize("name", WORLDS_OF_PRESETS.values())
def test_presets_play_the_same_on_their_own_worlds(name: str, random_batch: Callable[..., TrialBatch]):
    config = preset(name)
    assert_parity(config.env, random_batch(config, n_trials=7))


@pytest.mark.parametrize("name", [name for name in PRESETS if name != "game"])
def test_presets_play_the_same_on_a_tiny_world(name: str, random_batch: Callable[..., TrialBatch]):
    config = preset(name)
    config = config.replace(env=config.env.replace(size=6, max_cycles=20))
    assert_parity(config.env, random_batch(config, n_trials=9, n_episodes=2))


@pytest.mark.parametrize("env", [EnvConfig(size=7, max_cycles=20), EnvConfig(size=8, move_order="prey_first")])
@pytest.mark.parametrize(("predators", "prey"), list(zip(SCRIPTS["predators"], cycle(SCRIPTS["prey"]))))
def test_two_scripts_play_the_same(predators: str, prey: str, env: EnvConfig, random_batch: Callable[..., TrialBatch]):
    starts = random_batch(RunConfig(env=env), 19, 2).starts
    assert_parity(env, TrialBatch(ScriptedTeams(predators), ScriptedTeams(prey), starts))


SIDES = st.builds(
    SideConfig,
    controller=st.sampled_from(["split", "monolithic", "combiner", "double", "pairs", "central"]),
    n_hidden=st.integers(1, 12),
    bias=st.booleans(),
    output=st.sampled_from(["logistic", "linear"]),
    input_scale=st.sampled_from([1.0, 0.3, 0.02]),
    captured_vote=st.sampled_from(["zero", "skip"]),
)
WORLDS = st.builds(
    EnvConfig,
    n_predators=st.integers(1, 4),
    n_prey=st.integers(1, 3),
    size=st.integers(3, 8),
    max_cycles=st.integers(1, 25),
    move_order=st.sampled_from(["simultaneous", "prey_first"]),
    swap_captures=st.booleans(),
    start_collisions=st.sampled_from(["redraw", "allow"]),
    predator_idle=st.booleans(),
    closeness=st.sampled_from(["uncaught", "all", "nearest"]),
    credit=st.sampled_from(["team", "individual"]),
    prey_fitness=st.sampled_from(["lifespan", "complementary"]),
)


@pytest.mark.slow
@settings(max_examples=60)
@given(
    env=WORLDS,
    predators=SIDES,
    prey=SIDES,
    n_trials=st.integers(1, 20),
    n_episodes=st.integers(1, 3),
    seed=st.integers(0, 1000),
)
def test_any_combination_of_switches_plays_the_same_in_both(
    env: EnvConfig,
    predators: SideConfig,
    prey: SideConfig,
    n_trials: int,
    n_episodes: int,
    seed: int,
    random_batch: Callable[..., TrialBatch],
):
    config = RunConfig(env=env, predators=predators, prey=prey)
    assert_parity(env, random_batch(config, n_trials, n_episodes, seed))


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
def test_the_world_goes_on_the_same_where_caught_prey_are_removed(
    move_order: str, random_batch: Callable[..., TrialBatch]
):
    config = Switches({"n_prey": 3, "captured_prey": "removed", "move_order": move_order}).config()
    batch = random_batch(config, n_trials=33)
    assert 0 < FusedEvaluator(config.env).evaluate(batch).captured.mean() < 1
    assert_same_walks(config.env, batch)


@pytest.mark.parametrize("switch", [{"reward": "dense"}, {"captured_prey": "removed"}])
def test_switches_of_the_environment_alone_do_not_change_results(
    switch: dict[str, Any], random_batch: Callable[..., TrialBatch]
):
    config = VARIANTS["default"].config()
    batch = random_batch(config, 17)
    expected = FusedEvaluator(config.env, threads=1).evaluate(batch)
    world = config.env.replace(**switch)
    assert_same_results(FusedEvaluator(world, threads=1).evaluate(batch), expected)
    assert_same_results(predprey_reference(world).evaluate(batch), expected)


@pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
def test_evolved_teams_play_the_same_in_both(move_order: Any):
    config = preset("smoke")
    config = config.replace(env=config.env.replace(move_order=move_order))
    evaluator = FusedEvaluator(config.env)
    coevolution = Coevolution(config, new_sides(config), evaluator)
    generations = [coevolution.step(number) for number in range(8)]
    generator = np.random.default_rng(1)
    drawn = {role: side.algorithm.draw(generator, 24) for role, side in coevolution.evolving.items()}
    starts = evaluator.starts.draw(generator, 24, 2)
    result = assert_parity(config.env, TrialBatch(drawn["predators"], drawn["prey"], starts))
    assert 0 < result.captured.mean() < 1
    for generation in generations[-2:]:
        champions = {role: champion.as_teams(18) for role, champion in generation.champions.items()}
        assert_parity(config.env, TrialBatch(champions["predators"], champions["prey"], starts[:18]))


def test_evolution_does_not_know_which_evaluator_ran():
    config = preset("smoke")
    config = config.replace(
        env=config.env.replace(size=6, max_cycles=15),
        esp=config.esp.replace(n_trials=20, n_episodes=1),
        champion=config.champion.replace(n_candidates=2, n_held_out=8),
    )
    runs = [
        Coevolution(config, new_sides(config), evaluator)
        for evaluator in (FusedEvaluator(config.env), predprey_reference(config.env))
    ]
    for number in range(3):
        fused, reference = (run.step(number) for run in runs)
        assert fused.held_out == reference.held_out
        for role in runs[0].evolving:
            genomes = [run.evolving[role].algorithm.genomes.tobytes() for run in runs]
            assert genomes[0] == genomes[1]
