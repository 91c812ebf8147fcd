"""The config of a run: all its parameters, as one tree of frozen objects.

The same config and seed give the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from esp_trainer.esp_config import EspConfig
from esp_trainer.game import GameConfig
from predprey_env.config import EnvConfig, TeamName
from predprey_env.policies import SCRIPTS, PredatorScript, PreyScript
from predprey_env.settings import Settings, field_names, flat, unknown_field

__all__ = ["ChampionConfig", "EspConfig", "RunConfig", "SideConfig"]


class SideConfig(Settings):
    """Settings of one side: evolved controllers, or a script."""

    policy: Literal["esp", PredatorScript, PreyScript] = "esp"
    """Policy of the side: `esp` evolves it; predators or prey may instead follow one of their scripts."""

    algorithm: str = "esp"
    """Algorithm that evolves the side: `esp`, the paper's; `cosyne`, which has a subpopulation for each gene; `ga`, a
    genetic algorithm on whole teams; `openai_es` and `cma_es`, evolution strategies; or one of your own, as
    `module:Class`. It uses those parameters of `esp` that apply to it."""

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
                "esp.exploiters_every must be 0 where esp.past_share and champion.n_past are 0: no team would meet one"
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
    def _without_unused_section(self, whole: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out ``env`` or ``game``, whichever is unused. Configs of the world are written as before ``game``."""
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
