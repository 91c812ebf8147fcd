"""``evaluate``, ``show`` and ``teams``: results and descriptions of teams, loaded by name."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from esp_trainer.esp.team import IN_A_WORLD, Team
from esp_trainer.evaluation.match import match
from esp_trainer.exact.team import OptimalPlay
from esp_trainer.files import DamagedFileError
from esp_trainer.networks.controller import Controller
from esp_trainer.presets import PRESETS, preset
from esp_trainer.statistics import Rate, in_points
from esp_trainer.teams.zoo import known_teams, load_team
from esp_trainer.types import Contestant, Role, ScriptedTeams
from predprey_env.config import EnvConfig
from predprey_env.policies.scripted import NUMBERS
from predprey_env.settings import counted

_OPTIMAL = "optimal:"
"""Prefix of the file of a solved game: optimal play of one of its sides."""


def evaluate(team: str, against: str, episodes: int, seed: int) -> int:
    """Print the results of two teams against each other."""
    optimal = next((name for name in (team, against) if name.startswith(_OPTIMAL)), None)
    if optimal:
        raise ValueError(f"optimal play is not evaluated but solved: esp-trainer solve says its value; got {optimal}")
    players, env = pair(team, against)
    captures = match(players["predators"], players["prey"], env, episodes, seed)
    print(f"{counted(captures.episodes, 'episode')} from held-out starts (seed {seed}), 95% Wilson intervals")
    print(f"  world              {env.changes}")
    print(f"  prey caught        {captures.caught}")
    print(f"  all prey caught    {captures.predators_succeed}")
    print(f"  no prey caught     {captures.prey_succeed}")
    print(f"  length             {captures.steps:.1f} of {counted(env.max_cycles, 'step')}")
    print(f"  fitness            predators {captures.predator_fitness:.2f}, prey {captures.prey_fitness:.2f}")
    print("  prey caught, by how many predators started at an even distance from it:")
    for even, rate in enumerate(captures.caught_by_even):
        print(f"    {even}                {rate or 'no such start'}")
    return 0


def show(path: str) -> int:
    """Print what a team is and where it came from."""
    team = _evolved(path)
    controller, side = team.controller, team.side
    kind = side.controller if side.network == "feedforward" else f"{side.controller}, {side.network}"
    print(f"{path}: {team.n_agents} {team.role}")
    print(
        f"  networks    {len(controller.fan_in)} {'in all' if controller.n_together > 1 else 'an agent'} "
        f"({kind}), {_shapes(controller)}, {team.side.output} outputs"
    )
    n_genes = len(team.genomes) * controller.n_hidden * sum(controller.used_genes)
    print(f"  genes       {n_genes}, from {team.genomes.min():z.2f} to {team.genomes.max():z.2f}")
    for head, tell in _ORIGIN.items():
        words = _readable(tell, team, path)
        if words:
            print(f"  {head:12}{words}")
    return 0


def _readable(tell: Callable[[Team, str], str], team: Team, path: str) -> str:
    """Return a line about a team; empty if its provenance, which its author may write, lacks the facts."""
    try:
        return tell(team, path)
    except DamagedFileError:
        raise
    except (KeyError, TypeError, AttributeError, ValueError):
        return ""


def _run(team: Team, _: str) -> str:
    origin = team.provenance
    return f"{origin['preset']}, seed {origin.get('seed')}, generation {origin.get('generation')}"


def _chosen(team: Team, _: str) -> str:
    method = team.provenance.get("champion", {}).get("method")
    return f"{method}, mean fitness {team.provenance['score']:.2f}, the best of its contenders"


def _held_out(team: Team, _: str) -> str:
    return f"{Rate(**team.provenance['held_out']['caught'])} of the prey caught, champion against champion"


def _in_zoo(team: Team, _: str) -> str:
    origin = team.provenance
    score, rating = Rate(*origin["zoo"]["score"]), Rate(*origin["zoo"]["rating"])
    verb = "caught" if team.role == "predators" else "not caught"
    return f"{score} of the prey {verb}, {in_points(rating)} points, made at commit {origin['commit']}"


def _world_in_words(team: Team, path: str) -> str:
    world = _world(team, path)
    return world.changes if world else team.game


def _shapes(controller: Controller) -> str:
    outputs = controller.n_actions * controller.n_together
    return " and ".join(f"{fan_in}-{controller.n_hidden}-{outputs}" for fan_in in dict.fromkeys(controller.fan_in))


def _changes(team: Team, _: str) -> str:
    """Return the settings in which a team's run differs from the preset that it is named after."""
    origin = team.provenance
    if origin["preset"] not in PRESETS:
        return ""
    changed = []
    for section in ("predators", "prey", "esp", "champion"):
        usual = getattr(preset(origin["preset"]), section)
        own = type(usual).from_dict(origin.get(section, {}))  # it accepts the names of earlier versions
        told = [name for name in type(usual).model_fields if name in own.model_fields_set]
        changed += [
            f"{section}.{name}={getattr(own, name)}" for name in told if getattr(own, name) != getattr(usual, name)
        ]
    return ", ".join(changed)


_ORIGIN = {
    "from": _run,
    "changed": _changes,
    "world": _world_in_words,
    "chosen by": _chosen,
    "held out": _held_out,
    "in the zoo": _in_zoo,
}


def pair(team: str, against: str) -> tuple[dict[Role, Contestant], EnvConfig]:
    """Return both players by role, and their world.

    It is the world of the first player that has one, or else the paper's.
    """
    players: dict[Role, Contestant] = {}
    seats = [(name, _load(name)) for name in (team, against)]
    for _, player in sorted(seats, key=lambda seat: len(seat[1].roles)):  # those that can play both roles last
        role = _role(player, players)
        if role in players:
            raise ValueError(f"a match needs predators and prey, got two teams of {role}")
        players[role] = player
    worlds = [world for name, player in seats if (world := _world(player, name))]
    if not worlds:
        evolved = [(name, player) for name, player in seats if isinstance(player, Team)]
        evolved.sort(key=lambda seat: seat[1].role != "predators")  # only predators show whether they may idle
        if not evolved:
            raise ValueError("at least one of the teams must be an evolved one, got two scripts")
        worlds = [_assumed_world(*evolved[0])]
    for role, player in players.items():
        player.check_fits(role, worlds[0])
    if worlds[0] != worlds[-1]:
        print(f"the teams come from different worlds; they play in that of {team}", file=sys.stderr)
    return players, worlds[0]


def _assumed_world(name: str, team: Team) -> EnvConfig:
    """Return the paper's world with as many agents as a team has and sees, and print a note about it."""
    sees = team.n_opponents
    if team.role == "predators":
        idles = team.controller.n_actions == EnvConfig().n_predator_actions
        env = EnvConfig(n_predators=team.n_agents, n_prey=sees, predator_idle=idles)
    else:
        env = EnvConfig(n_predators=sees, n_prey=team.n_agents)
    teams, cells = f"{env.n_predators} against {env.n_prey}", f"{env.size} x {env.size} cells"
    print(
        f"{name} does not say which world it is for: it plays in the paper's, {teams} on {cells}; "
        f"for another, save it with provenance={IN_A_WORLD}",
        file=sys.stderr,
    )
    return env


def _role(player: Contestant, others: Mapping[Role, Contestant]) -> Role:
    """Return a role that a player can play; if possible, one that is not taken."""
    return next((role for role in player.roles if role not in others), player.roles[0])


def _load(name: str) -> Contestant:
    if name.startswith(_OPTIMAL):
        return OptimalPlay.load(name.removeprefix(_OPTIMAL))
    if name in NUMBERS and not Path(name).exists():
        return ScriptedTeams(name)
    team = _evolved(name, NUMBERS)
    if team.game:
        raise ValueError(f"{name} plays {team.game}: evaluate and replay are for the predator-prey world")
    return team


def _evolved(name: str, besides: Iterable[str] = ()) -> Team:
    """Load a team of the zoo or of a file. The error suggests the nearest known name, or one of ``besides``."""
    known = known_teams()
    if name in known and not Path(name).exists():
        return load_team(name)
    try:
        return Team.load(name)
    except FileNotFoundError as error:
        near = difflib.get_close_matches(name, [*besides, *known], n=1)
        raise FileNotFoundError(f"{error}; did you mean {near[0]}?" if near else str(error)) from None


def _world(team: Contestant, name: str) -> EnvConfig | None:
    try:
        return team.world()
    except ValueError as error:
        raise DamagedFileError(f"{name} does not say which world it is for: {error}") from None


def zoo(task: str | None) -> int:
    """List the zoo, best first."""
    known = [team for team in known_teams().values() if task in (None, team.task)]
    width = max(len(team.name) for team in known)
    for each, role in dict.fromkeys((team.task, team.role) for team in known):
        verb = "caught" if role == "predators" else "not caught"
        heads = f"{'generation':>12}{f'prey {verb} [95%]':>26}{'rating [95%]':>24}"
        print(f"{f'{each}, {role}':{width}}{heads}")
        listed = [team for team in known if (team.task, team.role) == (each, role)]
        for team in sorted(listed, key=lambda team: -team.rating.rate):
            caught = team.score
            caught = Rate(caught.rate, max(0.0, caught.low), min(1.0, caught.high))  # t intervals know no bounds
            print(f"{team.name:{width}}{team.generation:>12}{caught!s:>26}{in_points(team.rating):>24}")
        print()
    print("held-out teams are for reporting only: do not train against them, nor choose by them")
    return 0
