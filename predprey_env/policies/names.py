"""Names of the scripts."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from predprey_env.config import TeamName

PredatorScript: TypeAlias = Literal["random", "greedy_chase", "parity_chase", "intercept", "surround"]
PreyScript: TypeAlias = Literal["random", "flee_nearest", "flee_centroid", "run_straight"]

SCRIPTS: dict[TeamName, tuple[str, ...]] = {"predators": get_args(PredatorScript), "prey": get_args(PreyScript)}
"""Names of the scripts that each team can play."""
