"""The zoo that ships: whole, measured as it says, and refused where it was altered."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from esp_trainer import Team, load_team
from esp_trainer.analysis.cross_play import cross_play
from esp_trainer.analysis.inference import over_seeds
from esp_trainer.analysis.ratings import rate
from esp_trainer.config import RunConfig
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import DamagedFileError, read_arrays, write_arrays
from esp_trainer.presets import preset
from esp_trainer.seeding import stream
from esp_trainer.tasks import WORLDS
from esp_trainer.teams import zoo
from esp_trainer.teams.zoo import known_teams, load_zoo
from esp_trainer.types import ROLES, Role, ScriptedTeams, TeamBatch
from predprey_env.agents import other_team
from predprey_env.policies import SCRIPTS

TEAMS = known_teams()
NAMES = list(TEAMS)
SHIPPED = zoo.PLACE
FORM = re.compile(r"(held-out/)?[a-z]+-(3v[12]|pond|meadow|steppe)/(predators|prey)/seed-\d+-(early|middle|late)")


def test_names_say_what_teams_are():
    assert len(set(NAMES)) == len(NAMES) > 0
    for name, team in TEAMS.items():
        assert FORM.fullmatch(name)
        assert name == f"{'held-out/' * team.held_out}{team.preset}/{team.role}/seed-{team.seed}-{team.stage}"
        assert team.preset.endswith(team.task)


def test_the_directory_holds_just_what_the_index_describes():
    files = {str(path.relative_to(zoo.PLACE).with_suffix("")) for path in zoo.PLACE.rglob("*.safetensors")}
    assert files == {*NAMES, *(f"cross-play-{task}" for task in WORLDS)}


def test_each_task_has_teams_of_both_sides_in_every_stage_held_out_and_not():
    kinds = {(team.task, team.role, team.stage, team.held_out) for team in TEAMS.values()}
    assert len(kinds) == len(WORLDS) * 2 * 3 * 2


def test_the_seeds_of_held_out_teams_are_nobody_elses():
    held_out = {team.seed for team in TEAMS.values() if team.held_out}
    assert not held_out & {team.seed for team in TEAMS.values() if not team.held_out}


@pytest.mark.parametrize("name", NAMES[::5])
def test_a_team_plays_its_role_in_its_task_and_says_where_it_came_from(name: str):
    team, known = load_team(name), TEAMS[name]
    team.check_fits(known.role, WORLDS[known.task])
    origin = team.provenance
    config = preset(known.preset).replace(seed=known.seed, generations=origin["generations"])
    # Settings that are younger than the team have their defaults.
    assert RunConfig.from_dict({field: origin[field] for field in config.model_dump() if field in origin}) == config
    assert (origin["generation"], origin["zoo"]["name"]) == (known.generation, name)
    for measure in ("score", "rating"):
        rated = getattr(known, measure)
        assert origin["zoo"][measure] == [rated.rate, rated.low, rated.high]
    assert origin["commit"]


def _teams(name: str, role: Role) -> TeamBatch:
    return ScriptedTeams(name) if name in SCRIPTS[role] else load_team(name).as_teams(1)


@pytest.mark.parametrize("task", WORLDS)
def test_the_matrix_is_what_a_replay_gives(task: str):
    known, evaluator = load_zoo(task), FusedEvaluator(WORLDS[task])
    for row in (0, 7, len(known.predators) - 1):
        for column in (1, 12, len(known.prey) - 1):
            sides = _teams(known.predators[row], "predators"), _teams(known.prey[column], "prey")
            played = cross_play(*sides, evaluator, n_episodes=known.n_episodes, seed=2)
            assert played.captured.sum() == known.captured[row, column]


@pytest.mark.parametrize("task", WORLDS)
def test_scores_and_ratings_follow_from_the_matrix(task: str):
    known = load_zoo(task)
    assert known.n_prey == WORLDS[task].n_prey
    ratings = rate(known.caught, known.n_episodes, stream(0, "zoo ratings"))
    for role, rated in zip(ROLES, ratings, strict=True):
        names, others = known.names(role), known.names(other_team(role))
        scores = known.caught if role == "predators" else 1 - known.caught.T
        evolved = [name not in SCRIPTS[other_team(role)] for name in others]
        assert set(names) == {t.name for t in known.teams if t.role == role} | set(SCRIPTS[role])
        for row, name in enumerate(names):
            if name in TEAMS:
                score = over_seeds(scores[row, evolved])
                team = TEAMS[name]
                assert (team.score.rate, team.score.low, team.score.high) == pytest.approx(
                    (score.mean, score.low, score.high), rel=1e-12
                )
                expected = [values[row] for values in (rated.rating, rated.low, rated.high)]
                np.testing.assert_allclose([team.rating.rate, team.rating.low, team.rating.high], expected, atol=1e-6)


# What was altered, lost or misspelt.


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of some of the zoo, read instead of it."""
    place = tmp_path / "zoo"
    for name in (f"{NAMES[0]}.safetensors", f"{NAMES[1]}.safetensors", "index.json"):
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(zoo.PLACE / name, place / name)
    monkeypatch.setattr(zoo, "PLACE", place)
    caches = (zoo.load_zoo, zoo._index)
    for cache in caches:
        cache.cache_clear()
    yield place
    for cache in caches:
        cache.cache_clear()


def _matrix(copied: Path) -> Path:
    name = "cross-play-3v1.safetensors"
    return Path(shutil.copy(SHIPPED / name, copied / name))


def test_a_file_that_was_altered_is_refused(copied: Path):
    """Also one that is a whole team: the digest of the index is what counts."""
    path = copied / f"{NAMES[0]}.safetensors"
    assert load_team(NAMES[0]).role == TEAMS[NAMES[0]].role
    team = Team.load(path)
    Team(team.role, team.side, team.controller, team.genomes * np.float32(1.01)).save(path)
    with pytest.raises(DamagedFileError, match=r"^\S+ was altered: it is not the file that the zoo's index describes$"):
        load_team(NAMES[0])


def test_a_file_that_is_lost_is_told(copied: Path):
    (copied / f"{NAMES[1]}.safetensors").unlink()
    with pytest.raises(FileNotFoundError, match=r"^\S+ is not there: the package is not installed whole$"):
        load_team(NAMES[1])


@pytest.mark.parametrize("content", [b"{", b"[]", b"{}", b'{"teams": [{"name": "x"}]}', b'{"teams": 3}'])
def test_a_damaged_index_is_told_in_one_line(content: bytes, copied: Path):
    (copied / "index.json").write_bytes(content)
    with pytest.raises(DamagedFileError, match=r"^\S+index\.json is damaged: .+") as refused:
        known_teams()
    assert "\n" not in str(refused.value)


def test_a_name_that_there_is_not_gets_the_nearest():
    name = NAMES[0]
    with pytest.raises(ValueError, match=f"^unknown team {name}x; did you mean {name}"):
        load_team(f"{name}x")
    with pytest.raises(ValueError, match=r"^unknown team 0; nothing is named like it$"):
        load_team("0")


def test_a_task_that_there_is_not_is_told_with_those_that_there_are():
    with pytest.raises(ValueError, match=r"^task must be one of 3v1, 3v2, meadow, pond, steppe, got '2v2'$"):
        load_zoo("2v2")


def test_the_digest_of_the_zoo_is_that_of_its_index():
    data = (zoo.PLACE / "index.json").read_bytes()
    assert load_zoo("3v1").digest == load_zoo("3v2").digest == hashlib.sha256(data).hexdigest()
    assert json.loads(data)["versions"]["predprey-esp"]


def test_every_file_is_the_one_that_the_index_describes():
    digests = {n: hashlib.sha256((zoo.PLACE / f"{n}.safetensors").read_bytes()).hexdigest() for n in NAMES}
    assert digests == {name: team.digest for name, team in TEAMS.items()}


@pytest.mark.parametrize("at", [0, 200, -1])
def test_a_single_byte_that_was_changed_is_noticed(at: int, copied: Path):
    path = copied / f"{NAMES[0]}.safetensors"
    data = bytearray(path.read_bytes())
    data[at] ^= 1
    path.write_bytes(data)
    with pytest.raises(DamagedFileError, match=r"^\S+ was altered: ") as refused:
        load_team(NAMES[0])
    assert "\n" not in str(refused.value)


def test_an_index_that_is_lost_is_told_with_its_name(copied: Path):
    (copied / "index.json").unlink()
    with pytest.raises(FileNotFoundError) as refused:
        known_teams()
    assert "index.json" in str(refused.value)


@pytest.mark.parametrize("at", [200, -100])
def test_a_matrix_that_is_damaged_is_refused(at: int, copied: Path):
    path = _matrix(copied)
    data = bytearray(path.read_bytes())
    data[at] ^= 16
    path.write_bytes(data)
    with pytest.raises(DamagedFileError) as refused:
        load_zoo("3v1")
    assert "\n" not in str(refused.value)
    assert path.name in str(refused.value)


def test_a_matrix_of_another_zoo_is_refused(copied: Path):
    """Ratings, gains and what is exploited follow from it, and tables name the zoo by the digest of its index."""
    path = _matrix(copied)
    header, arrays = read_arrays(path, "zoo cross-play")
    write_arrays(path, "zoo cross-play", header, {"captured": arrays["captured"][:, ::-1]})
    with pytest.raises(DamagedFileError):
        load_zoo("3v1")
