"""The parameters of evolution, and the earlier name of one of them."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from predprey_env.settings import Settings

_PAIRINGS: dict[str, dict[str, Any]] = {
    "cosample": {"past_share": 0.0},
    "previous_champion": {"past_share": 1.0, "past_choice": "latest"},
    "hall_of_fame": {"past_share": 1.0, "past_choice": "uniform"},
    "mixed": {"past_share": 0.5, "past_choice": "uniform"},
}
"""Value of the field ``pairing`` of earlier versions -> fields that replace it."""


class EspConfig(Settings):
    """Enforced SubPopulations: the parameters of section V."""

    subpopulation_size: int = Field(default=100, ge=4)
    """Number of neurons in each subpopulation."""

    init_range: float = Field(default=6.0, gt=0, le=1e6)
    """Range of the initial genes, which are uniform in [-init_range, init_range]."""

    n_trials: int = Field(default=1000, ge=1)
    """Number of trials per generation; the team of each is sampled with replacement from the subpopulations."""

    n_episodes: int = Field(default=6, ge=1)
    """Number of episodes per trial, each from a random start; their fitnesses are averaged."""

    past_share: float = Field(default=0.0, ge=0, le=1)
    """Fraction of a trial's episodes that are against past champions of the other side, in whole episodes. The others
    are against the other side's team of the same trial, and score both teams. The first generation has no past
    champions to play, unless there is a league of other runs, and a script has none."""

    past_choice: Literal["uniform", "recent", "latest", "spread", "contested", "hard"] = "uniform"
    """Choice of the past champions. `uniform`: any in the hall of fame. `recent`: later ones more often, in proportion
    to their generation. `latest`: the latest. `spread`: those of every strength equally often. `contested`: mostly
    those that win as often as they lose. `hard`: mostly those that win. Exploiters and champions of a league count as
    generation 0, and are the latest only while the run has no champion."""

    past_each_episode: bool = False
    """True if each episode of a trial is against a past champion of its own; False if all are against the same one."""

    block_size: int = Field(default=1, ge=1)
    """Number of trials in a row that have the same starts and past champions. The fitness of a team is then its
    difference from the mean of its block, so that no neuron is selected for an easy start. With 1, fitness counts as it
    is (section V)."""

    memory: float = Field(default=0.0, ge=0, lt=1)
    """Weight of a neuron's earlier trials in the next generation; 0 scores neurons by the mean fitness of one
    generation's trials (section V)."""

    prior_trials: float = Field(default=0.0, ge=0, le=1e9)
    """Number of trials of mean fitness that a neuron is scored with besides its own, so that few lucky trials count
    less."""

    exploiters_every: int = Field(default=0, ge=0)
    """Generations after which each side's pool gets an exploiter, 0 for never: the champion of a fresh population that
    has evolved against the other side's present champion alone (Vinyals et al. 2019)."""

    exploiter_generations: int = Field(default=20, ge=1)
    """Generations that an exploiter evolves."""

    fitness_sharing: bool = False
    """Competitive fitness sharing (Rosin & Belew 1997): a team's fitness counts as its share of all fitness earned
    against the same opponents, so that beating an opponent that few beat is worth more. Opponents are identified by
    their neurons, because each team of a trial is an opponent only once."""

    elite_share: float = Field(default=0.25, gt=0, le=1 / 3)
    """Fraction of each subpopulation that breeds; its children, two for each pair, replace the worst neurons."""

    mate: Literal["uniform", "better_ranked"] = "uniform"
    """Mate of a breeding neuron: `uniform` takes any of the elite, `better_ranked` one that ranks no worse."""

    hof_mates: int = Field(default=5, ge=0)
    """Number of pairs, the lowest ranked, whose mate is instead the neuron in the same place of a past champion."""

    hof_size: int = Field(default=1000, ge=2)
    """Largest number of champions of a side that are kept, in memory and on disk. When there are more, every second is
    dropped, then every second of the rest and so on; the last always stays."""

    mutation_rate: float = Field(default=0.4, ge=0, le=1)
    """Probability that a child has one gene changed."""

    mutation_scale: float = Field(default=0.3, gt=0, le=1e6)
    """Scale of the Cauchy-distributed change."""

    mutation_limit: float = Field(default=10.0, gt=0, le=1e6)
    """Largest change; larger ones are sampled again."""

    burst_after: int = Field(default=0, ge=0)
    """Number of generations without a higher champion score after which all subpopulations start again around the last
    champion; 0 for never."""

    burst_scale: float = Field(default=0.3, gt=0, le=1e6)
    """Scale of the Cauchy-distributed spread around the champion after a burst."""

    @model_validator(mode="before")
    @classmethod
    def _of_pairing(cls, fields: Any) -> Any:
        """Translate the field ``pairing``, which named the opponents in earlier versions."""
        if not isinstance(fields, dict) or "pairing" not in fields:
            return fields
        name = fields["pairing"]
        if name not in _PAIRINGS:
            known = ", ".join(_PAIRINGS)
            raise ValueError(f"pairing, an earlier name for past_share, must be one of {known}, got {name!r}")
        return {**{other: value for other, value in fields.items() if other != "pairing"}, **_PAIRINGS[name]}

    @model_validator(mode="after")
    def _meets(self) -> EspConfig:
        if (self.past_share > 0 and not self.n_past) or (self.past_share < 1 and self.n_past == self.n_episodes):
            raise ValueError(
                f"past_share must be a share of n_episodes={self.n_episodes} in whole episodes, got {self.past_share}"
            )
        if self.block_size > self.n_trials:
            raise ValueError(f"block_size must be at most n_trials={self.n_trials}, got {self.block_size}")
        return self

    @model_validator(mode="after")
    def _breeds(self) -> EspConfig:
        if self.n_elite < 1:
            size = self.subpopulation_size
            raise ValueError(f"elite_share must select a neuron of {size}, got {self.elite_share}")
        if self.hof_mates > self.n_elite:
            raise ValueError(f"hof_mates must be at most the {self.n_elite} breeding pairs, got {self.hof_mates}")
        return self

    @property
    def n_past(self) -> int:
        """Number of episodes of a trial against past champions."""
        return int(self.past_share * self.n_episodes + 0.5)

    @property
    def n_elite(self) -> int:
        """Number of neurons of each subpopulation that breed."""
        return int(self.elite_share * self.subpopulation_size + 1e-9)  # 0.29 * 100 is 28.999...
