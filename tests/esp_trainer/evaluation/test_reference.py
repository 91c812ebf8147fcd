"""The plain evaluator on environments that it knows nothing of: a toy with a script, and MPE's simple_tag."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Discrete
from mpe2 import simple_tag_v3
from pettingzoo import ParallelEnv

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.hall_of_fame import HallOfFame
from esp_trainer.coevolution.sides import EvolvingSide
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.esp.controller import make_controller
from esp_trainer.esp.subpopulations import Subpopulations
from esp_trainer.evaluation.reference import ReferenceEvaluator, predprey_reference, team_of_trial
from esp_trainer.evaluation.starts import CellStarts, SeedStarts
from esp_trainer.networks.controller import Controller
from esp_trainer.types import EvolvedTeams, Role, TrialBatch
from predprey_env import EnvConfig


def random_teams(controller: Controller, n_agents: int, n_trials: int, seed: int) -> EvolvedTeams:
    generator = np.random.default_rng(seed)
    genomes = generator.uniform(-2, 2, (n_agents, *controller.shape[:2], 8, controller.n_genes)).astype(np.float32)
    return EvolvedTeams(controller, genomes, generator.integers(0, 8, (n_trials, n_agents, *controller.shape[:2])))


# -- a toy ---------------------------------------------------------------------------------------------------------


class Toy(ParallelEnv):
    """Two cats and a mouse, which leaves, caught, after as many steps as its seed; cats then play one more.

    At each step a cat earns its number plus 1, and the mouse 10. Everybody sees the step's number twice, in the step in
    which it leaves too, as in most environments of PettingZoo.
    """

    metadata = {"name": "toy"}  # noqa: RUF012

    def __init__(self) -> None:
        self.possible_agents = ["cat_0", "mouse_0", "cat_1"]
        self.agents: list[str] = []
        self.actions: list[dict[str, int]] = []

    def action_space(self, agent: str) -> Discrete:
        return Discrete(3)

    def _seen(self, agents: list[str]) -> dict[str, np.ndarray]:
        return {agent: np.full(2, self.steps, np.float32) for agent in agents}

    def reset(self, seed: int | None = None, options: Any = None) -> tuple[dict[str, Any], dict[str, Any]]:
        self.agents, self.steps, self.lifespan = self.possible_agents[:], 0, seed
        return self._seen(self.agents), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, int]) -> tuple[dict[str, Any], ...]:
        self.actions.append(actions)
        self.steps += 1
        acting = self.agents
        rewards = {agent: 10.0 if agent == "mouse_0" else 1.0 + int(agent[-1]) for agent in acting}
        caught = self.steps == self.lifespan
        over = {agent: self.steps > self.lifespan or (caught and agent == "mouse_0") for agent in acting}
        self.agents = [agent for agent in acting if not over[agent]]
        infos = {agent: {"captured": int(caught and agent == "mouse_0")} for agent in acting}
        return self._seen(acting), rewards, over, dict.fromkeys(acting, False), infos


CONTROLLER = make_controller(SideConfig(n_hidden=2), np.array([[0, 1]]), 3)


def play_toy(seeds: list[list[int]]) -> tuple[Toy, Any]:
    evaluator = ReferenceEvaluator(Toy, SeedStarts(n_prey=1), teams=("cat_", "mouse_"))
    cats, mice = random_teams(CONTROLLER, 2, len(seeds), 0), random_teams(CONTROLLER, 1, len(seeds), 1)
    return evaluator.env, evaluator.evaluate(TrialBatch(cats, mice, np.array(seeds)))


def test_an_agents_fitness_is_its_undiscounted_return_and_predators_come_first():
    _, result = play_toy([[3, 1], [2, 2]])
    assert result.fitness.tolist() == [[[4, 8, 30], [2, 4, 10]], [[3, 6, 20], [3, 6, 20]]]


def test_steps_are_calls_where_the_environment_does_not_count_them():
    assert play_toy([[3, 1], [2, 2]])[1].steps.tolist() == [[4, 2], [3, 3]]


def test_a_capture_is_kept_when_the_prey_has_left():
    assert play_toy([[3, 1]])[1].captured.tolist() == [[[True], [True]]]


def test_only_agents_in_play_act():
    env, _ = play_toy([[2]])
    assert [sorted(actions) for actions in env.actions] == [["cat_0", "cat_1", "mouse_0"]] * 2 + [["cat_0", "cat_1"]]
    assert all(action in range(3) for actions in env.actions for action in actions.values())


def test_a_team_that_no_agents_name_begins_with_is_refused():
    with pytest.raises(ValueError, match="dog_"):
        ReferenceEvaluator(Toy, SeedStarts(n_prey=1), teams=("cat_", "dog_"))


# -- the predator-prey world -----------------------------------------------------------------------------------------


def test_the_reference_of_this_world_takes_fitness_from_terminal_rewards():
    evaluator = predprey_reference(EnvConfig(reward="dense", captured_prey="removed"))
    assert evaluator.env.config == EnvConfig()
    assert isinstance(evaluator.starts, CellStarts)
    assert evaluator.agents == {
        "predators": ["predator_0", "predator_1", "predator_2"],
        "prey": ["prey_0", "prey_1"],
    }


def test_the_team_of_a_trial_is_made_of_the_neurons_that_it_drew():
    teams = random_teams(CONTROLLER, 2, 5, 0)
    team = team_of_trial("prey", teams, 3)
    assert team.role == "prey"
    for agent, network, hidden in np.ndindex(2, 1, 2):
        neuron = teams.indices[3, agent, network, hidden]
        assert np.array_equal(team.genomes[agent, network, hidden], teams.genomes[agent, network, hidden, neuron])


# -- simple_tag ------------------------------------------------------------------------------------------------------

N_CYCLES = 15
# An adversary sees itself (4), two landmarks (4), the three others (6) and the good agent's velocity (2); the good
# agent the same without that velocity. The adversaries have one network, the agent one for each adversary.
WIRING = {"predators": np.array([[0, 1, 12, 13, 14, 15]]), "prey": np.array([[8, 9], [10, 11], [12, 13]])}
CONTROLLERS = {role: make_controller(SideConfig(n_hidden=3), wiring, 5) for role, wiring in WIRING.items()}
N_AGENTS: dict[Role, int] = {"predators": 3, "prey": 1}


def simple_tag() -> ParallelEnv[str, np.ndarray, int]:
    return simple_tag_v3.parallel_env(num_good=1, num_adversaries=3, num_obstacles=2, max_cycles=N_CYCLES)


def tag_evaluator() -> ReferenceEvaluator:
    return ReferenceEvaluator(simple_tag, SeedStarts(n_prey=1), teams=("adversary_", "agent_"))


def tag_batch(n_trials: int, n_episodes: int) -> TrialBatch:
    predators, prey = (random_teams(CONTROLLERS[role], N_AGENTS[role], n_trials, 7) for role in ("predators", "prey"))
    return TrialBatch(predators, prey, SeedStarts(1).draw(np.random.default_rng(0), n_trials, n_episodes))


def test_teams_play_simple_tag_and_their_fitness_is_their_return():
    batch = tag_batch(4, 2)
    result = tag_evaluator().evaluate(batch)
    assert (result.steps == N_CYCLES).all()
    env = simple_tag()
    for trial, episode in np.ndindex(4, 2):
        adversaries = team_of_trial("predators", batch.predators, trial)
        agent = team_of_trial("prey", batch.prey, trial)
        observations, _ = env.reset(seed=int(batch.starts[trial, episode]))
        returns = dict.fromkeys(env.possible_agents, 0.0)
        while env.agents:
            chasers = {name: observations[name] for name in ("adversary_0", "adversary_1", "adversary_2")}
            actions = {**adversaries.act(chasers), **agent.act({"agent_0": observations["agent_0"]})}
            observations, rewards, *_ = env.step(actions)
            for name, reward in rewards.items():
                returns[name] += reward
        assert result.fitness[trial, episode].tolist() == list(returns.values())


def test_simple_tag_plays_the_same_again():
    batch = tag_batch(3, 2)
    first, again = tag_evaluator().evaluate(batch), tag_evaluator().evaluate(batch)
    assert first.fitness.tobytes() == again.fitness.tobytes()
    assert len(np.unique(first.fitness)) > 3


def tag_generations(n: int) -> list[Any]:
    config = RunConfig(
        env=EnvConfig(n_predators=3, n_prey=1),
        esp=EspConfig(subpopulation_size=8, n_trials=10, n_episodes=1, hof_mates=1),
        champion=ChampionConfig(n_candidates=2, n_held_out=3),
    )
    sides: dict[Role, Any] = {}
    for role, controller in CONTROLLERS.items():
        population = Subpopulations.start(config.esp, controller, N_AGENTS[role], np.random.default_rng(3))
        fame = HallOfFame(np.empty((0, N_AGENTS[role], *controller.shape), np.float32), config.esp.hof_size)
        sides[role] = EvolvingSide(population, fame)
    coevolution = Coevolution(config, sides, tag_evaluator())
    return [coevolution.step(number) for number in range(n)]


def test_two_sides_coevolve_in_simple_tag():
    generations = tag_generations(2)
    assert [g.champions["predators"].genomes.shape for g in generations] == [(3, 1, 3, 11)] * 2
    assert [g.champions["prey"].genomes.shape for g in generations] == [(1, 3, 3, 7)] * 2
    assert all(np.isfinite(g.trials[role].fitness).all() for g in generations for role in WIRING)
    assert generations[1].held_out.episodes == 3
    again = tag_generations(2)
    for role in WIRING:
        for one, other in zip(generations, again, strict=True):
            assert one.champions[role].genomes.tobytes() == other.champions[role].genomes.tobytes()
            assert one.champions[role].score == other.champions[role].score
