"""Teams of every kind of controller as policies, as opponents in the environments, and on disk."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.esp.team import Team, gather_genomes
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from predprey_env import EnvConfig, TeamView, team_view, vector_env
from predprey_env.agents import other_team
from predprey_env.config import SIGHT_OPTIONS
from predprey_env.sight import PLAIN_SIGHT, Sight

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from esp_trainer.types import Role

KINDS = ["split", "monolithic", "combiner", "double", "pairs", "central"]
KIND = pytest.mark.parametrize("kind", KINDS)
ROLE = pytest.mark.parametrize("role", ["predators", "prey"])
ORDER = pytest.mark.parametrize("move_order", ["simultaneous", "prey_first"])
SMALL: dict[str, Any] = {"n_predators": 3, "n_prey": 2, "size": 6, "max_cycles": 9, "reward": "dense"}


def random_team(role: Role, kind: str, seed: int = 0, sight: Sight = PLAIN_SIGHT, **settings: Any) -> Team:
    """A team for the small world."""
    side = SideConfig(**{"controller": kind, "n_hidden": 4, **settings})
    n_agents, n_opponents, n_actions, _ = EnvConfig(**SMALL).team(role)
    controller = make_controller(side, wiring_for(side, n_opponents, n_agents, sight), n_actions, n_agents, sight)
    shape = (n_agents // controller.n_together, *controller.shape)
    genomes = np.random.default_rng(seed).uniform(-6, 6, shape)
    return Team(role, side, controller, genomes.astype(np.float32))


# -- a central controller ----------------------------------------------------------------------------------------------


def two_in_step(n_seen: int | None = None) -> Team:
    """Two predators of one prey. Its hidden neurons wake when the prey is east of the first and north of the second:
    the first then goes east for the one and north for the other, and the second west and idle.
    """
    side = SideConfig(controller="central", n_hidden=2, output="linear")
    controller = make_controller(side, wiring_for(side, 1, 2), 5, 2)
    east_of_first = [9, 0, 0, 0, *np.eye(5)[0], *np.eye(5)[1]]
    north_of_second = [0, 0, 0, 9, *2 * np.eye(5)[2], *2 * np.eye(5)[4]]
    genomes = np.array([[[east_of_first, north_of_second]]], np.float32)
    return Team("predators", side, controller, genomes, n_seen=n_seen)


def view(x: float, y: float) -> np.ndarray:
    return np.array([x, y], np.float32)


def test_a_central_teams_agents_act_on_what_the_whole_team_sees():
    team = two_in_step()
    assert team.n_agents == 2
    for first, second, actions in (
        (view(5, 0), view(0, -5), (0, 1)),
        (view(-5, 0), view(0, 5), (2, 4)),
        (view(5, 0), view(0, 5), (2, 4)),
    ):
        for views in ({"predator_0": first, "predator_1": second}, {"predator_1": second, "predator_0": first}):
            chosen = team.act(views)
            assert chosen == {"predator_0": actions[0], "predator_1": actions[1]}
            assert list(chosen) == list(views)
            assert all(type(action) is int for action in chosen.values())


def test_what_a_central_team_does_not_see_counts_as_zeros():
    """As it is in compiled code, where a caught prey sees zeros."""
    for seed in range(20):
        team = random_team("prey", "central", seed)
        own = np.random.default_rng(seed).integers(-3, 3, 6).astype(np.float32)
        for there, absent in (("prey_0", "prey_1"), ("prey_1", "prey_0")):
            with_zeros = team.act({there: own, absent: np.zeros(6, np.float32)})
            assert team.act({there: own}) == {there: with_zeros[there]}
    assert team.act({}) == {}


def test_a_central_team_takes_its_own_views_from_what_everybody_sees():
    everybody = {"prey_0": view(-99, 99), "predator_0": view(5, 0), "predator_1": view(0, 5), "prey_1": view(99, -99)}
    assert two_in_step().act(everybody) == {"predator_0": 2, "predator_1": 4}


def test_a_central_team_refuses_views_and_agents_that_are_not_its_own():
    with pytest.raises(ValueError, match=r"^predator_1 must observe at least 2 numbers for this team, got 1$"):
        two_in_step().act({"predator_0": view(0, 0), "predator_1": np.zeros(1, np.float32)})
    with pytest.raises(ValueError, match=r"^predator_0 must observe 2 numbers for this team, got 3$"):
        two_in_step(n_seen=2).act({"predator_0": np.zeros(3, np.float32)})
    with pytest.raises(ValueError, match=r"^predator_2 is not in this team of 2 predators$"):
        two_in_step().act({"predator_2": view(0, 0)})


def test_a_central_team_reads_the_first_numbers_of_longer_views():
    """As other teams do that do not say what they were evolved on."""
    longer = {"predator_0": np.array([5, 0, 99, -99], np.float32), "predator_1": np.array([0, 5, -99, 99], np.float32)}
    assert two_in_step().act(longer) == {"predator_0": 2, "predator_1": 4}


def test_a_central_team_that_does_not_fit_is_refused_as_an_opponent_in_one_line():
    with pytest.raises(ValueError, match=r"^expected predators, got a team of prey$"):
        team_view("prey", random_team("prey", "central"), **SMALL)


@KIND
def test_a_team_fits_its_own_world_and_no_other(kind: str):
    team = random_team("predators", kind)
    team.check_fits("predators", EnvConfig(**SMALL))
    for change, line in (
        ({"n_predators": 2}, "this world has 2 predators, got a team of 3"),
        ({"n_prey": 3}, "this world has 3 prey, got predators evolved against 2"),
        ({"predator_idle": False}, "predators have 4 actions in this world, got a team with 5"),
    ):
        with pytest.raises(ValueError) as refused:  # noqa: PT011  # the whole text is compared
            team.check_fits("predators", EnvConfig(**SMALL | change))
        assert str(refused.value) == line


# -- as opponents ------------------------------------------------------------------------------------------------------


def assert_same_episodes(many: Any, singles: list[TeamView], n_steps: int) -> int:
    """Assert that worlds of a vector environment go on as single ones, each to the end of its episode; returns how many
    prey were caught.
    """
    n_rows, n_caught = many.num_envs // len(singles), 0
    seen, _ = many.reset(seed=3)
    for world, single in enumerate(singles):
        assert seen.reshape(len(singles), n_rows, -1)[world].tolist() == rows(single.reset(seed=3 + world)[0])
    random = np.random.default_rng(0)
    for _ in range(n_steps):
        actions = random.integers(0, many.single_action_space.n, many.num_envs)
        seen, rewards, terminated, truncated, infos = many.step(actions)
        parts = [part.reshape(len(singles), n_rows, -1) for part in (seen, rewards, terminated, truncated)]
        for world, single in enumerate(singles):
            if single.agents:
                chosen = actions.reshape(len(singles), n_rows)[world].tolist()
                step = single.step(dict(zip(single.agents, chosen, strict=True)))
                assert [part[world].tolist() for part in parts] == [rows(part) for part in step[:4]]
                if not single.agents:
                    n_caught += int(infos["n_captured"].reshape(len(singles), n_rows)[world, 0])
    assert not any(single.agents for single in singles)
    return n_caught


def rows(values: dict[str, Any]) -> list[Any]:
    return [np.atleast_1d(value).tolist() for value in values.values()]


@KIND
@ORDER
@ROLE
def test_a_team_plays_many_worlds_as_it_plays_single_ones(role: Role, move_order: str, kind: str):
    """In compiled code all but the central ones, which the environments ask."""
    world, team = SMALL | {"move_order": move_order}, random_team(role, kind, seed=1, captured_vote="skip")
    opponent: Any = team.act if kind == "central" else team
    many = vector_env(18, other_team(role), opponent, **world)
    singles = [team_view(other_team(role), team.act, **world) for _ in range(18)]
    assert assert_same_episodes(many, singles, n_steps=9) > 0


@ORDER
@ROLE
def test_a_team_that_draws_plays_many_worlds_as_it_plays_single_ones(role: Role, move_order: str):
    world, team = SMALL | {"move_order": move_order}, random_team(role, "split", seed=1, choice="drawn")
    many = vector_env(18, other_team(role), team, **world)
    singles = [team_view(other_team(role), deepcopy(team), **world) for _ in range(18)]
    assert assert_same_episodes(many, singles, n_steps=9) > 0


@ROLE
def test_what_a_team_draws_follows_from_its_seed(role: Role):
    team = random_team(role, "split", choice="drawn")
    agents = [f"{'predator' if role == 'predators' else 'prey'}_{i}" for i in range(team.n_agents)]
    views = {agent: np.zeros(2 * (5 - team.n_agents), np.float32) for agent in agents}

    def draw(seed: int | None) -> list[dict[str, int]]:
        team.reset(seed)
        return [team.act(views) for _ in range(20)]

    assert draw(5) == draw(5)
    assert draw(5) != draw(6)
    assert draw(None) != draw(None), "without a seed it differs each time"
    first = draw(5)
    assert len({tuple(actions.values()) for actions in first}) > 1, "equal views, other actions"


@ROLE
def test_teams_of_other_genes_play_otherwise(role: Role):
    """Else the test above would compare little."""
    for kind in KINDS:
        episodes = set()
        for seed in range(4):
            single = team_view(other_team(role), random_team(role, kind, seed).act, **SMALL)
            seen = [rows(single.reset(seed=1)[0])]
            while single.agents:
                seen.append(rows(single.step(dict.fromkeys(single.agents, 0))[0]))
            episodes.add(str(seen))
        assert len(episodes) > 1, kind


# -- on disk and in batches --------------------------------------------------------------------------------------------


@KIND
@ROLE
def test_a_team_of_every_kind_comes_back_from_its_file(role: Role, kind: str, tmp_path: Path):
    team = random_team(role, kind, bias=True, output="linear", captured_vote="skip", input_scale=0.2)
    team.save(tmp_path / "team")
    loaded = Team.load(tmp_path / "team")
    assert (loaded.role, loaded.side, loaded.n_agents) == (team.role, team.side, team.n_agents)
    assert loaded.genomes.dtype == np.float32
    assert np.array_equal(loaded.genomes, team.genomes)
    assert np.array_equal(loaded.controller.wiring, team.controller.wiring)
    assert loaded.controller._replace(wiring=team.controller.wiring) == team.controller
    generator = np.random.default_rng(2)
    n_agents, n_opponents, *_ = EnvConfig(**SMALL).team(role)
    for _ in range(20):
        views = generator.integers(-3, 3, (n_agents, 2 * n_opponents)).astype(np.float32)
        seen = {f"{'predator' if role == 'predators' else 'prey'}_{i}": own for i, own in enumerate(views)}
        assert loaded.act(seen) == team.act(seen)


CHANGES: dict[str, Callable[[dict[str, Any]], Any]] = {
    "another kind": lambda header: header["side"].update(controller="split"),
    "another number of agents": lambda header: header.update(n_agents=2),
    "no number of agents": lambda header: header.pop("n_agents"),
    "a number of agents that is none": lambda header: header.update(n_agents="three"),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_a_central_team_whose_file_contradicts_itself_is_refused_in_one_line(
    change: Callable[[dict[str, Any]], Any], tmp_path: Path
):
    random_team("predators", "central").save(tmp_path / "team")
    header, arrays = read_arrays(tmp_path / "team", "team")
    del header["kind"], header["schema"]
    change(header)
    write_arrays(tmp_path / "team", "team", header, arrays)
    with pytest.raises(DamagedFileError, match=r"team is not a usable team: ") as refused:
        Team.load(tmp_path / "team")
    assert "\n" not in str(refused.value)


def test_a_team_that_was_saved_without_its_number_of_agents_comes_back(tmp_path: Path):
    """Only a central controller needs to know it."""
    team = random_team("predators", "split")
    team.save(tmp_path / "team")
    header, arrays = read_arrays(tmp_path / "team", "team")
    del header["kind"], header["schema"], header["n_agents"]
    write_arrays(tmp_path / "team", "team", header, arrays)
    loaded = Team.load(tmp_path / "team")
    assert loaded.n_agents == 3
    assert np.array_equal(loaded.genomes, team.genomes)


@KIND
def test_a_team_of_every_kind_can_play_every_trial_of_a_batch(kind: str):
    team = random_team("predators", kind)
    teams = team.as_teams(5)
    assert teams.indices.shape == (5, *team.genomes.shape[:-1])
    assert (gather_genomes(teams, np.arange(5)) == team.genomes).all()


@KIND
@ROLE
def test_what_a_team_sees_comes_back_from_its_file(role: Role, kind: str, tmp_path: Path):
    everything = Sight(*[True] * len(Sight._fields))
    team = random_team(role, kind, sight=everything)
    team.save(tmp_path / "team")
    loaded = Team.load(tmp_path / "team")
    assert loaded.sight == everything
    assert loaded.n_opponents == EnvConfig(**SMALL).team(role).n_opponents
    loaded.check_fits(role, EnvConfig(**SMALL))
    loaded.check_fits(role, EnvConfig(**SMALL, **dict.fromkeys(SIGHT_OPTIONS, True)))
    with pytest.raises(ValueError, match=r"^this world has 4 "):
        loaded.check_fits(role, EnvConfig(**{**SMALL, "n_prey" if role == "predators" else "n_predators": 4}))


@pytest.mark.parametrize(
    ("sight", "message"),
    [
        ({"moves": 1}, "sight must hold booleans, got {'moves': 1}"),
        ({"smell": True}, "unexpected keyword"),
        (3, "got 3"),
    ],
)
def test_a_file_with_a_sight_that_is_none_is_refused_in_one_line(sight: Any, message: str, tmp_path: Path):
    random_team("predators", "split").save(tmp_path / "team")
    header, arrays = read_arrays(tmp_path / "team", "team")
    write_arrays(tmp_path / "team", "team", header | {"sight": sight}, arrays)
    with pytest.raises(DamagedFileError, match="is not a usable team: ") as refused:
        Team.load(tmp_path / "team")
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)
