"""Everything that a run depends on, in one frozen tree. The same config and seed give the same bytes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, model_validator

from predprey_env.config import EnvConfig, TeamName
from predprey_env.policies import SCRIPTS, PredatorScript, PreyScript
from predprey_env.settings import Settings, field_names, flat, unknown_field


class SideConfig(Settings):
    """Who plays one side: evolved controllers, or a script."""

    policy: Literal["esp", PredatorScript, PreyScript] = "esp"
    """`esp` evolves the side; predators or prey may instead follow one of their scripts."""

    controller: Literal["split", "monolithic", "combiner", "double", "pairs", "central"] = "split"
    """One network for each opponent, outputs summed per action (section VI); one network that sees all of them; one for
    each and a further network that reads their outputs and decides (section VIII); two for each; one for each pair; or
    one network that sees what the whole team sees and steers all of it (Yong & Miikkulainen, section III)."""

    n_hidden: int = Field(default=10, ge=1)
    """Hidden neurons of each network (section V)."""

    bias: bool = False
    """Whether hidden neurons have a bias gene."""

    output: Literal["logistic", "linear"] = "logistic"
    """Activation of the output neurons."""

    choice: Literal["most_votes", "drawn"] = "most_votes"
    """How votes become an action: the one with the most (section VI), or one that is drawn, with chances in proportion
    to e to the power of the votes, which opponents cannot foresee."""

    input_scale: float = Field(default=1.0, ge=1e-6, le=1e6)
    """Factor on the offsets that a network reads, in 1/cells; 1 feeds raw cells."""

    captured_vote: Literal["zero", "skip"] = "zero"
    """What the network of a caught prey does: it votes on the offset (0, 0), or it has no vote."""


_PAIRINGS: dict[str, dict[str, Any]] = {
    "cosample": {"past_share": 0.0},
    "previous_champion": {"past_share": 1.0, "past_choice": "latest"},
    "hall_of_fame": {"past_share": 1.0, "past_choice": "uniform"},
    "mixed": {"past_share": 0.5, "past_choice": "uniform"},
}
"""What the field ``pairing`` of earlier versions meant."""


class EspConfig(Settings):
    """Enforced SubPopulations: the parameters of section V."""

    subpopulation_size: int = Field(default=100, ge=4)
    """Neurons in each subpopulation."""

    init_range: float = Field(default=6.0, gt=0, le=1e6)
    """Initial genes are uniform in [-init_range, init_range]."""

    n_trials: int = Field(default=1000, ge=1)
    """Trials a generation; in each, a team is drawn with replacement from the subpopulations."""

    n_episodes: int = Field(default=6, ge=1)
    """Episodes a trial, each from a random start; their fitnesses are averaged."""

    past_share: float = Field(default=0.0, ge=0, le=1)
    """Share of a trial's episodes against past champions of the other side, in whole episodes. The others are against
    the other side's team of the same trial, and score both. The first generation has no champions to meet yet,
    unless there is a league of other runs, and a script has none."""

    past_choice: Literal["uniform", "recent", "latest", "spread", "contested"] = "uniform"
    """Which past champions: any in the hall of fame; later ones more often, in proportion to their generation; the
    latest; those of every strength equally often; or mostly those that win as often as they lose. Champions of a league
    count as generation 0, and are the latest only while the run has none of its own."""

    past_each_episode: bool = False
    """Whether each episode of a trial meets a past champion of its own; else all of a trial meet the same."""

    block_size: int = Field(default=1, ge=1)
    """Trials in turn that have the same starts and past champions. What counts is then how much more a team earned than
    the mean of its block, so that nobody breeds for an easy start; 1 counts the fitness as it is (section V)."""

    memory: float = Field(default=0.0, ge=0, lt=1)
    """How much of a neuron's earlier trials counts in the next generation; 0 scores neurons by the mean fitness of one
    generation's trials (section V)."""

    prior_trials: float = Field(default=0.0, ge=0, le=1e9)
    """Trials of mean fitness that each neuron is scored with besides its own, so that few lucky trials count less."""

    wait_above: float = Field(default=1.0, gt=0, le=1)
    """A side that wins more than this fraction of its trials does not breed in that generation, so that the other can
    catch up. Predators win as far as they catch the prey, prey as far as they are not caught; 1 for never."""

    fitness_sharing: bool = False
    """Competitive fitness sharing (Rosin & Belew 1997): what a team earns counts as its share of all that was earned
    against the same opponents, so that beating one that few beat is worth more. Here opponents are known by their
    neurons, as teams of the same trial are met only once."""

    elite_share: float = Field(default=0.25, gt=0, le=1 / 3)
    """Share of each subpopulation that breeds; its children, two a pair, replace the worst."""

    mate: Literal["uniform", "better_ranked"] = "uniform"
    """Who a breeding neuron's mate is: any of the elite, or one that ranks no worse than itself."""

    hof_mates: int = Field(default=5, ge=0)
    """How many pairs, the lowest ranked, mate with the neuron in the same place of a past champion instead."""

    hof_size: int = Field(default=1000, ge=2)
    """Champions of a side that are kept, in memory and on disk. When there are more, every second goes, then every
    second of those and so on; the last stays."""

    mutation_rate: float = Field(default=0.4, ge=0, le=1)
    """Probability that a child has one gene changed."""

    mutation_scale: float = Field(default=0.3, gt=0, le=1e6)
    """Scale of the Cauchy-distributed change."""

    mutation_limit: float = Field(default=10.0, gt=0, le=1e6)
    """Changes larger than this are drawn again."""

    burst_after: int = Field(default=0, ge=0)
    """Generations without a higher champion score after which all subpopulations start again around the last champion;
    0 for never."""

    burst_scale: float = Field(default=0.3, gt=0, le=1e6)
    """Scale of the Cauchy-distributed spread around the champion after a burst."""

    @model_validator(mode="before")
    @classmethod
    def _of_pairing(cls, fields: Any) -> Any:
        """Take the field that named the opponents in earlier versions."""
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
        """Episodes of a trial against past champions."""
        return int(self.past_share * self.n_episodes + 0.5)

    @property
    def n_elite(self) -> int:
        """Neurons of each subpopulation that breed."""
        return int(self.elite_share * self.subpopulation_size + 1e-9)  # 0.29 * 100 is 28.999...


class ChampionConfig(Settings):
    """How each generation's best teams are chosen and measured."""

    method: Literal["reevaluate", "argmax"] = "reevaluate"
    """Replay the best trial teams of both sides against each other on fresh starts, or trust their trial scores."""

    n_candidates: int = Field(default=20, ge=1)
    """Teams of each side that are replayed; each meets all of the other side's."""

    n_episodes: int = Field(default=1, ge=1)
    """Episodes of each such meeting."""

    n_past: int = Field(default=0, ge=0)
    """Past champions of the other side, chosen by `esp.past_choice`, that all of the replayed teams also meet."""

    n_held_out: int = Field(default=200, ge=1)
    """Episodes, from the same held-out starts in every generation, in which champion meets champion."""


class RunConfig(Settings):
    """A whole run."""

    preset: str = "custom"
    """Name of the preset that this began as."""

    seed: int = Field(default=0, ge=0, lt=2**63)
    """Every random number follows from this."""

    generations: int = Field(default=450, ge=1)
    """Generations to evolve."""

    checkpoint_every: int = Field(default=10, ge=1)
    """Generations between checkpoints: the most that a killed run loses."""

    league: str = ""
    """SHA-256 of the champions of other runs that are in the opponent pools; empty without any."""

    env: EnvConfig = EnvConfig()
    """The world."""

    predators: SideConfig = SideConfig()
    """Who hunts."""

    prey: SideConfig = SideConfig()
    """Who flees."""

    esp: EspConfig = EspConfig()
    """How they evolve."""

    champion: ChampionConfig = ChampionConfig()
    """How the best are found."""

    @model_validator(mode="after")
    def _plays(self) -> RunConfig:
        policies: dict[TeamName, str] = {"predators": self.predators.policy, "prey": self.prey.policy}
        for team, policy in policies.items():
            if policy not in ("esp", *SCRIPTS[team]):
                raise ValueError(f"{team}.policy must be one of esp, {', '.join(SCRIPTS[team])}, got {policy!r}")
        if "esp" not in (self.predators.policy, self.prey.policy):
            raise ValueError("at least one of predators.policy and prey.policy must be 'esp', got two scripts")
        return self

    def with_fields(self, fields: Mapping[str, Any]) -> RunConfig:
        """A validated copy with some fields changed, by their names with dots, ``{"esp.n_trials": 200}``, or by
        sections, ``{"esp": {"n_trials": 200}}``.
        """
        if not isinstance(fields, Mapping):
            raise ValueError(f"fields must be a mapping from names of fields to values, got {fields!r}")
        whole = self.model_dump()
        for name, value in flat(fields).items():
            *path, leaf = name.split(".")
            section = whole
            for part in path:
                section = section.setdefault(part, {})
                if not isinstance(section, dict):
                    raise ValueError(unknown_field(name, field_names(RunConfig)))
            section[leaf] = value
        return RunConfig.from_dict(whole)
