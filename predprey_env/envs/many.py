"""Parts that all environments of many worlds share: seeds, starts, the time limit, and starting again after the end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode

from predprey_env.arrays import Seeds, Starts, WorldIndices, WorldMask
from predprey_env.config import EnvConfig
from predprey_env.envs.fixed import Timed, read_only
from predprey_env.envs.inputs import read_mask, read_mode, read_seeds
from predprey_env.envs.options import Options, read_reset_options
from predprey_env.envs.pictures import RENDER_FPS, VECTOR_RENDER_MODES, Painters, Pictured, Pictures
from predprey_env.envs.worlds import Scratch, Worlds, make_scratch, make_worlds, place, score
from predprey_env.rules.starts import draw_each, given_starts
from predprey_env.settings import brief


class ManyWorlds(Timed):
    """Worlds of one config, each with a random generator of its own."""

    n_worlds: int = read_only("n_worlds")
    num_envs: int
    metadata: dict[str, Any] = read_only("metadata")
    render_mode: str | None = read_only("render_mode", "make another environment with render_mode=...")
    """None, or ``"rgb_array"``: see :meth:`render`."""

    _metadata: dict[str, Any]
    _worlds: Worlds
    _scratch: Scratch
    _scores: np.ndarray
    """Fitness of all agents before the step: float64 ``(n_worlds, n_agents)``."""
    _over: WorldMask | None
    """Worlds that are over, bool ``(n_worlds,)``; None before the first reset."""

    def _make_worlds(
        self, config: EnvConfig, n_worlds: int, autoreset_mode: AutoresetMode | str, pictured: Pictured
    ) -> None:
        if config.captured_prey != "inert":
            raise ValueError(
                f"in a vector env captured_prey must be 'inert', as no row may leave, got {config.captured_prey!r}"
            )
        self._config, self._rules = config, config.rules
        self._n_worlds = n_worlds
        self._render_mode, self._painters = pictured.mode, Painters(config, pictured)
        self._metadata = {
            "name": "predprey_vector_v0",
            "render_modes": list(VECTOR_RENDER_MODES),
            "render_fps": RENDER_FPS,
        }
        self._autoreset_mode = self._metadata["autoreset_mode"] = read_mode(autoreset_mode)
        self._worlds, self._scratch = make_worlds(config, n_worlds), make_scratch(config)
        self._scores = np.zeros((n_worlds, config.n_agents))
        self._random: list[tuple[np.random.Generator, int] | None] = [None] * n_worlds
        self._over = None

    @property
    def autoreset_mode(self) -> AutoresetMode:
        """Behaviour after the end of an episode; it can be set before the first reset."""
        return self._autoreset_mode

    @autoreset_mode.setter
    def autoreset_mode(self, given: AutoresetMode | str) -> None:
        mode = read_mode(given)
        if self._over is not None and mode is not self._autoreset_mode:
            raise ValueError(
                f"autoreset_mode cannot change after the first reset(): make the environment with {mode.value!r}"
            )
        self._autoreset_mode = self.metadata["autoreset_mode"] = mode

    def render(self) -> Pictures | None:
        """Return a sequence that holds, for each row, a picture of its world: uint8 ``(height, width, 3)``.

        A picture is drawn only when it is taken from the sequence, so a few pictures of many worlds cost little. Take
        them before the next step. A world that started again in the last step is shown at its new start. Returns None
        unless ``render_mode`` is ``"rgb_array"``.
        """
        if self.render_mode is None:
            return None
        if self._over is None:
            raise RuntimeError("reset() must be called before render()")
        return Pictures(self._painters, self._worlds.blocks, self.num_envs, self.num_envs // self.n_worlds)

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """The generator of each world."""
        return tuple(self._seeded(world)[0] for world in range(self.n_worlds))

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """Seed from which the generator of each world was made."""
        return tuple(self._seeded(world)[1] for world in range(self.n_worlds))

    def _seeded(self, world: int) -> tuple[np.random.Generator, int]:
        seeded = self._random[world]
        if seeded is None:
            seeded = self._random[world] = seeding.np_random()
        return seeded

    def _seed(self, seed: int | Sequence[int | None] | None, which: WorldIndices) -> None:
        seeds = read_seeds(seed, self.n_worlds)
        named = {world: seeds[world] for world in which.tolist() if seeds[world] is not None}
        fresh = {world: seeding.np_random(each) for world, each in named.items()}
        for world, seeded in fresh.items():  # set only after all seeds were accepted
            self._random[world] = seeded

    def _read_options(self, options: Options | None, n_rows: int) -> tuple[WorldIndices, Starts | None]:
        """Return the indices of the worlds that start, and their starts, None for random starts.

        A reset mask has ``n_rows`` entries, the same number for each world.
        """
        options = read_reset_options(options)
        which = read_mask(options.get("reset_mask"), self.n_worlds, n_rows)
        if self._over is None and len(which) < self.n_worlds:
            raise RuntimeError("reset() must be called without a reset_mask first")
        starts = options.get("starts")
        return which, None if starts is None else given_starts(starts, self.config, self.n_worlds)[which]

    def _check_ready(self) -> WorldMask:
        """Return the worlds that are over; raise :class:`RuntimeError` if a step cannot be played."""
        if self._over is None:
            raise RuntimeError("reset() must be called before step()")
        if self._autoreset_mode is AutoresetMode.DISABLED and self._over.any():
            over = np.flatnonzero(self._over).tolist()
            raise RuntimeError(
                f"reset() must be called with a reset_mask for the worlds that are over, got {brief(over)}"
            )
        return self._over

    def _generators(self, which: WorldIndices) -> list[np.random.Generator]:
        return [self._seeded(world)[0] for world in which.tolist()]

    def _draw_starts(self, which: WorldIndices, given: Starts | None) -> Starts:
        """Return starts of some worlds, each from its own generator unless they are given."""
        return draw_each(self._generators(which), self.config) if given is None else given

    def _mark_started(self, which: WorldIndices) -> None:
        over = np.zeros(self.n_worlds, np.bool_) if self._over is None else self._over.copy()
        over[which] = False
        self._over = over

    def _place(self, which: WorldIndices, starts: Starts, seeds: Seeds) -> None:
        """Start episodes in some worlds; the random choices of policies in compiled code follow from ``seeds``."""
        place(self._worlds, which, starts, seeds)

    def _score(self, which: WorldIndices) -> None:
        score(self._worlds, self._rules, self._scratch, which, self._scores)
