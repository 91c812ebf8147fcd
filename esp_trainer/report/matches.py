"""Data with which the page plays matches by itself: the world, the teams, and the rules as JavaScript."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from typing import Any

import numpy as np

from esp_trainer.analysis import behaviours
from esp_trainer.analysis.behaviours.detection import detect
from esp_trainer.analysis.behaviours.episode import episode_of, measure_offsets, unwrap
from esp_trainer.analysis.behaviours.registry import BEHAVIOURS
from esp_trainer.analysis.behaviours.roles import role_towards_any
from esp_trainer.analysis.behaviours.thresholds import Thresholds
from esp_trainer.analysis.history import History
from esp_trainer.arrays import GenerationIndices
from esp_trainer.coevolution.sides import side_config, side_controller
from esp_trainer.evaluation.kernel import Entrants, seed_of
from esp_trainer.networks.controller import Controller
from esp_trainer.networks.feedforward import FeedForward
from esp_trainer.report.javascript import translate
from esp_trainer.types import ROLES, Role
from predprey_env.config import MOVES, EnvConfig
from predprey_env.engine import play_step, seen_rows
from predprey_env.policies import ScriptedTeam
from predprey_env.policies.protocol import MEMORY, first_memory
from predprey_env.rules.dynamics import is_over
from predprey_env.sight import Sight

_PLAYED = (play_step, seed_of, first_memory, is_over)
_SEEN = (episode_of, unwrap, measure_offsets, detect, role_towards_any)
_USED = (
    *(rule.__name__ for rule in (*_PLAYED, *_SEEN)),
    *("add_votes", "observe", "move_prey", "capture", "fma", "displacement", "nearest_distance"),
)
"""Functions that the page calls by name: to play a match, to show an agent's networks, and to detect behaviours."""


def rules_in_javascript(floats: str, kinds: Iterable[type] = (FeedForward,)) -> str:
    """Return the rules of a match as JavaScript, in a scope of their own, as the page may use the same names.

    Args:
        floats: JavaScript of the floating-point functions that the rules need.
        kinds: Kinds of network that play, and of sight besides the paper's.

    Raises:
        ValueError: The rule of a network or a sight is outside the subset of Python that can be translated.
    """
    rules = translate(*_PLAYED, *_SEEN, classes={Entrants, Sight, *kinds}, exact=behaviours.__name__)
    return f"const {{ {', '.join(_USED)} }} = (() => {{\n{floats}\n{rules}\nreturn {{ {', '.join(_USED)} }};\n}})();\n"


def kinds_in(histories: Iterable[History]) -> list[type]:
    """Return the kinds of network and of sight that play in some runs, each once; the paper's network if none plays."""
    controllers = [side_controller(each.config, role) for each in histories for role in each.champions]
    networks = [type(each.network) for each in controllers] or [FeedForward]
    return list(dict.fromkeys([*networks, *(type(each.sight) for each in controllers)]))


def world_for_page(env: EnvConfig) -> dict[str, Any]:
    """Return a world in the form that the page's ``Game`` and detectors read."""
    return {
        "env": env.model_dump(),
        "memory": MEMORY,
        "seen": seen_rows(env.rules, env.sight),
        "rules": env.rules._asdict() | {"sight": _fields(env.sight)},
        "moves": MOVES,
        "thresholds": Thresholds()._asdict(),
        "behaviours": {
            name: {
                "meaning": detector.meaning,
                "who": detector.who,
                "detector": name.replace(" ", "_"),
                "defined": detector.is_defined(env.n_predators, env.n_prey),
            }
            for name, detector in BEHAVIOURS.items()
            if detector.of_interaction
        },
    }


def teams(history: History, role: Role, generations: GenerationIndices) -> dict[str, Any]:
    """Return the champions of a side in some generations, or its script.

    Genes are base64 of little-endian float32.
    """
    settings, env = side_config(history.config, role), history.config.env
    if role not in history.champions:
        script = ScriptedTeam.of(settings.policy, role, env).compiled(role, env, 0)
        return {"name": settings.policy, "script": list(script)}
    genomes = history.genomes(role, generations).astype("<f4")
    return {
        "generations": generations.tolist(),
        "controller": controller(side_controller(history.config, role)),
        "genes": base64.b64encode(genomes.tobytes()).decode(),
    }


def controller(networks: Controller) -> dict[str, Any]:
    """Return a controller in the form that the translated forward pass reads."""
    fields = {
        **networks._asdict(),
        "network": {**_fields(networks.network), "blank": [0] * networks.n_actions},
        "input_scale": float(networks.input_scale),
        "sight": _fields(networks.sight),
        "wiring": networks.wiring.tolist(),
    }
    numbers = {name: getattr(networks, name) for name in ("fan_in", "n_votes", "n_actions", "n_memory")}
    return {**fields, **numbers}


def _fields(one: Any) -> dict[str, Any]:
    """Return the fields of a named tuple as plain numbers or lists of them, and the name of its class as ``kind``."""
    fields = {name: np.asarray(value).tolist() for name, value in one._asdict().items()}
    return {**fields, "kind": type(one).__name__}


def both(history: History, generations: GenerationIndices) -> dict[Role, Any]:
    """Return the :func:`teams` of both sides of a run."""
    return {role: teams(history, role, generations) for role in ROLES}
