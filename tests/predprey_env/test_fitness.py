"""Both fitness functions by hand. Sizes are 8 or 7, so that the largest distance is 8 or 6 steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from predprey_env import EnvConfig
from predprey_env.rules.dynamics import World
from predprey_env.rules.fitness import fitness

MakeWorld = Callable[..., World]


def scores(world: World, steps: int = 0, size: int = 8, **switches: object) -> list[float]:
    """Everybody's fitness if the episode, of at most 10 steps, ended now."""
    n_prey = len(world.alive)
    config = EnvConfig(n_predators=len(world.x) - n_prey, n_prey=n_prey, size=size, max_cycles=10, **switches)
    out = np.full(config.n_agents, np.nan)
    fitness(world, steps, config.rules, out)
    return out.tolist()


# -- predators: 25 if g = n, else 20 g/n + 2 g + 20 d/n -----------------------------------------------------------

# Distances: predator 0 at (0, 0), predator 1 at (0, 4); prey at (2, 0), (4, 0), (6, 2).
#             prey 0                prey 1                prey 2
# predator 0  2 + 0 = 2             4 + 0 = 4             2 + 2 = 4 (6 = -2 on a torus of 8)
# predator 1  2 + 4 = 6             4 + 4 = 8             2 + 2 = 4
# both        8, mean 4, d = 1/2    12, mean 6, d = 1/4   8, mean 4, d = 1/2
PREDATORS = [(0, 0), (0, 4)]
PREY = [(2, 0), (4, 0), (6, 2)]


@pytest.mark.parametrize(
    ("n_prey", "caught", "expected"),
    [
        (1, (), 20 * (1 - 4 / 8)),  # 10: one prey at mean distance 4 of 8
        (1, (0,), 25),
        (2, (), 20 * (1 - 5 / 8) / 2),  # 3.75: distances 2 + 6 + 4 + 8 = 20 over 4 pairs
        (2, (0,), 10 + 2 + 20 * (1 - 6 / 8) / 2),  # 14.5: prey 1 is left
        (2, (1,), 10 + 2 + 20 * (1 - 4 / 8) / 2),  # 17: prey 0 is left
        (2, (0, 1), 25),
        (3, (), 20 * (1 - 28 / 6 / 8) / 3),  # 2.78: 20 + 4 + 4 = 28 over 6 pairs
        (3, (0,), 20 / 3 + 2 + 20 * (1 - 5 / 8) / 3),  # 11.17: 4 + 8 + 4 + 4 = 20 over 4 pairs
        (3, (0, 2), 40 / 3 + 4 + 20 * (1 - 6 / 8) / 3),  # 19: prey 1 is left
        (3, (0, 1, 2), 25),
    ],
)
def test_predator_fitness_by_hand(make_world: MakeWorld, n_prey: int, caught, expected: float) -> None:
    team = scores(make_world(PREDATORS, PREY[:n_prey], caught))[:2]
    assert team == pytest.approx([expected, expected], abs=1e-12)


@pytest.mark.parametrize(
    ("closeness", "caught", "d"),
    [
        ("uncaught", (), 1 - 20 / 4 / 8),  # 3/8: the mean over 4 pairs
        ("all", (), 1 - 20 / 4 / 8),  # the same while nobody is caught
        ("nearest", (), 1 - (2 + 4) / 2 / 8),  # 5/8: prey 0 has one at 2, prey 1 one at 4
        ("uncaught", (0,), 1 - (4 + 8) / 2 / 8),  # 1/4: the mean over the pairs of prey 1
        ("all", (0,), 1 - (0 + 0 + 4 + 8) / 4 / 8),  # 5/8: caught prey 0 counts as reached
        ("nearest", (0,), 1 - 4 / 8),  # 1/2
    ],
)
def test_each_closeness_by_hand(make_world: MakeWorld, closeness: str, caught, d: float) -> None:
    g = len(caught)
    team = scores(make_world(PREDATORS, PREY[:2], caught), closeness=closeness)[:2]
    assert team == pytest.approx([20 * g / 2 + 2 * g + 20 * d / 2] * 2, abs=1e-12)


@pytest.mark.parametrize(
    ("closeness", "caught", "d"),
    [
        ("uncaught", (), (1 - (2 + 4) / 2 / 8, 1 - (6 + 8) / 2 / 8)),
        ("all", (0,), (1 - (0 + 4) / 2 / 8, 1 - (0 + 8) / 2 / 8)),
        ("nearest", (0,), (1 - 4 / 8, 1 - 8 / 8)),
    ],
)
def test_with_individual_credit_a_predator_is_paid_for_its_own_distances(
    make_world: MakeWorld, closeness: str, caught, d: tuple[float, float]
) -> None:
    g = len(caught)
    team = scores(make_world(PREDATORS, PREY[:2], caught), closeness=closeness, credit="individual")[:2]
    assert team == pytest.approx([20 * g / 2 + 2 * g + 20 * own / 2 for own in d], abs=1e-12)


def test_with_individual_credit_a_full_catch_is_shared(make_world: MakeWorld) -> None:
    assert scores(make_world(PREDATORS, PREY[:2], (0, 1)), credit="individual")[:2] == [25, 25]


@pytest.mark.parametrize(("size", "far"), [(8, 4), (7, 3)])
@pytest.mark.parametrize("closeness", ["uncaught", "nearest"])
@pytest.mark.parametrize(("caught", "band"), [((), [0, 10]), ((0,), [12, 22]), ((0, 1), [25, 25])])
def test_both_ends_of_the_bands_of_two_prey(
    make_world: MakeWorld, size: int, far: int, closeness, *, caught, band
) -> None:
    apart = make_world([(0, 0), (0, 0)], [(far, far), (far, far)], caught)
    together = make_world([(0, 0), (0, 0)], [(0, 0), (0, 0)], caught)
    assert [scores(world, size=size, closeness=closeness)[0] for world in (apart, together)] == band


# -- prey: 25 if g = 0, 12.5 if 0 < g < n, else 12.5 rho/R -------------------------------------------------------


@pytest.mark.parametrize(
    ("n_prey", "caught", "steps", "expected"),
    [
        (1, (), 10, 25),
        (1, (0,), 4, 5),  # 12.5 * 4/10
        (2, (), 10, 25),
        (2, (1,), 10, 12.5),
        (2, (0, 1), 2, 2.5),
        (3, (0, 2), 7, 12.5),
        (3, (0, 1, 2), 10, 12.5),
    ],
)
def test_prey_fitness_by_hand(make_world: MakeWorld, n_prey: int, caught, steps: int, expected: float) -> None:
    assert scores(make_world([(5, 5)], PREY[:n_prey], caught), steps)[1:] == [expected] * n_prey


def test_free_and_caught_prey_of_a_team_score_alike_under_individual_credit(make_world: MakeWorld) -> None:
    assert scores(make_world(PREDATORS, PREY, (1,)), 5, credit="individual")[2:] == [12.5, 12.5, 12.5]


@pytest.mark.parametrize("credit", ["team", "individual"])
@pytest.mark.parametrize(
    ("caught", "expected"),
    [((), 25 - 3.75), ((0,), 25 - 14.5), ((0, 1), 0)],  # the predator teams' fitness as above
)
def test_complementary_prey_get_what_the_predator_team_misses(
    make_world: MakeWorld, credit: str, caught, expected: float
) -> None:
    world = make_world(PREDATORS, PREY[:2], caught)
    assert scores(world, 5, prey_fitness="complementary", credit=credit)[2:] == [expected, expected]


# -- every world --------------------------------------------------------------------------------------------------


@given(config=st.from_type(EnvConfig), data=st.data())
def test_fitness_grows_band_by_band_with_the_prey_caught(config: EnvConfig, data: st.DataObject) -> None:
    coordinates = st.lists(st.integers(0, config.size - 1), min_size=config.n_agents, max_size=config.n_agents)
    x, y = (np.array(data.draw(coordinates), np.int32) for _ in "xy")
    alive = np.array(data.draw(st.lists(st.integers(0, 1), min_size=config.n_prey, max_size=config.n_prey)), np.int32)
    steps = data.draw(st.integers(0, config.max_cycles))
    out = np.empty(config.n_agents)
    fitness(World(x, y, alive), steps, config.rules, out)
    predators, prey = out[: config.n_predators], out[config.n_predators :]

    g, n = int((alive == 0).sum()), config.n_prey
    lowest = 25 if g == n else 20 * g / n + 2 * g
    highest = 25 if g == n else lowest + 20 / n
    assert ((lowest - 1e-12 <= predators) & (predators <= highest + 1e-12)).all()
    assert len(set(prey)) == 1
    if config.prey_fitness == "complementary":
        assert 25 - highest - 1e-12 <= prey[0] <= 25 - lowest + 1e-12
    else:
        assert prey[0] == (25 if g == 0 else 12.5 if g < n else 12.5 * steps / config.max_cycles)
    if config.credit == "team":
        assert len(set(predators)) == 1


@pytest.mark.parametrize(("n_prey", "nearly"), [(1, 20), (2, 12 + 10), (3, 40 / 3 + 4 + 20 / 3), (4, 15 + 6 + 5)])
def test_up_to_three_prey_nothing_scores_above_a_full_catch(make_world: MakeWorld, n_prey: int, nearly: float) -> None:
    """From four prey on, the paper's formula pays more for the last step before the last catch than for the catch."""
    world = make_world([(0, 0)], [(0, 0)] * n_prey, caught=tuple(range(n_prey - 1)))
    assert scores(world)[0] == pytest.approx(nearly)
    assert (scores(world)[0] < 25) == (n_prey <= 3)
