"""``replay`` into files that move."""

from __future__ import annotations

import builtins
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

EspTrainer = Callable[..., Any]


@pytest.mark.parametrize(("option", "beginning"), [("--gif", b"GIF89a"), ("--mp4", b"\0\0\0\x20ftyp")])
def test_an_episode_becomes_a_video(
    option: str, beginning: bytes, esp_trainer: EspTrainer, predators: Path, prey: Path, tmp_path: Path
) -> None:
    video = tmp_path / f"chase.{option[2:]}"
    outcome = esp_trainer("replay", predators, "--against", prey, option, video, "--until", "12")
    assert outcome.code == 0, outcome
    assert video.read_bytes().startswith(beginning)
    (line,) = outcome.out.splitlines()
    assert line.startswith(f"{video}: ")
    assert "prey caught by step 12; " in line


def test_both_at_once_and_the_same_each_time(
    esp_trainer: EspTrainer, predators: Path, prey: Path, tmp_path: Path
) -> None:
    clips = [tmp_path / name for name in ("a.gif", "b.gif")]
    for clip in clips:
        assert esp_trainer("replay", predators, "--against", prey, "--gif", clip, "--until", "9").code == 0
    assert clips[0].read_bytes() == clips[1].read_bytes()
    both = esp_trainer("replay", predators, "--against", prey, "--gif", clips[0], "--mp4", tmp_path / "c.mp4")
    assert len(both.out.splitlines()) == 2


def test_a_part_of_an_episode_is_that_part(esp_trainer: EspTrainer, predators: Path, prey: Path) -> None:
    whole = esp_trainer("replay", predators, "--against", prey).out
    part = esp_trainer("replay", predators, "--against", prey, "--from", "2", "--until", "4").out
    assert part in whole
    assert [line.split("/")[0] for line in part.splitlines() if line.startswith("step")] == [
        "step 2",
        "step 3",
        "step 4",
    ]


def test_mistakes_are_one_line(esp_trainer: EspTrainer, predators: Path, prey: Path, tmp_path: Path) -> None:
    pair = ("replay", predators, "--against", prey)
    assert "--gif: must end in .gif, got 'a.mp4'" in esp_trainer(*pair, "--gif", "a.mp4").refusal
    assert "--mp4: must end in .mp4, got 'a'" in esp_trainer(*pair, "--mp4", "a").refusal
    assert "--until must be at least --from, got 3 and 4" in esp_trainer(*pair, "--from", "4", "--until", "3").refusal
    assert "before --from 5000" in esp_trainer(*pair, "--from", "5000").refusal
    assert "no/such" in esp_trainer(*pair, "--gif", tmp_path / "no/such/a.gif").refusal


def test_without_pygame_it_says_what_to_install(
    esp_trainer: EspTrainer, predators: Path, prey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pygame", None)
    refusal = esp_trainer("replay", predators, "--against", prey, "--gif", tmp_path / "a.gif").refusal
    assert refusal == 'esp-trainer: a picture needs pygame-ce: pip install "predprey-esp[render]"'
    assert builtins.list(tmp_path.glob("*.gif")) == []


def test_without_ffmpeg_a_gif_is_written_and_an_mp4_refused(
    esp_trainer: EspTrainer, predators: Path, prey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    pair = ("replay", predators, "--against", prey, "--until", "3")
    assert esp_trainer(*pair, "--gif", tmp_path / "12:30.gif").code == 0
    assert (tmp_path / "12:30.gif").read_bytes().startswith(b"GIF89a")
    refusal = esp_trainer(*pair, "--mp4", tmp_path / "a.mp4").refusal
    assert refusal == 'esp-trainer: an MP4 needs imageio-ffmpeg: pip install "predprey-esp[render]"'
    assert [file.name for file in tmp_path.iterdir()] == ["12:30.gif"]


def test_a_camera_that_follows_is_for_pictures_and_sees_at_most_the_world(
    esp_trainer: EspTrainer, predators: Path, prey: Path, tmp_path: Path
) -> None:
    pair = ("replay", predators, "--against", prey)
    clips = [tmp_path / "whole.gif", tmp_path / "near.gif"]
    assert esp_trainer(*pair, "--gif", clips[0], "--until", "2").code == 0
    assert esp_trainer(*pair, "--gif", clips[1], "--until", "2", "--follow", "8").code == 0
    assert clips[0].read_bytes() != clips[1].read_bytes()
    assert esp_trainer(*pair, "--follow", "8").refusal.endswith("--follow is for pictures: say --gif or --mp4 too")
    refusal = esp_trainer(*pair, "--gif", tmp_path / "a.gif", "--follow", "13").refusal
    assert refusal.endswith("--follow must be at most the 12 cells of the world, got 13")
