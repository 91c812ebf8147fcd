from __future__ import annotations

import errno
import os
import re
import sys
from decimal import Decimal
from fractions import Fraction
from itertools import groupby, pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled
from PIL import Image

from predprey_env import EnvConfig, PredPreyEnv
from predprey_env.rendering import save_video


def episode(n_steps: int = 12) -> list[np.ndarray]:
    env = PredPreyEnv(EnvConfig(max_cycles=n_steps), "rgb_array")
    env.reset(seed=0)
    frames = [env.render()]
    while env.agents:
        env.step(dict.fromkeys(env.agents, 0))
        frames.append(env.render())
    return [frame for frame in frames if isinstance(frame, np.ndarray)]


def read_gif(path: Path) -> tuple[list[np.ndarray], list[int]]:
    """Frames, and how long each is shown, in milliseconds."""
    frames, durations = [], []
    with Image.open(path) as gif:
        for i in range(gif.n_frames):
            gif.seek(i)
            frames.append(np.array(gif.convert("RGB")))
            durations.append(gif.info["duration"])
        assert gif.info["loop"] == 0
    return frames, durations


def read_mp4(path: Path) -> tuple[list[np.ndarray], float]:
    """Frames, and how many of them a second."""
    reader = imageio_ffmpeg.read_frames(str(path))
    meta = next(reader)
    width, height = meta["size"]
    return [np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in reader], meta["fps"]


def test_a_gif_holds_every_frame_in_its_colours_at_its_time(tmp_path: Path) -> None:
    frames = episode()
    save_video(iter(frames), tmp_path / "chase.gif", fps=15)
    read, durations = read_gif(tmp_path / "chase.gif")
    assert len(read) == len(frames) == 13
    for frame, same in zip(frames, read, strict=True):
        assert (frame == same).all(axis=-1).mean() > 0.995
        assert np.abs(frame.astype(int) - same).max() < 24  # a palette has 256 colours
    assert set(durations[:-1]) == {60, 70}
    assert sum(durations[:-1]) == pytest.approx(12 * 1000 / 15, abs=10)


def test_a_film_holds_every_frame_at_its_time(tmp_path: Path) -> None:
    frames = episode()
    save_video(frames, str(tmp_path / "chase.MP4"), fps=15)
    read, fps = read_mp4(tmp_path / "chase.MP4")
    assert fps == 15
    assert len(read) == 13
    for frame, similar in zip(frames, read, strict=True):
        assert np.abs(frame.astype(int) - similar).mean() < 3
    assert all((one != other).any() for one, other in pairwise(read))


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_frames_may_have_odd_sides(tmp_path: Path, suffix: str) -> None:
    frame = np.full((31, 45, 3), (230, 159, 0), np.uint8)
    save_video([frame, frame], tmp_path / f"odd{suffix}")
    read = (read_gif if suffix == ".gif" else read_mp4)(tmp_path / f"odd{suffix}")[0][0]
    assert read.shape == ((31, 45, 3) if suffix == ".gif" else (32, 46, 3))
    assert np.abs(read.astype(int)[:28, :40] - (230, 159, 0)).max() < 12  # the film is padded


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
@pytest.mark.parametrize("name", ["12:30", "file:a", "-y", "100%d %s", "größe", "a b", "pipe:1", "x" * 240])
def test_a_file_may_have_any_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, suffix: str) -> None:
    monkeypatch.chdir(tmp_path)
    frame = np.full((16, 16, 3), (230, 159, 0), np.uint8)
    save_video([frame], name + suffix)
    (file,) = tmp_path.iterdir()
    assert file.name == name + suffix
    read = (read_gif if suffix == ".gif" else read_mp4)(file)[0][0]
    assert np.abs(read.astype(int) - (230, 159, 0)).max() < 12


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_link_stays_one_and_the_file_that_it_leads_to_is_written(tmp_path: Path, suffix: str) -> None:
    link, file = tmp_path / f"link{suffix}", tmp_path / f"file{suffix}"
    file.write_text("older")
    link.symlink_to(file.name)
    save_video([np.zeros((16, 16, 3), np.uint8)], link)
    assert link.readlink() == Path(file.name)
    assert file.stat().st_size > 20


FPS = [15, 15.0, np.float32(15), np.int64(15), np.uint8(15), np.array(15), Fraction(15), Decimal(15)]


@pytest.mark.parametrize("fps", FPS, ids=lambda fps: type(fps).__name__)
def test_a_rate_may_be_any_number(tmp_path: Path, fps: Any) -> None:
    frames = [np.full((16, 16, 3), level, np.uint8) for level in (0, 100, 200)]
    for suffix in (".gif", ".mp4"):
        save_video(frames, tmp_path / f"chase{suffix}", fps)
    assert read_gif(tmp_path / "chase.gif")[1] == [70, 70, 60]
    assert read_mp4(tmp_path / "chase.mp4")[1] == 15


def test_of_more_frames_than_a_gif_can_show_it_shows_some_and_takes_as_long(tmp_path: Path) -> None:
    frames = [np.full((8, 8, 3), level, np.uint8) for level in range(40)]
    save_video(frames, tmp_path / "chase.gif", fps=200)
    read, durations = read_gif(tmp_path / "chase.gif")
    assert [int(frame[0, 0, 0]) for frame in read] == list(range(0, 40, 2))
    assert durations == [10] * 20


BLACK, WHITE = np.zeros((8, 8, 3), np.uint8), np.full((8, 8, 3), 255, np.uint8)
CORNER = BLACK.copy()
CORNER[0, 0] = 255


@pytest.mark.parametrize(
    ("frames", "fps", "shown"),
    [
        ([BLACK] * 700, 1, [(BLACK, 700_000)]),
        ([BLACK] * 10_000, 1, [(BLACK, 10_000_000)]),
        ([BLACK] * 3 + [WHITE] * 700 + [BLACK], 1, [(BLACK, 3_000), (WHITE, 700_000), (BLACK, 1_000)]),
        ([BLACK, *[CORNER] * 2_000, WHITE], 1, [(BLACK, 1_000), (CORNER, 2_000_000), (WHITE, 1_000)]),
        ([BLACK, WHITE], 0.001, [(BLACK, 1_000_000), (WHITE, 1_000_000)]),
        ([CORNER], 1e-6, [(CORNER, 1_000_000_000)]),
        ([BLACK, WHITE], 1e300, [(BLACK, 10)]),
    ],
)
def test_a_frame_of_a_gif_may_be_shown_for_longer_than_a_picture_can(
    tmp_path: Path, frames: list[np.ndarray], fps: float, shown: list[tuple[np.ndarray, int]]
) -> None:
    """A picture has room for 655.35 s."""
    save_video(frames, tmp_path / "chase.gif", fps)
    read = [(picture.tobytes(), duration) for picture, duration in zip(*read_gif(tmp_path / "chase.gif"), strict=True)]
    equal = [list(group) for _, group in groupby(read, key=itemgetter(0))]
    found = [(group[0][0], sum(duration for _, duration in group)) for group in equal]
    assert found == [(frame.tobytes(), duration) for frame, duration in shown]


@pytest.mark.parametrize(
    ("suffix", "frame", "fps", "line"),
    [
        (".gif", BLACK, 1e-300, r"a GIF lasts at most 1000000 s, got 1 frames at 1e-300 a second"),
        (".gif", np.zeros((1, 70_000, 3), np.uint8), 15, r"a GIF is at most 65535 pixels .*, got frames of 1 x 70000"),
        (".gif", np.zeros((65_536, 1, 3), np.uint8), 15, r"a GIF is at most 65535 pixels .*, got frames of 65536 x 1"),
        (".mp4", BLACK, 1e-300, r"fps of an MP4 must be in 0\.001\.\.1000000, got 1e-300"),
        (".mp4", BLACK, 1e300, r"fps of an MP4 must be in 0\.001\.\.1000000, got 1e\+300"),
    ],
)
def test_what_a_format_cannot_hold_is_refused(
    tmp_path: Path, suffix: str, frame: np.ndarray, fps: float, line: str
) -> None:
    with pytest.raises(ValueError, match=f"^{line}$"):
        save_video([frame], tmp_path / f"chase{suffix}", fps)
    assert list(tmp_path.iterdir()) == []


def test_what_does_not_move_in_a_gif_keeps_its_colours_among_many_others(tmp_path: Path) -> None:
    random, still = np.random.default_rng(0), np.full((64, 64, 3), (20, 24, 33), np.uint8)
    frames = [still.copy() for _ in range(4)]
    for frame in frames:
        frame[:16] = random.integers(0, 256, (16, 64, 3))
    save_video(frames, tmp_path / "chase.gif")
    read = read_gif(tmp_path / "chase.gif")[0]
    for frame, same in zip(frames, read, strict=True):
        assert (same[16:] == frame[16:]).all()
        assert np.abs(frame.astype(int) - same).mean() < 8


def test_of_up_to_255_colours_a_gif_keeps_all(tmp_path: Path) -> None:
    levels = np.arange(255, dtype=np.uint8)
    frame = np.stack([levels, levels[::-1], levels // 2], axis=-1)[None].repeat(8, axis=0)
    save_video([frame, frame[:, ::-1]], tmp_path / "chase.gif")
    read = read_gif(tmp_path / "chase.gif")[0]
    assert (np.stack(read) == np.stack([frame, frame[:, ::-1]])).all()


@pytest.mark.parametrize("name", ["chase.avi", "chase", "gif"])
def test_an_unknown_kind_of_file_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match=rf"^a video must be a \.gif or \.mp4 file, got '.*{name}'$"):
        save_video(episode(1), tmp_path / name)


WRONG = {
    "nothing was drawn": ([None], r"^frame 0 must be an array, as render_mode=\"rgb_array\" gives, got None$"),
    "text": (["step 0"], r"^frame 0 must be an array, as render_mode=\"rgb_array\" gives, got 'step 0'$"),
    "no frames": ([], r"^a video needs at least one frame, got none$"),
    "floats": (
        [np.zeros((8, 8, 3))],
        r"^frame 0 must be uint8 of shape \(height, width, 3\), got float64 of shape \(8, 8, 3\)$",
    ),
    "grey": (
        [np.zeros((8, 8), np.uint8)],
        r"^frame 0 must be uint8 of shape \(height, width, 3\), got uint8 of shape \(8, 8\)$",
    ),
    "nothing in it": (
        [np.zeros((0, 8, 3), np.uint8)],
        r"^frame 0 must be uint8 of shape \(height, width, 3\), got uint8 of shape \(0, 8, 3\)$",
    ),
    "two sizes": (
        [np.zeros((8, 8, 3), np.uint8), np.zeros((8, 6, 3), np.uint8)],
        r"^frame 1 must be uint8 of shape \(8, 8, 3\), got uint8 of shape \(8, 6, 3\)$",
    ),
}


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
@pytest.mark.parametrize("fault", WRONG)
def test_unfit_frames_leave_what_was_there(tmp_path: Path, fault: str, suffix: str) -> None:
    frames, line = WRONG[fault]
    path = tmp_path / f"chase{suffix}"
    path.write_text("older")
    with pytest.raises(ValueError, match=line):
        save_video(frames, path)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "older"


@pytest.mark.parametrize(
    "fps", ["15", None, True, float("inf"), Decimal("inf"), Decimal("sNaN"), np.array([15.0]), 15j]
)
def test_a_rate_that_is_no_number_is_refused(tmp_path: Path, fps: Any) -> None:
    with pytest.raises(ValueError, match=rf"^fps must be a finite number, got {re.escape(repr(fps))}$"):
        save_video(episode(1), tmp_path / "chase.gif", fps)


def test_a_rate_beyond_all_floats_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"^fps must be a finite number, got 10{99}\.\.\.$"):
        save_video(episode(1), tmp_path / "chase.gif", 10**400)


@pytest.mark.parametrize("fps", [0, -1, float("nan"), Decimal("NaN")])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, fps: float) -> None:
    with pytest.raises(ValueError, match=rf"^fps must be greater than 0, got {fps}$"):
        save_video(episode(1), tmp_path / "chase.gif", fps)


def test_a_place_that_cannot_be_written_to_is_named(tmp_path: Path) -> None:
    missing = tmp_path / "nowhere" / "chase.gif"
    with pytest.raises(OSError, match=rf"^cannot write {missing}: No such file or directory$"):
        save_video(episode(1), missing)
    taken = tmp_path / "taken.mp4"
    taken.mkdir()
    with pytest.raises(OSError, match=rf"^cannot write {taken}: Is a directory$"):
        save_video(episode(1), taken)
    assert list(tmp_path.iterdir()) == [taken]


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_link_that_leads_to_itself_stays_one(tmp_path: Path, suffix: str) -> None:
    one, other = tmp_path / f"one{suffix}", tmp_path / f"other{suffix}"
    one.symlink_to(other.name)
    other.symlink_to(one.name)
    with pytest.raises(OSError, match=rf"^cannot write {one}: {os.strerror(errno.ELOOP)}$"):
        save_video([BLACK], one)
    assert one.readlink() == Path(other.name)
    assert other.readlink() == Path(one.name)


@pytest.mark.skipif(os.name != "posix", reason="the false encoder is a shell script")
@pytest.mark.parametrize("leaves", ["nothing", "an empty file"])
def test_a_file_that_the_encoder_did_not_write_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, leaves: str
) -> None:
    encoder, place = tmp_path / "encoder", tmp_path / "place"
    place.mkdir()
    out = '"${@: -1}"' if leaves == "an empty file" else ""
    encoder.write_text(f"#!/bin/bash\ncat > /dev/null\ntouch /dev/null {out}\n")
    encoder.chmod(0o755)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(encoder))
    with pytest.raises(OSError, match=rf"^cannot write {place}/chase\.mp4: ffmpeg failed$"):
        save_video(episode(1), place / "chase.mp4")
    assert list(place.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="the false encoder is a shell script")
@pytest.mark.parametrize("reads", ["cat > /dev/null", "true"], ids=["all frames", "nothing"])
@pytest.mark.parametrize(
    ("says", "reason"),
    [
        ("[mp4 @ 0x5] Error writing trailer: No space left on device", "No space left on device"),
        ("[mp4 @ 0x5] code: -28 (No space left on device)\n[out @ 0x6] got no packets", "No space left on device"),
        ("[mp4 @ 0x5] too: odd\n[out @ 0x6] gives up", r"ffmpeg failed: \[out @ 0x6\] gives up"),
    ],
)
def test_a_file_that_the_encoder_wrote_in_part_is_an_error_and_the_older_one_stays(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    reads: str,
    says: str,
    reason: str,
) -> None:
    """As on a disk that is full."""
    encoder, path = tmp_path / "encoder", tmp_path / "place/chase.mp4"
    path.parent.mkdir()
    path.write_text("older")
    encoder.write_text(f'#!/bin/bash\n{reads}\necho half > "${{@: -1}}"\ncat >&2 <<< "{says}"\nexit 1\n')
    encoder.chmod(0o755)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(encoder))
    with pytest.raises(OSError, match=rf"^cannot write {path}: {reason}$"):
        save_video(episode(), path)
    assert list(path.parent.iterdir()) == [path]
    assert path.read_text() == "older"
    assert capfd.readouterr().err == "", "the error says it"


def test_without_ffmpeg_a_film_is_refused_in_one_line_and_a_gif_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    frame = np.zeros((8, 8, 3), np.uint8)
    with pytest.raises(
        DependencyNotInstalled,
        match=r'^an MP4 needs imageio-ffmpeg: pip install "predprey-esp\[render\]"$',
    ):
        save_video([frame], tmp_path / "chase.mp4")
    save_video([frame], tmp_path / "chase.gif")
    assert [file.name for file in tmp_path.iterdir()] == ["chase.gif"]
    assert (read_gif(tmp_path / "chase.gif")[0][0] == 0).all()


def test_without_pillow_a_gif_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(DependencyNotInstalled, match=r'^a GIF needs pillow: pip install "predprey-esp\[render\]"$'):
        save_video([BLACK], tmp_path / "chase.gif")


def test_pettingzoo_records_an_episode(tmp_path: Path) -> None:
    wrappers = pytest.importorskip("pettingzoo.utils.wrappers.record_video_parallel", reason="older PettingZoo")
    inner = PredPreyEnv(EnvConfig(max_cycles=9), "rgb_array")
    env = wrappers.RecordVideoParallel(inner, str(tmp_path / "videos"), episode_trigger=lambda _: True)
    env.reset(seed=0)
    while env.agents:
        env.step(dict.fromkeys(env.agents, 2))
    env.close()
    (path,) = (tmp_path / "videos").iterdir()
    frames, fps = read_mp4(path)
    assert (len(frames), fps, frames[0].shape) == (10, PredPreyEnv.metadata["render_fps"], (672, 640, 3))
