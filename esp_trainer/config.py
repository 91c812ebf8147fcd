"""The config of a run: all its parameters, as one tree of frozen objects.

The same config and seed give the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from esp_trainer.game import GameConfig
from predprey_env.config import EnvConfig, TeamName
from predprey_env.policies import SCRIPTS, PredatorScript, PreyScript
from predprey_env.settings import Settings, field_names, flat, unknown_field


class SideConfig(Settings):
    """Settings of one side: evolved controllers, or a script."""

    policy: Literal["esp", PredatorScript, PreyScript] = "esp"
    """Policy of the side: `esp` evolves it; predators or prey may instead follow one of their scripts."""

    algorithm: str = "esp"
    """Algorithm that evolves the side: `esp`, the paper's; `cosyne`, which has a subpopulation for each gene; `ga`, a
    genetic algorithm on whole teams; `openai_es` and `cma_es`, evolution strategies; or one of your own, as
    `module:Class`. Those parameters of `esp` count that it has a meaning for."""

    algorithm_options: dict[str, bool | int | float | str] = Field(default={})
    """Options of the algorithm, by name."""

    controller: Literal["split", "monolithic", "combiner", "double", "pairs", "central"] = "split"
    """Networks of each agent. `split`: one for each opponent, outputs summed per action (section VI). `monolithic`: one
    that sees all opponents. `combiner`: one for each opponent, and a further network that reads their outputs and
    decides (section VIII). `double`: two for each opponent. `pairs`: one for each pair of opponents. `central`: one
    network that sees what the whole team sees and controls all of its agents (Yong & Miikkulainen, section III)."""

    network: str = "feedforward"
    """Kind of these networks: `feedforward`, the paper's; `elman`, whose hidden neurons also read all
    hidden activations of the previous step, so that an agent remembers; or one of your own, as `module:Class`."""

    n_hidden: int = Field(default=10, ge=1)
    """Number of hidden neurons of each network (section V)."""

    bias: bool = False
    """True if hidden neurons have a bias gene."""

    output: Literal["logistic", "linear"] = "logistic"
    """Activation of the output neurons."""

    choice: Literal["most_votes", "drawn"] = "most_votes"
    """Choice of the action: `most_votes` takes the action with the most votes (section VI); `drawn` samples it with
    probabilities proportional to the exponential of the votes, so that opponents cannot foresee it."""

    input_scale: float = Field(default=1.0, ge=1e-6, le=1e6)
    """Factor on the offsets that a network reads, in 1/cells; 1 feeds raw cells."""

    captured_vote: Literal["zero", "skip"] = "zero"
    """Vote of the network of a caught prey: `zero` lets it vote on the offset (0, 0); `skip` gives it no vote."""


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


class ChampionConfig(Settings):
    """Choice and measurement of each generation's champions."""

    method: Literal["reevaluate", "argmax"] = "reevaluate"
    """Choice of the champions: `reevaluate` replays the best trial teams of both sides against each other on fresh
    starts; `argmax` trusts their trial scores."""

    n_candidates: int = Field(default=20, ge=1)
    """Number of teams of each side that are replayed; each plays all of the other side's."""

    n_episodes: int = Field(default=1, ge=1)
    """Number of episodes of each pairing of a replayed team with an opponent."""

    n_past: int = Field(default=0, ge=0)
    """Number of past champions of the other side, chosen by `esp.past_choice`, that all replayed teams also play."""

    n_held_out: int = Field(default=200, ge=1)
    """Number of episodes of champion against champion, from the same held-out starts in every generation."""


class RunConfig(Settings):
    """The config of a whole run."""

    preset: str = "custom"
    """Name of the preset that the config began as."""

    seed: int = Field(default=0, ge=0, lt=2**63)
    """Seed that determines every random number."""

    generations: int = Field(default=450, ge=1)
    """Number of generations to evolve."""

    checkpoint_every: int = Field(default=10, ge=1)
    """Number of generations between checkpoints: the most that a killed run loses."""

    genealogy: bool = False
    """True to keep the parents of every neuron, in `genealogy/`. This changes nothing else in a run. Only the
    algorithm `esp` can keep them."""

    league: str = ""
    """SHA-256 of the league, the champions of other runs that are in the opponent pools; empty without a league."""

    env: EnvConfig = EnvConfig()
    """The world."""

    game: GameConfig = GameConfig()
    """Another game in place of the world."""

    predators: SideConfig = SideConfig()
    """The side that hunts."""

    prey: SideConfig = SideConfig()
    """The side that flees."""

    esp: EspConfig = EspConfig()
    """Parameters of evolution."""

    champion: ChampionConfig = ChampionConfig()
    """Choice and measurement of champions."""

    @model_validator(mode="after")
    def _plays(self) -> RunConfig:
        sides: dict[TeamName, SideConfig] = {"predators": self.predators, "prey": self.prey}
        for team, side in sides.items():
            if side.policy not in ("esp", *SCRIPTS[team]):
                raise ValueError(f"{team}.policy must be one of esp, {', '.join(SCRIPTS[team])}, got {side.policy!r}")
            if self.genealogy and side.policy == "esp" and side.algorithm != "esp":
                raise ValueError(
                    f"genealogy must be false with {team}.algorithm {side.algorithm!r}: only esp keeps one"
                )
        if "esp" not in (self.predators.policy, self.prey.policy):
            raise ValueError("at least one of predators.policy and prey.policy must be 'esp', got two scripts")
        if self.esp.exploiters_every and not (self.esp.past_share or self.champion.n_past):
            raise ValueError(
                "esp.exploiters_every must be 0 where esp.past_share and champion.n_past are 0: none is met"
            )
        return self

    @model_validator(mode="after")
    def _plays_another_game(self) -> RunConfig:
        game = self.game.environment
        if not game:
            return self
        if self.env != EnvConfig():
            raise ValueError(f"env has no meaning in {game}, got {self.env.changes}")
        for role, side in (("predators", self.predators), ("prey", self.prey)):
            if side.policy not in ("esp", "random"):
                raise ValueError(f"{role}.policy must be esp or random in {game}, got {side.policy!r}")
            if side.policy == "esp" and side.controller != "monolithic":
                raise ValueError(
                    f"{role}.controller must be 'monolithic' in {game}: the others read offsets to "
                    f"opponents; got {side.controller!r}"
                )
        if self.esp.fitness_sharing:
            raise ValueError(f"esp.fitness_sharing must be false in {game}: its fitness may be negative")
        return self

    @model_serializer(mode="wrap")
    def _without_what_does_not_play(self, whole: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the section that has no meaning, so that runs of the world are written as they always were."""
        fields: dict[str, Any] = whole(self)
        fields.pop("env" if self.game.environment else "game", None)
        return fields

    def with_fields(self, fields: Mapping[str, Any]) -> RunConfig:
        """Return a validated copy with some fields changed.

        The fields are given by their names with dots, ``{"esp.n_trials": 200}``, or by sections,
        ``{"esp": {"n_trials": 200}}``.
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
