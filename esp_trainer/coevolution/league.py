"""A league of seeds: champions of other runs in the opponent pools of a run.

The other runs began from other seeds, so their champions may play in ways that the run's own champions never show. This
is league training (Vinyals et al. 2019) without training the league.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from esp_trainer.arrays import TeamGenomes
from esp_trainer.config import RunConfig
from esp_trainer.files import DamagedFileError, digest_of_arrays, read_arrays, write_arrays
from esp_trainer.types import ROLES, Role


@dataclass(frozen=True)
class LeagueSource:
    """A run that champions of a league come from."""

    path: str
    preset: str
    seed: int
    generations: tuple[int, ...]
    """Generations whose champions were taken, for each side that evolved."""


@dataclass(frozen=True, eq=False)
class League:
    """Champions of other runs, by the side that they play. They never breed, and never leave the pool."""

    genomes: Mapping[Role, TeamGenomes] = field(default_factory=dict, repr=False)
    """float32 ``(n_champions, n_agents, n_networks, n_hidden, n_genes)``, run by run."""
    sources: tuple[LeagueSource, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "genomes", {role: _fixed(genomes) for role, genomes in self.genomes.items()})

    @property
    def digest(self) -> str:
        """SHA-256 of the genomes; empty for a league without champions."""
        return digest_of_arrays(self._arrays()) if self.genomes else ""

    def enter(self, config: RunConfig) -> RunConfig:
        """Return the config of a run that has this league.

        Raises :class:`ValueError` if the run would never play against it, or if the config names another league.
        """
        if config.league not in ("", self.digest):
            raise ValueError(f"the config names the league {config.league}, got {self.digest or 'none'}")
        if self.genomes:
            _check_meets(config)
        return config.replace(league=self.digest)

    def save(self, path: Path) -> None:
        """Write the league to one file."""
        sources = [asdict(source) for source in self.sources]
        write_arrays(path, "league", {"sources": sources}, self._arrays())

    def _arrays(self) -> dict[str, TeamGenomes]:
        return {role: self.genomes[role] for role in ROLES if role in self.genomes}

    @classmethod
    def load(cls, path: Path, digest: str) -> League:
        """Read the league with a digest. The empty digest stands for no league, which needs no file.

        Raises :class:`FileNotFoundError` if the file is missing, :class:`DamagedFileError` if it holds anything else.
        """
        if not digest:
            return NO_LEAGUE
        header, arrays = read_arrays(path, "league")
        try:
            sources = tuple(
                LeagueSource(**{**each, "generations": tuple(each["generations"])}) for each in header["sources"]
            )
        except (KeyError, TypeError) as error:
            raise DamagedFileError(f"{path} is not a usable league: its sources are damaged: {error}") from None
        league = cls({role: arrays[role] for role in ROLES if role in arrays}, sources)
        if league.digest != digest:
            raise DamagedFileError(f"{path} holds another league: {league.digest}, and the run's is {digest}")
        return league


NO_LEAGUE = League()
"""League of a run whose opponent pools hold only its own champions."""


def _fixed(genomes: TeamGenomes) -> TeamGenomes:
    """Return a read-only copy, which the halls of fame of all generations share."""
    copied = np.array(genomes, np.float32)
    copied.flags.writeable = False
    return copied


def _check_meets(config: RunConfig) -> None:
    """Raise :class:`ValueError` unless a run plays against past champions."""
    policies: dict[Role, str] = {"predators": config.predators.policy, "prey": config.prey.policy}
    for role, policy in policies.items():
        if policy != "esp":
            raise ValueError(f"a league has no effect unless both sides evolve, got {role}.policy={policy}")
    chosen_by_past = config.champion.method == "reevaluate" and config.champion.n_past
    if not (config.esp.past_share or chosen_by_past):
        raise ValueError("a league has no effect without esp.past_share or champion.n_past above 0")
