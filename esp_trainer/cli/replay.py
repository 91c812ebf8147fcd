"""``replay``: an episode of two teams as text, or as a video."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from itertools import compress
from pathlib import Path

from esp_trainer.analysis.replay import Trajectory, as_pictures, as_text, play_episode, seen_in
from esp_trainer.cli.streams import is_screen
from esp_trainer.cli.teams import pair
from esp_trainer.files import check_place
from predprey_env.arrays import Picture
from predprey_env.extras import require_pygame
from predprey_env.rendering import save_video
from predprey_env.rendering.video import check_encoder

_LAST_LOOK = 2  # seconds that the last picture of a video stays


def replay(
    team: str, against: str, seed: int, fps: int, steps: range, videos: Sequence[Path], follow: int | None = None
) -> int:
    """Play one episode, and show it as text or write videos."""
    for video in videos:
        require_pygame("a picture")
        check_encoder(video)
        check_place(video)
    if follow and not videos:
        raise ValueError("--follow is for pictures: say --gif or --mp4 too")
    players, env = pair(team, against)
    if follow and follow > env.size:
        raise ValueError(f"--follow must be at most the {env.size} cells of the world, got {follow}")
    policies = {role: player.policy(role, env) for role, player in players.items()}
    if steps.stop <= steps.start:
        raise ValueError(f"--until must be at least --from, got {steps.stop - 1} and {steps.start}")
    episode = play_episode(policies["predators"], policies["prey"], env, seed)
    shown = [steps.start <= time < steps.stop for time in episode.times]
    if not any(shown):
        raise ValueError(f"the episode ends at step {episode.times[-1]:.0f}, before --from {steps.start}")
    if not videos:
        _print(compress(as_text(episode), shown), fps)
        return 0
    for video in videos:
        save_video(_with_last_look(compress(as_pictures(episode, fps, follow), shown), fps), video, fps)
        print(f"{video}: {_outcome(episode, steps)}")
    return 0


def _print(frames: Iterable[str], fps: int) -> None:
    moving = is_screen(sys.stdout)
    for frame in frames:
        print(("\x1b[H\x1b[2J" if moving else "") + frame, flush=True)
        if moving:
            time.sleep(1 / fps)


def _with_last_look(pictures: Iterable[Picture], fps: int) -> Iterator[Picture]:
    """Yield the pictures, and repeat the last one."""
    for picture in pictures:
        yield picture
    yield from [picture] * (_LAST_LOOK * fps)


def _outcome(episode: Trajectory, steps: range) -> str:
    """Return a line about a part of an episode: captures and behaviours."""
    last = min(steps.stop - 1, int(episode.times[-1]))
    caught = int((episode.worlds[episode.times.index(last)].alive == 0).sum())
    seen = [name for name, rows in seen_in(episode).items() if rows[steps.start : last + 1].any()]
    what = ", ".join(seen) or "no known behaviour"
    return f"{caught} of {episode.env.n_prey} prey caught by step {last}; {what}"
