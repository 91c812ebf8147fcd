"""Pictures of an environment of many worlds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, overload

import numpy as np

from predprey_env.arrays import Picture
from predprey_env.config import EnvConfig
from predprey_env.engine import Block
from predprey_env.extras import require_pygame
from predprey_env.jit.lanes import LANES
from predprey_env.rules.dynamics import World
from predprey_env.settings import whole_number

if TYPE_CHECKING:
    from predprey_env.rendering.viewer import Viewer  # imports pygame

RENDER_FPS = 15
VECTOR_RENDER_MODES = ("rgb_array",)


class Pictured(NamedTuple):
    """Options of the pictures of an environment of many worlds."""

    mode: str | None = None
    """None for no pictures, or ``"rgb_array"``."""
    follow: int | None = None
    """Width in cells of pictures that follow the chase; by default pictures show the whole world."""


NO_PICTURES = Pictured()


class Painters:
    """Draws worlds of an environment of many worlds, and remembers their course for the trails.

    Raises :class:`ValueError` for options that cannot be used, and :class:`gymnasium.error.DependencyNotInstalled`
    without pygame-ce.
    """

    def __init__(self, config: EnvConfig, pictured: Pictured) -> None:
        if pictured.mode not in (None, *VECTOR_RENDER_MODES):
            raise ValueError(f"render_mode must be None or {' or '.join(VECTOR_RENDER_MODES)}, got {pictured.mode!r}")
        if pictured.follow is not None and whole_number("follow", pictured.follow, 5) > config.size:
            raise ValueError(f"follow must be at most {config.size}, the size of the world, got {pictured.follow}")
        if pictured.mode is not None:
            require_pygame(f'render_mode "{pictured.mode}"')
        self._config, self._follow = config, pictured.follow
        self._seen: dict[int, tuple[Viewer, int, bytes]] = {}  # viewer, time and cells of each world that was drawn

    def __getstate__(self) -> dict[str, object]:
        """Return the state for a copy or a pickle: everything except the viewers."""
        return self.__dict__ | {"_seen": {}}

    def paint(self, number: int, blocks: Block) -> Picture:
        """Return the picture of a world, uint8 ``(height, width, 3)``."""
        from predprey_env.rendering.viewer import Viewer

        at, lane = divmod(number, LANES)
        world = World(*(np.ascontiguousarray(rows[at, :, lane]) for rows in blocks.world))
        time, cells = int(blocks.clock[at, 0, lane]), world.x.tobytes() + world.y.tobytes()
        viewer, last, before = self._seen.get(number) or (Viewer(self._config, RENDER_FPS, self._follow), time, cells)
        if time < last or (time == last and cells != before):
            viewer.begin(self._config)  # another episode
        self._seen[number] = viewer, time, cells
        return viewer.frame(world, time)


class Pictures(Sequence[Picture]):
    """A sequence that holds, for each row of an environment, a picture of its world, drawn only when it is taken."""

    def __init__(self, painters: Painters, blocks: Block, n_rows: int, rows_per_world: int) -> None:
        self._painters, self._blocks = painters, blocks
        self._n_rows, self._rows_per_world = n_rows, rows_per_world

    def __len__(self) -> int:
        """Return the number of rows."""
        return self._n_rows

    @overload
    def __getitem__(self, row: int) -> Picture: ...
    @overload
    def __getitem__(self, row: slice) -> list[Picture]: ...
    def __getitem__(self, row: int | slice) -> Picture | list[Picture]:
        """Return the picture of the world of a row, uint8 ``(height, width, 3)``."""
        if isinstance(row, slice):
            return [self[each] for each in range(*row.indices(len(self)))]
        return self._painters.paint(range(len(self))[row] // self._rows_per_world, self._blocks)
