"""Who can play the other team of a :class:`TeamView`. Their mistakes are in test_team_view_errors.py."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from esp_trainer import Team
from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from predprey_env import EnvConfig, PredPreyEnv, TeamView, team_view
from predprey_env.agents import other_team
from predprey_env.config import TEAMS, TeamName
from predprey_env.policies import ScriptedTeam

WORLD = {"n_predators": 3, "n_prey": 2, "size": 20, "max_cycles": 40}
TEAM = pytest.mark.parametrize("team", TEAMS)
ORDER = pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])


def evolved(team: TeamName, seed: int = 0) -> Team:
    """A team of random networks."""
    shape, side = EnvConfig(**WORLD).team(team), SideConfig()
    controller = make_controller(side, wiring_for(side, shape.n_opponents), shape.n_actions)
    genomes = np.random.default_rng(seed).normal(size=(shape.n_agents, *controller.shape))
    return Team(team, side, controller, genomes.astype(np.float32))


def episode(view: TeamView, seed: int = 0, n_steps: int = 1000) -> list[list[float]]:
    """The states of an episode in which the team walks at random."""
    random = np.random.default_rng(seed)
    view.reset(seed=seed)
    states = [view.state().tolist()]
    while view.agents and len(states) <= n_steps:
        view.step({agent: int(random.integers(view.action_space(agent).n)) for agent in view.agents})
        states.append(view.state().tolist())
    return states


# -- kinds of opponents -------------------------------------------------------------------------------------------


@TEAM
@ORDER
def test_a_function_plays_as_the_policy_does_that_it_asks(team: TeamName, move_order: str) -> None:
    script = {"predators": "flee_centroid", "prey": "surround"}[team]
    policy = ScriptedTeam.of(script, other_team(team), EnvConfig(**WORLD, move_order=move_order))
    view = team_view(team, policy.act, **WORLD, move_order=move_order)
    assert episode(view) == episode(team_view(team, script, **WORLD, move_order=move_order))


@TEAM
@ORDER
def test_an_evolved_team_plays_on_what_it_sees(team: TeamName, move_order: str) -> None:
    opponent, others = evolved(other_team(team)), other_team(team)
    view, config = team_view(team, opponent, **WORLD, move_order=move_order), EnvConfig(**WORLD, move_order=move_order)
    by_function = TeamView(PredPreyEnv(config), team, lambda views: opponent.act(views))
    assert episode(view, 1) == episode(by_function, 1)
    assert len({str(episode(team_view(team, evolved(others, seed), **WORLD), 1)) for seed in range(4)}) == 4


@pytest.mark.parametrize("captured_prey", ["inert", "removed"])
def test_an_opponent_is_asked_for_the_agents_that_are_there(captured_prey: str) -> None:
    asked = []

    def run_west(views: dict[str, np.ndarray]) -> dict[str, int]:
        asked.append([*views])
        return dict.fromkeys(views, 1)

    view = team_view("predators", run_west, n_predators=1, n_prey=2, size=8, captured_prey=captured_prey)
    view.reset(options={"starts": [[0, 0], [2, 0], [4, 4]]})
    for _ in range(2):
        view.step({"predator_0": 0})  # in the first step it meets prey_0 in (1, 0)
    assert asked == [["prey_0", "prey_1"], ["prey_1"] if captured_prey == "removed" else ["prey_0", "prey_1"]]


@TEAM
def test_an_opponent_of_the_wrong_team_is_refused(team: TeamName) -> None:
    with pytest.raises(ValueError, match=f"^expected {other_team(team)}, got a team of {team}$"):
        team_view(team, evolved(team), **WORLD)


def test_an_opponent_that_does_not_fit_the_world_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^this world has 4 predators, got a team of 3$"):
        team_view("prey", evolved("predators"), **WORLD | {"n_predators": 4})


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("birds", "random"), "team must be predators or prey, got 'birds'"),
        ((None, "random"), "team must be predators or prey, got None"),
        (
            ("prey", "flee_nearest"),
            "script must be one of random, greedy_chase, parity_chase, intercept, surround, got 'flee_nearest'",
        ),
    ],
)
def test_an_unknown_team_or_script_is_refused(arguments: tuple[Any, ...], line: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
        team_view(*arguments)
    assert str(refused.value) == line


def test_parameters_and_render_modes_are_checked() -> None:
    with pytest.raises(ValueError, match=r"^unknown field sise; did you mean size\?$"):
        team_view("prey", "random", sise=5)
    with pytest.raises(ValueError, match=r"^render_mode must be None or one of human, ansi, rgb_array, got 'rgb'$"):
        team_view("prey", "random", "rgb")
    view = team_view("prey", "random", "ansi", **WORLD)
    view.reset(seed=0)
    assert isinstance(view.render(), str)
    view.close()
