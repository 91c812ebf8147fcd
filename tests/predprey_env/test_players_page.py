"""The page about players in compiled code: its code runs, and its rule agrees with its policy in Python."""

import re
from pathlib import Path

import numpy as np

from predprey_env import vector_env

PAGE = (Path(__file__).parents[2] / "docs/players.md").read_text()


def test_the_player_of_the_page_plays_like_its_policy_in_python() -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict = {}
    exec(compile(code, "docs/players.md", "exec"), names)
    compiled, plain = names["PatientPredators"](), names["PatientPredators"]()
    plain.compiled = None
    worlds = [vector_env(3, "prey", opponent=each, n_prey=2, size=9) for each in (compiled, plain)]
    seen = [each.reset(seed=4)[0] for each in worlds]
    generator, caught = np.random.default_rng(0), 0
    for _ in range(30):
        assert (seen[0] == seen[1]).all()
        actions = generator.integers(0, 4, worlds[0].num_envs)
        (seen_0, *_, infos), (seen_1, *_) = (each.step(actions) for each in worlds)
        seen, caught = [seen_0, seen_1], caught + infos["n_captured"].sum()
    assert caught
