"""What works with which packages: the environment with its five, training with a few more, and all else with extras.

In the quick tests other packages are hidden from Python; a slow one makes the virtual environment.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import site
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path
from typing import NamedTuple

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import predprey_env

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
ENVIRONMENT = ["gymnasium", "numba", "numpy", "pettingzoo", "pydantic"]
TRAINING = [*ENVIRONMENT, "rich", "safetensors", "tqdm"]

HIDE = """
import sys


class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {hidden!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)


sys.meta_path.insert(0, Hidden())
"""

PLAY = """
from gymnasium.error import DependencyNotInstalled
from predprey_env import env, parallel_env, parallel_vector_env, team_view, vector_env
from predprey_env.rendering import save_video

game = parallel_env(size=6, max_cycles=5, render_mode="ansi")
game.reset(seed=0)
while game.agents:
    game.step({agent: game.action_space(agent).sample() for agent in game.agents})
print(game.render().splitlines()[0].split(",")[0])

turns = env(size=6, max_cycles=2)
turns.reset(seed=0)
for agent in turns.agent_iter():
    _, _, termination, truncation, _ = turns.last()
    turns.step(None if termination or truncation else turns.action_space(agent).sample())

team = team_view("predators", opponent="flee_nearest", n_prey=1)
team.reset(seed=0)
team.step(dict.fromkeys(team.agents, 0))

worlds = vector_env(4, "predators", opponent="flee_nearest", reward="dense")
worlds.reset(seed=0)
worlds.step(worlds.action_space.sample())

both = parallel_vector_env(4, size=6)
both.reset(seed=0)
both.step({agent: both.action_space(agent).sample() for agent in both.agents})

for draw in (
    lambda: parallel_env(render_mode="human"),
    lambda: save_video(iter([]), "chase.gif"),
    lambda: save_video(iter([]), "chase.mp4"),
):
    try:
        draw()
    except DependencyNotInstalled as error:
        print(error)
"""
PLAYED = """\
step 5/5
render_mode "human" needs pygame-ce: pip install "predprey-esp[render]"
a GIF needs pillow: pip install "predprey-esp[render]"
an MP4 needs imageio-ffmpeg: pip install "predprey-esp[render]"
"""

PREDATORS, PREY = (f"run/champions/{role}-00001.safetensors" for role in ("predators", "prey"))
WORK = [
    "train smoke --generations 1 --out run --quiet",
    "resume run --generations 2 --quiet",
    f"evaluate {PREDATORS} --against {PREY} --episodes 8",
    f"replay {PREDATORS} --against flee_nearest",
    f"show {PREDATORS}",
    "watch run",
    "sweep sweep.toml --workers 1 --quiet",
    "behaviours run --generations 1 --episodes 2",
    "solve --size 3 --prey 1 --predators 1",
    "exploitability greedy_chase --role predators --size 3 --prey 1 --predators 1",
    "presets",
    "teams --task 3v1",
]
REFUSED = {
    "analyse run": 'analyse needs {package}: pip install "predprey-esp[analysis]"',
    "report run": 'report needs {package}: pip install "predprey-esp[analysis]"',
    "compare run run": 'compare needs {package}: pip install "predprey-esp[analysis]"',
    "benchmark --policy greedy_chase --role prey --task 3v1": (
        'benchmark needs {package}: pip install "predprey-esp[analysis]"'
    ),
    f"replay {PREDATORS} --against {PREY} --gif a.gif": (
        'a picture needs pygame-ce: pip install "predprey-esp[render]"'
    ),
    f"replay {PREDATORS} --against {PREY} --mp4 a.mp4": (
        'a picture needs pygame-ce: pip install "predprey-esp[render]"'
    ),
    "train smoke --out begun --tensorboard": (
        'a log for TensorBoard needs tensorboard: pip install "predprey-esp[tensorboard]"'
    ),
    "train smoke --out begun --address local": 'a Ray cluster needs ray: pip install "predprey-esp[ray]"',
    "resume run --generations 3 --address local": 'a Ray cluster needs ray: pip install "predprey-esp[ray]"',
    "sweep sweep.toml --out begun --address local": 'a Ray cluster needs ray: pip install "predprey-esp[ray]"',
}
COMMANDS = {line.split()[0] for line in [*WORK, *REFUSED]}
HELP = ["--help", *(f"{command} --help" for command in sorted(COMMANDS))]
RUN_ALL = """
import contextlib, io, json, sys
from esp_trainer.cli import main

for line in json.load(sys.stdin):
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        try:
            code = main(line.split())
        except SystemExit as end:
            code = end.code
    print(json.dumps([line, [code, out.getvalue(), err.getvalue()]]), flush=True)
"""


class Outcome(NamedTuple):
    """What a command came to."""

    code: int
    out: str
    err: str


def with_dependencies(names: list[str]) -> set[str]:
    """Return the packages of these names and all that they depend on, in normal form."""
    found: set[str] = set()
    pending = [*names, "predprey-esp"]
    while pending:
        name = canonicalize_name(pending.pop())
        if name not in found:
            found.add(name)
            try:
                wanted = [] if name == "predprey-esp" else requires(name) or []
            except PackageNotFoundError:  # for another platform, or another Python
                continue
            needed = [Requirement(each) for each in wanted]
            pending += [each.name for each in needed if not each.marker or each.marker.evaluate({"extra": ""})]
    return found


def run_with(packages: list[str], program: str, place: Path, given: str = "") -> str:
    """Run a program in a Python that finds only these packages and what they need; return what it prints."""
    known = with_dependencies(packages)
    hidden = {
        module
        for module, packages in packages_distributions().items()
        if not known & {canonicalize_name(package) for package in packages}
    }
    assert {"matplotlib", "scipy", "pygame", "PIL", "plotly", "choix", "ruptures", "ray", "tensorboard"} <= hidden
    (place / "hide").mkdir()
    (place / "hide/sitecustomize.py").write_text(HIDE.format(hidden=hidden))  # the workers of a sweep import it too
    path = os.pathsep.join([str(place / "hide"), str(ROOT)])
    return run([sys.executable, "-c", program], place, given, PYTHONPATH=path)


def run(command: list[str | Path], place: Path, given: str = "", **variables: str) -> str:
    done = subprocess.run(
        command, cwd=place, input=given, env=os.environ | variables, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_declared_dependencies_are_those_of_the_environment_and_of_training() -> None:
    assert [Requirement(each).name for each in PROJECT["dependencies"]] == TRAINING


def test_the_extra_all_has_every_extra_of_a_use() -> None:
    extras = PROJECT["optional-dependencies"]
    (everything,) = map(Requirement, extras["all"])
    assert everything.extras == extras.keys() - {"all", "test", "docs", "dev"}


def test_a_page_says_what_each_extra_is_for() -> None:
    told = re.findall(r'^\| `"\.\[(\w+)\]"`', (ROOT / "docs/training.md").read_text(), re.MULTILINE)
    assert set(told) == PROJECT["optional-dependencies"].keys() - {"test", "docs", "dev"}


def test_the_environments_need_five_packages(tmp_path: Path) -> None:
    assert run_with(ENVIRONMENT, PLAY, tmp_path) == PLAYED


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Outcome]:
    """The outcome of each command without any extra, all run in turn in one place."""
    place = tmp_path_factory.mktemp("base")
    (place / "sweep.toml").write_text('preset = "smoke"\nseeds = 3\n[fields]\ngenerations = 1\n')
    printed = run_with(TRAINING, RUN_ALL, place, json.dumps([*WORK, *REFUSED, *HELP]))
    assert not (place / "begun").exists(), "a command that lacks an extra has begun its work"
    assert not list(place.glob("a.*"))
    return {line: Outcome(*outcome) for line, outcome in map(json.loads, printed.splitlines())}


# Each of these looks at all commands, because the fixture is made anew in every process that runs one of them.


def test_training_and_what_belongs_to_it_need_no_extra(outcomes: dict[str, Outcome]) -> None:
    for line in WORK:
        code, out, err = outcomes[line]
        assert code == 0, f"{line}: {err}"
        assert out or err, line


def test_a_command_whose_extra_is_missing_says_how_to_install_it(outcomes: dict[str, Outcome]) -> None:
    for line, reason in REFUSED.items():
        code, out, err = outcomes[line]
        expected = re.escape(f"esp-trainer: {reason}\n").replace(r"\{package\}", r"\w+")
        assert (code, out) == (1, ""), line
        assert re.fullmatch(expected, err), f"{line}: {err}"


def test_help_needs_no_extra(outcomes: dict[str, Outcome]) -> None:
    for line in HELP:
        code, out, _ = outcomes[line]
        assert code == 0, line
        assert out.startswith("usage: esp-trainer"), line


def test_every_command_is_tried_without_extras(outcomes: dict[str, Outcome]) -> None:
    listed = set(re.findall(r"^    (\w+)", outcomes["--help"].out, re.MULTILINE))
    assert listed == COMMANDS


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A copy of the project, because pip leaves files where it builds."""
    for name in ("predprey_env", "esp_trainer"):
        shutil.copytree(ROOT / name, tmp_path / "project" / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tmp_path / "project")
    return tmp_path / "project"


@pytest.fixture
def distribution(project: Path, tmp_path: Path) -> Path:
    """A folder with the source distribution, and the wheel that is built from it."""
    command = [sys.executable, "-m", "build", "--outdir", str(tmp_path / "dist"), str(project)]
    _or_skip(subprocess.run(command, capture_output=True, text=True, check=False))
    return tmp_path / "dist"


@pytest.fixture
def programs(distribution: Path, tmp_path: Path) -> Path:
    """The programs of a new virtual environment with the wheel; what it depends on comes from the tests' own."""
    venv.create(tmp_path / "venv")
    programs = tmp_path / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    command = [sys.executable, "-m", "pip", "--python", programs / "python", "install", "--quiet", "--no-deps"]
    run([*command, *distribution.glob("*.whl")], tmp_path, PYTHONPATH="")
    (packages,) = (tmp_path / "venv").rglob("site-packages")
    (packages / "tests.pth").write_text("\n".join(site.getsitepackages()))
    return programs


def _or_skip(done: subprocess.CompletedProcess[str]) -> None:
    """Skip a test where no package can be downloaded, but not in CI."""
    if done.returncode and not os.environ.get("CI"):
        pytest.skip(f"packages cannot be installed here: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_wheel_runs_away_from_the_checkout(distribution: Path, programs: Path, tmp_path: Path) -> None:
    files = {
        file.relative_to(ROOT).as_posix()
        for package in ("predprey_env", "esp_trainer")
        for file in (ROOT / package).rglob("*")
        if file.is_file() and file.parent.name != "__pycache__"
    }
    assert {"predprey_env/py.typed", "esp_trainer/py.typed", "esp_trainer/teams/zoo/index.json"} < files
    (wheel,), (source,) = distribution.glob("*.whl"), distribution.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        assert {name for name in archive.namelist() if ".dist-info/" not in name} == files
    with tarfile.open(source) as archive:
        assert files < {name.partition("/")[2] for name in archive.getnames()}
    for line in (WORK[0], WORK[-1]):  # what is compiled, and the zoo's files
        run([programs / "esp-trainer", *line.split()], tmp_path, PYTHONPATH="")
    places = "import esp_trainer, predprey_env; print(esp_trainer.__file__, predprey_env.__file__)"
    found = run([programs / "python", "-c", places], tmp_path, PYTHONPATH="").split()
    assert all(Path(file).is_relative_to(tmp_path / "venv") for file in found)
    told = run([programs / "esp-trainer", "--version"], tmp_path, PYTHONPATH="")
    assert told == f"esp-trainer {predprey_env.__version__}\n"
