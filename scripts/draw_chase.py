"""Draw an episode of two saved teams: as a GIF or MP4, or the end of it as a PNG.

    python scripts/draw_chase.py PREDATORS PREY --seed 3 --out docs/chase.gif

Without a seed: of a hundred the one in which most prey are caught, and of equal ones the shortest.
"""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from esp_trainer import Team
from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.rendering import save_video

SEEDS = 100
FPS = PredPreyEnv.metadata["render_fps"]
LAST_LOOK = 2  # seconds that the end of the episode stays


def main() -> None:
    """Choose an episode and draw it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("predators")
    parser.add_argument("prey")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--out", type=Path, default=Path("chase.gif"))
    options = parser.parse_args()
    try:
        seed = chase(Team.load(options.predators), Team.load(options.prey), options.seed, options.out)
    except (OSError, ValueError) as error:
        parser.error(str(error))
    print(f"seed {seed}: {options.out}")


def chase(predators: Team, prey: Team, seed: int | None, out: Path) -> int:
    """Draw the episode of a seed, or of a seed worth seeing; returns the seed."""
    world = EnvConfig.from_dict(predators.provenance["env"])
    if seed is None:
        unseen = PredPreyEnv(world)
        seed = min(range(SEEDS), key=lambda seed: ending(unseen, predators, prey, seed))
    draw(play(PredPreyEnv(world, "rgb_array"), predators, prey, seed), out)
    return seed


def play(env: PredPreyEnv, predators: Team, prey: Team, seed: int) -> Iterator[np.ndarray]:
    """What the environment renders at the start of an episode and after each step."""
    observations, _ = env.reset(seed=seed)
    yield env.render()
    while env.agents:
        observations, *_ = env.step(predators.act(observations) | prey.act(observations))
        yield env.render()


def ending(env: PredPreyEnv, predators: Team, prey: Team, seed: int) -> tuple[int, int]:
    """How many prey are free at the end, and the steps until then."""
    steps = sum(1 for _ in play(env, predators, prey, seed)) - 1
    return int(env.state()[2 * env.config.n_agents : -1].sum()), steps


def draw(frames: Iterator[np.ndarray], out: Path) -> None:
    """Save the pictures of an episode."""
    if out.suffix == ".png":
        import pygame  # later than the environment, which asks it not to print a greeting

        (last,) = deque(frames, maxlen=1)
        pygame.image.save(pygame.surfarray.make_surface(last.swapaxes(0, 1)), out)
    else:
        save_video(with_last_look(frames), out, FPS)


def with_last_look(frames: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    """The frames, the last of them for longer."""
    for frame in frames:
        yield frame
    yield from [frame] * (LAST_LOOK * FPS)


if __name__ == "__main__":
    main()
