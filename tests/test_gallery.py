"""The page ``docs/gallery.md``: its commands show what they are named after."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from esp_trainer import load_team
from esp_trainer.analysis.replay import captions, play_episode, seen_in
from predprey_env import EnvConfig

ROOT = Path(__file__).parents[1]
COMMANDS = re.findall(
    r"^esp-trainer (replay .* --gif docs/gallery/.*)$", (ROOT / "docs/gallery.md").read_text(), re.MULTILINE
)


def test_there_is_a_clip_of_each_behaviour_that_the_paper_names() -> None:
    names = {Path(command.split()[-1]).stem for command in COMMANDS}
    assert names == {"herding", "scattering", "baiting", "sidestepping", "role-switch"}
    assert names == {file.stem for file in (ROOT / "docs/gallery").glob("*.gif")}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_clip_shows_what_it_is_named_after(command: str) -> None:
    _, predators, _, prey, *options = shlex.split(command)
    given = dict(zip(options[::2], options[1::2], strict=True))
    name = Path(given["--gif"]).stem.replace("-", " ")
    teams = load_team(predators), load_team(prey)
    episode = play_episode(*teams, EnvConfig.from_dict(teams[0].provenance["env"]), int(given["--seed"]))
    shown = slice(int(given["--from"]), int(given["--until"]) + 1)
    assert seen_in(episode)[name][shown].any()
    assert any(name in caption for caption in captions(episode)[shown])
