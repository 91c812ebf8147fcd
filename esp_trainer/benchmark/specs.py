"""SPECs: the policy to measure, as typed on the command line.

| SPEC | what it is |
| --- | --- |
| ``greedy_chase`` | a script |
| ``paper-3v2/predators/seed-500-late`` | a team of the zoo |
| ``runs/x/champions/prey-00099.safetensors`` | the file of an evolved team |
| ``sb3:PPO:model.zip`` | a model of Stable-Baselines3, or of another package: ``sb3:sb3_contrib.TRPO:model.zip`` |
| ``torch:my_module:make_network:weights.pt`` | a PyTorch or TorchRL module that your function makes, with these weights |
| ``my_module:my_policy`` | a policy, a class or function without arguments that makes one, or a function of observations |

Files of this package hold numbers and are never executed. A file of weights for ``torch:`` is read with
``weights_only=True`` (or is safetensors), so nothing in it is executed. To import ``my_module`` executes it. A model of
Stable-Baselines3 is unpickled, which can execute whatever its author put there.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from esp_trainer.benchmark.batched import SB3Policy, TorchPolicy
from esp_trainer.benchmark.match import Challenger
from esp_trainer.esp.team import Team
from esp_trainer.files import DamagedFileError, digest_of
from esp_trainer.teams.zoo import known_teams, load_team, unknown
from esp_trainer.types import PolicyError, Role, ScriptedTeams
from predprey_env.agents import other_team
from predprey_env.config import PAYOFF, SHAPES, SIGHT, EnvConfig, TeamShape
from predprey_env.plugins import import_here
from predprey_env.policies import SCRIPTS
from predprey_env.policies.opponents import as_policy


@dataclass(frozen=True)
class Candidate:
    """The policy that is measured."""

    spec: str
    player: Challenger
    digest: str
    """SHA-256 of the file that holds the policy; for a script, its name."""
    caution: str = ""
    """Warning about code that loading the policy may have executed."""
    elsewhere: str = ""
    """Differences between the world that the policy evolved in and the world that it is measured in."""


def load_candidate(spec: str, role: Role, env: EnvConfig, *, drawn: bool = False) -> Candidate:
    """Return the policy that a SPEC names.

    Raises :class:`ValueError` or :class:`FileNotFoundError`, in one line, for a policy that is missing or does not fit.

    Args:
        spec: SPEC, as above.
        role: Role that the policy plays.
        env: World that it plays in.
        drawn: True if ``sb3:`` and ``torch:`` sample their actions; False if they take the most likely ones.
    """
    kind, _, rest = spec.partition(":")
    if kind in _KINDS and ":" in spec:
        return _KINDS[kind](spec, rest, env.team(role), drawn)
    if drawn:
        raise PolicyError(
            f"only policies of sb3: and torch: can be drawn, got {spec}: a team says itself how it chooses"
        )
    if kind == "optimal":
        raise PolicyError(f"optimal play changes with the steps left, and is only for esp-trainer replay, got {spec}")
    known = known_teams()
    if spec in SCRIPTS[role]:
        return Candidate(spec, ScriptedTeams(spec), spec)
    if spec in known and not Path(spec).exists():
        return _evolved(spec, load_team(spec), known[spec].digest, role, env)
    if spec.endswith(".safetensors") or Path(spec).is_file():
        return _evolved(spec, Team.load(spec), digest_of(Path(spec)), role, env)
    if rest:
        return _imported(spec, kind, rest, role, env)
    if spec in SCRIPTS[other_team(role)]:
        raise PolicyError(f"expected {role}, got {spec}, a script of {other_team(role)}")
    raise PolicyError(unknown("policy", spec, [*SCRIPTS[role], *known]))


def _evolved(spec: str, team: Team, digest: str, role: Role, env: EnvConfig) -> Candidate:
    team.check_fits(role, env)
    try:
        own = team.world() or env
    except ValueError as error:
        raise DamagedFileError(f"{spec} does not say which world it is for: {error}") from None
    differ = [name for name in _OF_PLAY if getattr(own, name) != getattr(env, name)]
    there, here = (", ".join(f"{name}={getattr(world, name)}" for name in differ) for world in (own, env))
    elsewhere = f"{spec} evolved with {there}; here {here}" if differ else ""
    return Candidate(spec, team, digest, elsewhere=elsewhere)


def _sb3(spec: str, rest: str, shape: TeamShape, drawn: bool) -> Candidate:
    name, _, file = rest.partition(":")
    if not file:
        raise PolicyError(f"expected sb3:CLASS:FILE, such as sb3:PPO:model.zip, got {spec!r}")
    path = _file(file)
    package, _, algorithm = name.rpartition(".")
    kind = _attribute(_module(package or "stable_baselines3"), algorithm)
    try:
        model = kind.load(path, device="cpu")
    except Exception as error:
        reason = _line(error)
        raise PolicyError(f"{path} is not a model that {name} of Stable-Baselines3 can load: {reason}") from error
    caution = f"{path} was unpickled by Stable-Baselines3, which runs what its author put there"
    return Candidate(spec, SB3Policy(model, shape, drawn=drawn), digest_of(path), caution)


def _torch(spec: str, rest: str, shape: TeamShape, drawn: bool) -> Candidate:
    parts = rest.split(":", 2)
    if len(parts) != 3 or not all(parts):
        expected = "torch:MODULE:FUNCTION:FILE, such as torch:my_module:make_network:weights.pt"
        raise PolicyError(f"expected {expected}, got {spec!r}")
    path, torch = _file(parts[2]), _module("torch")
    network = _call(_attribute(_module(parts[0]), parts[1]), f"{parts[0]}:{parts[1]}")
    try:
        if path.suffix == ".safetensors":
            weights = _module("safetensors.torch").load_file(path)
        else:
            weights = torch.load(path, map_location="cpu", weights_only=True)
        network.load_state_dict(weights)
    except Exception as error:
        raise PolicyError(f"{path} does not hold weights for {parts[0]}:{parts[1]}: {_line(error)}") from error
    return Candidate(spec, TorchPolicy(network, shape, drawn=drawn), digest_of(path), f"{parts[0]} was imported")


def _imported(spec: str, module: str, attribute: str, role: Role, env: EnvConfig) -> Candidate:
    source = _module(module)
    policy = _attribute(source, attribute)
    if inspect.isclass(policy) or (inspect.isfunction(policy) and not inspect.signature(policy).parameters):
        policy = _call(policy, spec)
    try:
        player = as_policy(policy, role, env, spec)
    except ValueError as error:
        raise PolicyError(str(error).replace("must be the name of a script, a", "must be a")) from error
    except (Exception, SystemExit) as error:  # raised by its properties
        raise PolicyError(f"{spec} cannot play: {_line(error)}") from error
    where = getattr(source, "__file__", None)
    return Candidate(spec, player, digest_of(Path(where)) if where else "", f"{module} was imported")


_OF_PLAY = [name for name in EnvConfig.model_fields if name not in SHAPES | PAYOFF | SIGHT]
"""Fields of a world that change play, besides those that a team must fit."""
_KINDS = {"sb3": _sb3, "torch": _torch}


def _module(name: str) -> ModuleType:
    try:
        return import_here(name)
    except (Exception, SystemExit) as error:
        raise PolicyError(f"{name} cannot be imported: {_line(error)}") from error


def _attribute(module: ModuleType, name: str) -> Any:
    try:
        return getattr(module, name)
    except AttributeError:
        raise PolicyError(f"{module.__name__} has no {name}") from None
    except (Exception, SystemExit) as error:  # raised by a module's own __getattr__
        raise PolicyError(f"{module.__name__}:{name} cannot be read: {_line(error)}") from error


def _call(make: Any, name: str) -> Any:
    try:
        return make()
    except (Exception, SystemExit) as error:
        raise PolicyError(f"{name}() raised {_line(error)}") from error


def _file(name: str) -> Path:
    if not Path(name).is_file():
        raise FileNotFoundError(f"{name} is not there")
    return Path(name)


def _line(error: BaseException) -> str:
    first = (str(error).splitlines() or [""])[0]
    return f"{type(error).__name__}: {first}"
