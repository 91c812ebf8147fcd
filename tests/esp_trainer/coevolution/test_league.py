"""Champions of other runs in the opponent pools: when they are met, what is remembered, and who is bred."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.league import NO_LEAGUE, League, LeagueSource
from esp_trainer.coevolution.sides import new_sides
from esp_trainer.config import ChampionConfig, EspConfig, RunConfig, SideConfig
from esp_trainer.esp.team import gather_genomes
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import DamagedFileError, digest_of_arrays
from esp_trainer.types import ROLES, Role, TrialBatch, TrialResult
from predprey_env import EnvConfig
from predprey_env.agents import other_team

OWN, GUESTS = 3, (7.0, 8.0)


def small(n_past: int = 0, **esp: Any) -> RunConfig:
    return RunConfig(
        env=EnvConfig(size=6, max_cycles=12),
        predators=SideConfig(n_hidden=3),
        prey=SideConfig(n_hidden=3),
        esp=EspConfig(**{"subpopulation_size": 12, "n_trials": 40, "n_episodes": 2, "hof_mates": 3, **esp}),
        champion=ChampionConfig(n_candidates=3, n_held_out=16, n_past=n_past),
    )


def league(config: RunConfig, *roles: Role) -> League:
    """Two guests of each side (by default of both), all of whose genes are 7 and 8."""
    genomes = {}
    for role in roles or ROLES:
        like = new_sides(config)[role].hall_of_fame.champions.shape[1:]
        genomes[role] = np.stack([np.full(like, gene, np.float32) for gene in GUESTS])
    return League(genomes, (LeagueSource("runs/a", "custom", 3, (0, 9)),))


class Spy(FusedEvaluator):
    """Plays, and remembers both sides' teams of each batch, and what came of it."""

    def __init__(self, env: EnvConfig) -> None:
        super().__init__(env, 1)
        self.teams: list[dict[Role, np.ndarray]] = []
        self.results: list[TrialResult] = []

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        self.teams.append({role: gather_genomes(getattr(batch, role), np.arange(len(batch.starts))) for role in ROLES})
        self.results.append(super().evaluate(batch))
        return self.results[-1]


def first_gene(teams: np.ndarray) -> np.ndarray:
    return teams.reshape(len(teams), -1)[:, 0]


def begun(config: RunConfig, guests: League | None = None) -> tuple[Coevolution, Spy]:
    """A run with these guests, or those of both sides."""
    evaluator = Spy(config.env)
    return Coevolution(config, new_sides(config, guests or league(config)), evaluator), evaluator


def first_generation(config: RunConfig) -> tuple[Coevolution, Spy]:
    run, evaluator = begun(config)
    run.step(0)
    return run, evaluator


# -- who is met ------------------------------------------------------------------------------------------------------


def test_generation_0_meets_the_guests_and_their_results_are_remembered():
    run, evaluator = first_generation(small(past_share=0.5))
    # Trials of both sides together, of each against the guests of the other, candidates, and champion by champion.
    assert len(evaluator.teams) == 1 + 2 + 1 + 1
    for batch, role in ((1, "predators"), (2, "prey")):
        met = first_gene(evaluator.teams[batch][other_team(role)])
        assert set(met) == set(GUESTS)
        captured = evaluator.results[batch].captured.mean(axis=(1, 2))
        won = captured if role == "prey" else 1 - captured
        fame = run.evolving[other_team(role)].hall_of_fame
        expected = [[won[met == gene].sum(), (met == gene).sum()] for gene in GUESTS]
        assert fame.met == pytest.approx(np.array([*expected, [0.0, 0.0]]))


def test_later_generations_meet_guests_and_champions_of_the_run():
    config = small(past_share=1.0, past_each_episode=True)
    run, evaluator = begun(config)
    champions = [run.step(number).champions["prey"].genomes for number in range(2)]
    before = len(evaluator.teams)
    run.step(2)
    met = evaluator.teams[before]["prey"]
    times = [int((met == team).all(axis=(1, 2, 3, 4)).sum()) for team in champions]
    times += [int((first_gene(met) == gene).sum()) for gene in GUESTS]
    assert sum(times) == 80
    assert all(10 <= each <= 30 for each in times), "uniform over four"


def test_candidates_of_generation_0_meet_guests():
    _, evaluator = first_generation(small(n_past=4))
    assert len(evaluator.teams) == 1 + 1 + 2 + 1
    for batch, role in ((2, "predators"), (3, "prey")):
        met = first_gene(evaluator.teams[batch][other_team(role)])
        assert len(met) == 3 * 4
        assert set(met) <= set(GUESTS)


def test_trials_of_generation_0_meet_no_past_if_only_one_side_has_guests():
    """Both sides have as many episodes together, so that neither can do without."""
    config = small(past_share=0.5, n_past=4)
    run, evaluator = begun(config, league(config, "predators"))
    run.step(0)
    assert [len(teams["prey"]) for teams in evaluator.teams] == [40, 9, 12, 16]
    assert set(first_gene(evaluator.teams[2]["predators"])) <= set(GUESTS)  # the prey's candidates
    before = len(evaluator.teams)
    run.step(1)
    assert len(evaluator.teams) == before + 1 + 2 + 1 + 2 + 1


@pytest.mark.parametrize("fields", [{}, {"past_share": 1.0, "past_choice": "latest"}])
def test_breeding_uses_champions_of_the_run_only(fields: dict[str, Any]):
    """Mates of generation 1 are of generation 0, whose champions hold no gene of a guest."""
    config = small(**{"mutation_rate": 0.0, **fields})
    run, _ = begun(config)
    for number in range(3):
        run.step(number)
    for side in run.evolving.values():
        assert not np.isin(side.algorithm.genomes, GUESTS).any()
        assert not np.isin(side.hall_of_fame.champions, GUESTS).any()


def test_a_full_hall_of_fame_thins_its_own_champions_and_keeps_the_guests():
    config = small(past_share=0.5, hof_size=OWN)
    run, _ = begun(config)
    for number in range(6):
        run.step(number)
    for side in run.evolving.values():
        assert first_gene(side.hall_of_fame.members(np.array([0, 1]))).tolist() == [*GUESTS]
        assert side.hall_of_fame.generations.tolist() == [0, 0, 0, 4, 5]


# -- the league itself -----------------------------------------------------------------------------------------------


def test_a_league_is_named_by_the_digest_of_its_genomes():
    config = small(past_share=0.5)
    guests = league(config)
    assert guests.digest == digest_of_arrays({role: guests.genomes[role] for role in ROLES})
    assert len(guests.digest) == 64
    assert guests.enter(config) == config.replace(league=guests.digest)
    assert guests.enter(guests.enter(config)) == guests.enter(config)
    elsewhere = League(guests.genomes, (LeagueSource("copied/a", "custom", 3, (0, 9)),))
    assert elsewhere.digest == guests.digest
    assert league(config, "prey").digest not in ("", guests.digest)


def test_no_league_has_no_digest_and_leaves_a_config_as_it_is():
    assert NO_LEAGUE.digest == ""
    for config in (small(), small(past_share=0.5)):
        assert NO_LEAGUE.enter(config) == config


def test_what_comes_in_is_copied_and_cannot_be_written_to():
    genomes = {"prey": np.zeros((1, 2, 2, 2, 2), np.float32)}
    guests = League(genomes)
    genomes["prey"][:] = 5
    assert (guests.genomes["prey"] == 0).all()
    with pytest.raises(ValueError, match="read-only"):
        guests.genomes["prey"][:] = 5


NO_EFFECT = "a league has no effect without esp.past_share or champion.n_past above 0"


@pytest.mark.parametrize(
    ("config", "line"),
    [
        (small(), NO_EFFECT),
        (small().replace(champion=ChampionConfig(method="argmax", n_past=3)), NO_EFFECT),
        (
            small(past_share=0.5).replace(prey=SideConfig(policy="flee_nearest")),
            "a league has no effect unless both sides evolve, got prey.policy=flee_nearest",
        ),
    ],
    ids=["no past opponents", "champions that nobody replays", "a script"],
)
def test_a_run_that_would_never_meet_its_league_is_refused(config: RunConfig, line: str):
    with pytest.raises(ValueError, match=f"^{re.escape(line)}$"):
        league(small()).enter(config)


@pytest.mark.parametrize("config", [small(past_share=0.5), small(n_past=1)], ids=["trials", "candidates"])
def test_either_trials_or_candidates_are_enough_to_meet_a_league(config: RunConfig):
    assert league(config).enter(config).league


def test_a_config_that_names_another_league_is_refused():
    config = small(past_share=0.5)
    with pytest.raises(ValueError, match=rf"^the config names the league abc, got {league(config).digest}$"):
        league(config).enter(config.replace(league="abc"))
    with pytest.raises(ValueError, match=r"^the config names the league abc, got none$"):
        NO_LEAGUE.enter(config.replace(league="abc"))


def test_a_league_comes_back_from_its_file(tmp_path: Path):
    guests = league(small())
    guests.save(tmp_path / "league")
    again = League.load(tmp_path / "league", guests.digest)
    assert again.sources == guests.sources
    assert list(again.genomes) == list(guests.genomes)
    assert all((again.genomes[role] == guests.genomes[role]).all() for role in ROLES)
    assert League.load(tmp_path / "none", "") is NO_LEAGUE


def test_a_file_that_is_missing_damaged_or_another_league_is_refused_in_one_line(tmp_path: Path):
    file, guests = tmp_path / "league", league(small())
    with pytest.raises(FileNotFoundError, match=rf"^{file} is not there$"):
        League.load(file, guests.digest)
    league(small(), "prey").save(file)
    with pytest.raises(DamagedFileError, match=rf"^{file} holds another league: \w{{64}}, and the run's is \w{{64}}$"):
        League.load(file, guests.digest)
    guests.save(file)
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(DamagedFileError, match=rf"^{file} is damaged: "):
        League.load(file, guests.digest)
