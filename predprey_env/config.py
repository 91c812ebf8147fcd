"""The parameters of the world."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, TypeAlias, TypedDict

from pydantic import Field, model_validator

from predprey_env.plugins import find_class
from predprey_env.settings import PartError, Settings
from predprey_env.sight import SIGHTS, Sight, check_rule, check_sight

MOVES = ("east", "west", "north", "south", "idle")
"""Actions in index order. Predators have all five, prey the first four (section V)."""
IDLE = MOVES.index("idle")

TeamName: TypeAlias = Literal["predators", "prey"]
TEAMS: tuple[TeamName, TeamName] = ("predators", "prey")

CLOSENESS = ("uncaught", "all", "nearest")

SHAPES = frozenset({"n_predators", "n_prey", "predator_idle"})
"""Fields of :class:`EnvConfig` that decide which trained teams can play in the world."""
PAYOFF = frozenset({"closeness", "credit", "prey_fitness", "reward"})
"""Fields of :class:`EnvConfig` that define the payoff."""
SIGHT_OPTIONS = frozenset(
    {"see_teammates", "see_moves", "see_identity", "see_nearest_first", "see_scaled", "mask_actions"}
)
"""Boolean fields of :class:`EnvConfig` that change observations and infos."""
SIGHT = SIGHT_OPTIONS | {"observation"}
"""Fields of :class:`EnvConfig` that define observations and infos. Fields in none of :data:`SHAPES`, :data:`PAYOFF` and
:data:`SIGHT` define starts and dynamics."""


class TeamShape(NamedTuple):
    """Sizes of one team in a world."""

    n_agents: int
    n_opponents: int
    n_actions: int
    """Number of actions of each agent."""
    n_seen: int
    """Length of an agent's observation."""


class Rules(NamedTuple):
    """An :class:`EnvConfig` in the form that compiled code reads: plain numbers."""

    n_predators: int
    n_prey: int
    size: int
    max_cycles: int
    prey_first: bool
    swap_captures: bool
    closeness: int
    individual_credit: bool
    complementary: bool
    sight: Any
    """Observation of the agents whose actions the caller chooses, an :class:`~predprey_env.sight.AnySight`; a compiled
    player has its own."""


class EnvParameters(TypedDict, total=False):
    """The fields of :class:`EnvConfig`, for the signatures of functions that take them as keywords."""

    n_predators: int
    n_prey: int
    size: int
    max_cycles: int
    move_order: Literal["simultaneous", "prey_first"]
    swap_captures: bool
    captured_prey: Literal["inert", "removed"]
    start_collisions: Literal["redraw", "allow"]
    predator_idle: bool
    closeness: Literal["uncaught", "all", "nearest"]
    credit: Literal["team", "individual"]
    prey_fitness: Literal["lifespan", "complementary"]
    reward: Literal["terminal", "dense"]
    observation: str
    see_teammates: bool
    see_moves: bool
    see_identity: bool
    see_nearest_first: bool
    see_scaled: bool
    mask_actions: bool


class EnvConfig(Settings):
    """Settings of the world of Rawal, Rajagopalan & Miikkulainen (2010), sections III and V.

    Every choice that the paper leaves open is an option.
    """

    n_predators: int = Field(default=3, ge=1)
    """Number of predators."""

    n_prey: int = Field(default=2, ge=1)
    """Number of prey."""

    size: int = Field(default=100, ge=3, le=10_000)
    """Side of the square torus, in cells."""

    max_cycles: int = Field(default=150, ge=1, le=1_000_000)
    """Time limit of an episode, in steps."""

    move_order: Literal["simultaneous", "prey_first"] = "simultaneous"
    """Order of moves: all agents at once, or in turns, where predators observe the prey's move before they choose."""

    swap_captures: bool = False
    """Count it as a capture when a predator and a prey swap cells; when teams move in turns, this never happens."""

    captured_prey: Literal["inert", "removed"] = "inert"
    """Fate of a captured prey: it stays in `agents` and does nothing, or it terminates and leaves."""

    start_collisions: Literal["redraw", "allow"] = "redraw"
    """Treatment of a prey whose random start is a predator's cell: it is placed again, or stays there."""

    predator_idle: bool = True
    """Give predators a fifth action: idle."""

    closeness: Literal["uncaught", "all", "nearest"] = "uncaught"
    """Distances in the predators' fitness: to each uncaught prey; to all prey, a caught one at distance 0; or from the
    nearest predator to each uncaught prey."""

    credit: Literal["team", "individual"] = "team"
    """Distances that count for a predator: those of the whole team, or only its own."""

    prey_fitness: Literal["lifespan", "complementary"] = "lifespan"
    """The prey's fitness: the paper's, or 25 minus the predator team's, which the paper reports as failing."""

    reward: Literal["terminal", "dense"] = "terminal"
    """Rewards: the fitness on the last step, or on each step the change in fitness, as if the episode ended there."""

    observation: str = "offsets"
    """Observation of the agents: `offsets`, as in the paper, with the options `see_*`; or one of your own, as
    `module:Class`."""

    see_teammates: bool = False
    """Show each agent the offsets to its team-mates."""

    see_moves: bool = False
    """Show the last move of every agent that is seen."""

    see_identity: bool = False
    """Show each agent its index in its team, one-hot."""

    see_nearest_first: bool = False
    """Order opponents by distance, the nearest first and caught prey last, instead of by index."""

    see_scaled: bool = False
    """Divide offsets by half the size of the torus, so that all entries are in [-1, 1]."""

    mask_actions: bool = False
    """Add an `action_mask` to the infos: 1 for each valid action. For a caught prey, or an agent out of its turn, only
    the entry of action 0 is 1."""

    @model_validator(mode="after")
    def _fits(self) -> EnvConfig:
        if self.n_agents > self.size**2:
            raise ValueError(f"{self.n_agents} agents need at least as many cells, got size={self.size}")
        # With more predators, prey would be placed on a predator, and placed again, too often.
        if 2 * self.n_predators > self.size**2:
            raise ValueError(f"{self.n_predators} predators need twice as many cells, got size={self.size}")
        return self

    @model_validator(mode="after")
    def _observes(self) -> EnvConfig:
        if self.observation == "offsets":
            return self
        given = [f"see_{name}" for name in Sight._fields if getattr(self, f"see_{name}")]
        if given:
            raise ValueError(f"{', '.join(given)}: only for observation=offsets, got observation={self.observation}")
        try:
            for n_agents, n_opponents in ((self.n_predators, self.n_prey), (self.n_prey, self.n_predators)):
                check_sight(self.observation, n_agents, n_opponents, self.size)
            check_rule(self.observation, self.rules)
        except ValueError as error:
            raise (PartError if ":" in self.observation else ValueError)(str(error)) from None
        return self

    @property
    def n_agents(self) -> int:
        """Number of predators and prey together; predators come first in every array."""
        return self.n_predators + self.n_prey

    @property
    def n_predator_actions(self) -> int:
        """Number of actions of a predator: 5, or 4 if predators may not idle."""
        return 5 if self.predator_idle else 4

    @property
    def n_prey_actions(self) -> int:
        """Number of actions of a prey: 4, as prey always move."""
        return 4

    def team(self, name: TeamName) -> TeamShape:
        """Return the sizes of one team; raise :class:`ValueError` for an unknown team name."""
        if name not in TEAMS:
            raise ValueError(f"team must be {' or '.join(TEAMS)}, got {name!r}")
        if name == "predators":
            n_agents, n_opponents, n_actions = self.n_predators, self.n_prey, self.n_predator_actions
        else:
            n_agents, n_opponents, n_actions = self.n_prey, self.n_predators, self.n_prey_actions
        return TeamShape(n_agents, n_opponents, n_actions, self.sight.n_seen(n_agents, n_opponents))

    @property
    def sight(self) -> Any:
        """The agents' observation, in the form that compiled code reads: an :class:`~predprey_env.sight.AnySight`."""
        if self.observation == "offsets":
            return Sight(*(getattr(self, f"see_{name}") for name in Sight._fields))
        return find_class("observation", self.observation, SIGHTS)()  # checked already

    @property
    def changes(self) -> str:
        """The settings that differ from the default, as text."""
        changed = self.model_dump(exclude_defaults=True)
        return ", ".join(f"{name}={value}" for name, value in changed.items()) or "the default one"

    @property
    def rules(self) -> Rules:
        """The settings as plain numbers for compiled code."""
        return Rules(
            n_predators=self.n_predators,
            n_prey=self.n_prey,
            size=self.size,
            max_cycles=self.max_cycles,
            prey_first=self.move_order == "prey_first",
            swap_captures=self.swap_captures,
            closeness=CLOSENESS.index(self.closeness),
            individual_credit=self.credit == "individual",
            complementary=self.prey_fitness == "complementary",
            sight=self.sight,
        )
