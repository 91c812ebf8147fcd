"""What is wrong is said in one line, with a non-zero exit, and nothing that was there has changed."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
import pytest

from esp_trainer.cli.parser import make_parser
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.fused import FusedEvaluator
from esp_trainer.files import read_arrays, write_arrays
from esp_trainer.run.directory import RunDirectory

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_COMMAND = [sys.executable, "-c", "import sys; from esp_trainer.cli import main; sys.exit(main())"]

Command = tuple[list[str], str]

COMMANDS: dict[str, Command] = {
    "no command": ([], "required: COMMAND"),
    "unknown command": (["trian"], "invalid choice: 'trian'"),
    "unknown preset": (["train", "smok"], "unknown preset smok; did you mean smoke?"),
    "unknown preset like none": (["train", "xyzzy"], "unknown preset xyzzy; there are race-3v1, race-3v2, "),
    "no preset": (["train"], "required: PRESET"),
    "a preset with half its name": (["train", "race"], "unknown preset race; did you mean race-3v1?"),
    "a preset to describe": (["presets", "paper-3v3"], "unknown preset paper-3v3; did you mean paper-3v2?"),
    "unknown option": (["train", "smoke", "--ouput", "x"], "unknown option --ouput; did you mean --out?"),
    "unknown field": (["train", "smoke", "--esp.n_trails", "5"], "--esp.n_trails; did you mean --esp.n_trials?"),
    "field of a section": (["train", "smoke", "--n_prey", "3"], "--n_prey; did you mean --env.n_prey?"),
    "a whole section": (["train", "smoke", "--esp", "{}"], "unknown option --esp"),
    "a stray word": (["train", "smoke", "twice"], "got 'twice'"),
    "no value": (["train", "smoke", "--seed"], "--seed needs a value"),
    "wrong type": (["train", "smoke", "--seed", "x"], "seed must be an integer, got 'x'"),
    "a fraction": (["train", "smoke", "--generations", "1.5"], "generations must be an integer, got 1.5"),
    "out of range": (["train", "smoke", "--esp.mutation_rate", "1.5"], "must be at most 1.0, got 1.5"),
    "no prey": (["train", "smoke", "--env.n_prey", "0"], "env.n_prey must be at least 1, got 0"),
    "no trials": (["train", "smoke", "--esp.n_trials", "0"], "esp.n_trials must be at least 1, got 0"),
    "NaN": (["train", "smoke", "--esp.init_range", "NaN"], "esp.init_range must be"),
    "wrong choice": (["train", "smoke", "--esp.past_choice", "all"], "'contested' or 'hard', got 'all'"),
    "two scripts": (
        ["train", "smoke", "--prey.policy", "flee_nearest", "--predators.policy", "greedy_chase"],
        "at least one of predators.policy and prey.policy must be 'esp', got two scripts",
    ),
    "no threads": (["train", "smoke", "--threads", "0"], "at least 1, got "),
    "threads in words": (["train", "smoke", "--threads", "two"], "'two'"),
    "resume nothing": (["resume"], "required: DIR"),
    "resume nowhere": (["resume", "nowhere"], "nowhere holds no run: there is no config.json"),
    "resume a field": (["resume", ".", "--seed", "3"], "unexpected '--seed'"),
    "resume to none": (["resume", ".", "--generations", "0"], "at least 1, got "),
    "evaluate alone": (["evaluate", "greedy_chase"], "required: --against"),
    "evaluate scripts": (["evaluate", "greedy_chase", "--against", "flee_nearest"], "got two scripts"),
    "evaluate one script twice": (["evaluate", "greedy_chase", "--against", "greedy_chase"], "two teams of predators"),
    "evaluate nothing": (["evaluate", "nowhere", "--against", "greedy_chase"], "nowhere is not there"),
    "show nothing": (["show", "nowhere"], "nowhere is not there"),
    "show a directory": (["show", "."], "is not a file"),
    "show a device": (["show", "/dev/zero"], "/dev/zero is not a file"),
    "replay nothing": (["replay", "nowhere", "--against", "greedy_chase"], "nowhere is not there"),
}


@pytest.mark.parametrize(("command", "says"), COMMANDS.values(), ids=COMMANDS)
def test_a_command_that_is_wrong_is_refused_in_one_line_and_does_nothing(
    command: list[str], says: str, esp_trainer: Callable[..., Any], tmp_path: Path
) -> None:
    refusal = esp_trainer(*command).refusal
    assert says in refusal
    assert refusal.startswith("esp-trainer")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("analyze", ": argument COMMAND: invalid choice: 'analyze'; did you mean analyse?"),
        ("behaviors", ": argument COMMAND: invalid choice: 'behaviors'; did you mean behaviours?"),
        ("Watch", ": argument COMMAND: invalid choice: 'Watch'; did you mean watch?"),
        ("behaviours run --epsiodes 3", " behaviours: unexpected '--epsiodes'; did you mean --episodes?"),
        ("sweep file --worker=3", " sweep: unexpected '--worker=3'; did you mean --workers?"),
        ("resume run --xyzzy", " resume: unexpected '--xyzzy'"),
        ("solve --discount .5", " solve: unexpected '--discount'"),
        # An option that is required, misspelt.
        ("evaluate p --agianst q", " evaluate: unexpected '--agianst'; did you mean --against?"),
        ("evaluate p --agianst=q --seed 1", " evaluate: unexpected '--agianst=q'; did you mean --against?"),
        ("benchmark --polcy p --role prey --task 3v2", " benchmark: unexpected '--polcy'; did you mean --policy?"),
        ("exploitability p --rôle prey", " exploitability: unexpected '--rôle'; did you mean --role?"),
        ("train --ouput", " train: unexpected '--ouput'; did you mean --out?"),
        ("--verison", ": unexpected '--verison'; did you mean --version?"),
        ("-V", ": unexpected '-V'"),
        ("evaluate -1", " evaluate: the following arguments are required: --against"),
        ("evaluate -- --x", " evaluate: the following arguments are required: --against"),
        (
            "benchmark --role predator",
            " benchmark: argument --role: invalid choice: 'predator'; did you mean predators?",
        ),
        (
            "teams --task 4v4",
            " teams: argument --task: invalid choice: '4v4' (choose from pond, meadow, steppe, 3v1, 3v2)",
        ),
    ],
)
def test_the_nearest_word_that_is_known_is_named(command: str, says: str, esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer(*command.split()).refusal == f"esp-trainer{says}"


@pytest.mark.parametrize("number", ["+3", "1_000", "007", " 3 "])
def test_a_whole_number_may_be_written_as_python_reads_it(number: str) -> None:
    options = make_parser().parse_args(["evaluate", "a", "--against", "b", "--seed", number, "--episodes", number])
    assert (options.seed, options.episodes) == (int(number), int(number))


@pytest.mark.parametrize("number", [".5", "3.", "1e3", "-1", "x", "0x10", "", "1" * 5000])
def test_what_is_no_whole_number_is_refused_with_what_was_expected(
    number: str, esp_trainer: Callable[..., Any]
) -> None:
    refusal = esp_trainer("evaluate", "a", "--against", "b", "--seed", number).refusal
    says = f"argument --seed: must be a whole number of at least 0, got {number!r}"
    assert refusal == f"esp-trainer evaluate: {says}"


@pytest.mark.parametrize("option", ["--episodes", "--generations"])
@pytest.mark.parametrize("number", [2**31, 99999999999999999999])
def test_a_number_that_nothing_can_count_to_is_refused_with_its_option(
    option: str, number: int, esp_trainer: Callable[..., Any]
) -> None:
    says = f"argument {option}: must be a whole number of at most 2147483647, got '{number}'"
    assert esp_trainer("behaviours", "run", option, number).refusal == f"esp-trainer behaviours: {says}"


def test_an_argument_of_the_wrong_type_is_named_in_the_users_words(esp_trainer: Callable[..., Any]) -> None:
    assert "_positive" not in esp_trainer("train", "smoke", "--threads", "two").refusal


MATCHES: dict[str, Command] = {
    "predators against predators": (["{predators}", "--against", "{predators}"], "got two teams of predators"),
    "predators against a chase": (["{predators}", "--against", "greedy_chase"], "got two teams of predators"),
    "prey against prey": (["{prey}", "--against", "{three}/prey-00000.safetensors"], "got two teams of prey"),
    "prey against a flight": (["{prey}", "--against", "flee_nearest"], "got two teams of prey"),
    "a missing file": (["{prey}", "--against", "gone.safetensors"], "gone.safetensors is not there"),
    "a script misspelt": (["{predators}", "--against", "flee_nearst"], "flee_nearst is not there"),
    "three prey in a world of two": (
        ["{predators}", "--against", "{three}/prey-00000.safetensors"],
        "this world has 2 prey, got a team of 3",
    ),
    "two prey in a world of three": (
        ["{three}/predators-00000.safetensors", "--against", "{prey}"],
        "this world has 3 prey, got a team of 2",
    ),
    "predators that know two prey in a world of three": (
        ["{three}/prey-00000.safetensors", "--against", "{predators}"],
        "this world has 3 prey, got predators evolved against 2",
    ),
    "four predators in a world of three": (
        ["{prey}", "--against", "{four}/predators-00000.safetensors"],
        "this world has 3 predators, got a team of 4",
    ),
    "prey that know three predators in a world of four": (
        ["{four}/predators-00000.safetensors", "--against", "{prey}"],
        "this world has 4 predators, got prey evolved against 3",
    ),
    "a checkpoint": (["{run}/checkpoint.safetensors", "--against", "{prey}"], "must be a team, but is a checkpoint"),
    "a log": (["{run}/metrics.jsonl", "--against", "{prey}"], "metrics.jsonl is damaged"),
    "a directory": (["{run}", "--against", "{prey}"], "is not a file"),
    "a negative seed": (["{prey}", "--against", "{predators}", "--seed", "-1"], "at least 0, got "),
    "a seed in words": (["{prey}", "--against", "{predators}", "--seed", "x"], "--seed"),
}


@pytest.mark.parametrize("command", ["evaluate", "replay"])
@pytest.mark.parametrize(("arguments", "says"), MATCHES.values(), ids=MATCHES)
def test_teams_that_do_not_fit_are_refused_in_one_line(
    command: str,
    arguments: list[str],
    says: str,
    esp_trainer: Callable[..., Any],
    smoke_run: Path,
    predators: Path,
    prey: Path,
    three_prey_run: Path,
    four_predators_run: Path,
    tmp_path: Path,
) -> None:
    where = {
        "run": smoke_run,
        "predators": predators,
        "prey": prey,
        "three": three_prey_run / "champions",
        "four": four_predators_run / "champions",
    }
    assert says in esp_trainer(command, *(argument.format(**where) for argument in arguments)).refusal
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("fps", ["0", "-1", "nan", "fast"])
def test_replay_needs_a_number_of_frames_above_none(
    fps: str, esp_trainer: Callable[..., Any], predators: Path, prey: Path
) -> None:
    assert "--fps" in esp_trainer("replay", predators, "--against", prey, "--fps", fps).refusal


def test_where_nothing_is_compiled_one_line_names_the_variable(
    esp_trainer: Callable[..., Any], predators: Path, prey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    line = "esp-trainer: NUMBA_DISABLE_JIT must be unset to play many worlds at a time; "
    assert esp_trainer("evaluate", predators, "--against", prey).refusal.startswith(line)
    assert esp_trainer("train", "smoke", "--out", tmp_path / "run").err.splitlines()[-1].startswith(line)
    assert not (tmp_path / "run").exists()


def test_more_episodes_than_memory_holds_are_refused_in_one_line(
    esp_trainer: Callable[..., Any], predators: Path, prey: Path
) -> None:
    assert esp_trainer("evaluate", predators, "--against", prey, "--episodes", 10**13).refusal


@pytest.mark.parametrize("field", ["esp.n_trials", "esp.n_episodes", "champion.n_held_out", "prey.n_hidden"])
def test_a_run_larger_than_memory_is_refused_in_one_line(field: str, esp_trainer: Callable[..., Any]) -> None:
    outcome = esp_trainer("train", "smoke", f"--{field}", 10**13)
    assert outcome.code != 0
    assert len(outcome.err.splitlines()) <= 2, "the first says that the kernel is being prepared"


# What stands in the way of a new run.


@pytest.mark.parametrize("where", ["run", "run/champions", "run/metrics.jsonl", "run/metrics.jsonl/below", "."])
def test_a_new_run_leaves_alone_what_is_in_its_place(
    where: str, esp_trainer: Callable[..., Any], contents: Callable[[Path], Any], smoke_run: Path, tmp_path: Path
) -> None:
    shutil.copytree(smoke_run, "run")
    before = contents(tmp_path)
    refusal = esp_trainer("train", "smoke", "--seed", "1", "--out", where).refusal
    assert where.split("/")[-1] in refusal
    assert contents(tmp_path) == before


def test_the_refusal_of_a_place_that_holds_a_run_says_what_to_do(esp_trainer: Callable[..., Any]) -> None:
    assert esp_trainer("train", "smoke", "--generations", "1").code == 0
    refusal = esp_trainer("train", "smoke", "--generations", "1").refusal
    assert refusal == ("esp-trainer: runs/smoke-seed0 already holds a run; resume it, or choose another directory")


@pytest.mark.parametrize("where", ["/proc/run", "/dev/null/run", "/dev/full"])
def test_a_place_that_cannot_be_written_is_refused(where: str, esp_trainer: Callable[..., Any]) -> None:
    if not Path(where).parent.exists():
        pytest.skip(f"this system has no {where}")
    assert where in esp_trainer("train", "smoke", "--out", where).refusal
    assert not Path(where).is_dir()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_directory_without_write_permission_is_refused(esp_trainer: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir(mode=0o500)
    assert "Permission denied" in esp_trainer("train", "smoke", "--out", "mine/run").refusal


# What stands in the way of going on.


@pytest.fixture
def run(smoke_run: Path, tmp_path: Path) -> Path:
    """A run of its own to spoil."""
    return Path(shutil.copytree(smoke_run, tmp_path / "run"))


def _edit_config(run: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    whole = json.loads((run / "config.json").read_text())
    change(whole["config"])
    (run / "config.json").write_text(json.dumps(whole))


def _flip(path: Path, at: int) -> None:
    data = bytearray(path.read_bytes())
    data[at] ^= 16
    path.write_bytes(data)


def _spoil_weights(path: Path, kind: str, name: str) -> None:
    header, arrays = read_arrays(path, kind)
    arrays[name] = arrays[name].copy()
    arrays[name].flat[3] = np.nan
    del header["kind"], header["schema"]
    write_arrays(path, kind, header, arrays)


SPOILT: dict[str, tuple[Callable[[Path], Any], str]] = {
    "another config": (
        lambda run: _edit_config(run, lambda config: config["esp"].update(n_trials=99)),
        "esp.n_trials is 100 there and 99 in config.json",
    ),
    "another seed": (
        lambda run: _edit_config(run, lambda config: config.update(seed=1)),
        "seed is 0 there and 1 in config.json",
    ),
    "another world": (
        lambda run: _edit_config(run, lambda config: config["env"].update(n_prey=1)),
        "env.n_prey is 2 there and 1 in config.json",
    ),
    "an unknown field": (
        lambda run: _edit_config(run, lambda config: config.update(sede=1)),
        "config.json is damaged: unknown field sede; did you mean seed?",
    ),
    "a value out of range": (
        lambda run: _edit_config(run, lambda config: config["env"].update(n_prey=0)),
        "env.n_prey must be at least 1, got 0",
    ),
    "a config that was cut": (lambda run: os.truncate(run / "config.json", 100), "config.json is damaged"),
    "an empty config": (lambda run: os.truncate(run / "config.json", 0), "config.json is damaged"),
    "no config": (lambda run: (run / "config.json").unlink(), "holds no run: there is no config.json"),
    "a config of another schema": (
        lambda run: (run / "config.json").write_text('{"schema": 9, "config": {}}'),
        "schema must be 1, got 9",
    ),
    "a checkpoint that was cut": (
        lambda run: os.truncate(run / "checkpoint.safetensors", 5000),
        "checkpoint.safetensors is damaged",
    ),
    "an empty checkpoint": (
        lambda run: os.truncate(run / "checkpoint.safetensors", 0),
        "checkpoint.safetensors is damaged",
    ),
    "a flipped bit in the header": (
        lambda run: _flip(run / "checkpoint.safetensors", 300),
        "checkpoint.safetensors is damaged",
    ),
    "a flipped bit in the weights": (
        lambda run: _flip(run / "checkpoint.safetensors", 20_000),
        "contents do not match their digest",
    ),
    "a champion as checkpoint": (
        lambda run: shutil.copy(run / "champions/prey-00003.safetensors", run / "checkpoint.safetensors"),
        "must be a checkpoint, but is a team",
    ),
    "a config as checkpoint": (
        lambda run: shutil.copy(run / "config.json", run / "checkpoint.safetensors"),
        "checkpoint.safetensors is damaged",
    ),
    "NaN in the weights": (
        lambda run: _spoil_weights(run / "checkpoint.safetensors", "checkpoint", "prey.genomes"),
        "prey.genomes holds values that are not finite",
    ),
    "a short log": (
        lambda run: os.truncate(run / "metrics.jsonl", 5000),
        "metrics.jsonl must hold 20 whole lines, got",
    ),
    "no log": (lambda run: (run / "metrics.jsonl").unlink(), "metrics.jsonl must hold 20 whole lines, got 0"),
}


@pytest.mark.parametrize(("spoil", "says"), SPOILT.values(), ids=SPOILT)
def test_a_run_that_is_spoilt_is_not_resumed_and_left_as_it_is(
    spoil: Callable[[Path], Any], says: str, run: Path, esp_trainer: Callable[..., Any], contents: Callable[[Path], Any]
) -> None:
    spoil(run)
    before = contents(run)
    refusal = esp_trainer("resume", run, "--generations", "30").refusal
    assert says in refusal
    assert str(run) in refusal
    assert contents(run) == before


def test_a_checkpoint_that_is_a_directory_is_refused(run: Path, esp_trainer: Callable[..., Any]) -> None:
    (run / "checkpoint.safetensors").unlink()
    (run / "checkpoint.safetensors").mkdir()
    assert "checkpoint.safetensors is not a file" in esp_trainer("resume", run).refusal


def test_a_run_is_not_cut_short(run: Path, esp_trainer: Callable[..., Any], contents: Callable[[Path], Any]) -> None:
    before = contents(run)
    refusal = esp_trainer("resume", run, "--generations", "5").refusal
    assert refusal == "esp-trainer: generations must be at least the 20 that this run has done, got 5"
    assert contents(run) == before


@pytest.mark.parametrize("what", ["metrics.jsonl", "champions/prey-00003.safetensors", "config.json"])
def test_what_is_no_run_directory_is_not_resumed(what: str, run: Path, esp_trainer: Callable[..., Any]) -> None:
    assert "holds no run" in esp_trainer("resume", run / what).refusal


# Teams that are damaged.


TEAMS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "cut": (lambda team: os.truncate(team, 700), "is damaged"),
    "cut in the weights": (lambda team: os.truncate(team, os.path.getsize(team) - 1), "is damaged"),  # noqa: PTH202
    "empty": (lambda team: os.truncate(team, 0), "is damaged"),
    "flipped in the header": (lambda team: _flip(team, 200), "is damaged"),
    "flipped in the weights": (lambda team: _flip(team, -100), "contents do not match their digest"),
    "text": (lambda team: team.write_text("hello, this is not a team\n"), "is damaged"),
    "a pickle": (lambda team: team.write_bytes(b"\x80\x04\x95\x0b\x00\x00\x00\x00\x00\x00\x00\x8c\x07"), "is damaged"),
    "NaN": (lambda team: _spoil_weights(team, "team", "genomes"), "genomes holds values that are not finite"),
    "of another schema": (
        lambda team: _change_header(team, schema=2),
        "must have schema 1, but has 2",
    ),
    "without a side": (lambda team: _change_header(team, side=None), "is not a usable team"),
    "of a third role": (lambda team: _change_header(team, role="referee"), "role must be one of predators, prey"),
    "with other networks": (
        lambda team: _change_header(team, side={"n_hidden": 11}),
        "is not a usable team: genomes of feedforward networks must have shape",
    ),
    "with provenance in words": (lambda team: _change_header(team, provenance="mine"), "is not a usable team"),
    "with no provenance at all": (lambda team: _change_header(team, provenance=None), "is not a usable team"),
    "wired to what is not there": (
        lambda team: _change_arrays(team, wiring=lambda wiring: wiring - 1_000_000),
        "is not a usable team",
    ),
    "wired in fractions": (
        lambda team: _change_arrays(team, wiring=lambda wiring: wiring + 0.5),
        "is not a usable team",
    ),
}


def _change_header(team: Path, **fields: Any) -> None:
    header, arrays = read_arrays(team, "team")
    write_arrays(team, "team", {**header, **fields}, arrays)


def _change_arrays(team: Path, **changes: Callable[[np.ndarray], np.ndarray]) -> None:
    header, arrays = read_arrays(team, "team")
    write_arrays(team, "team", header, {name: changes.get(name, np.array)(array) for name, array in arrays.items()})


@pytest.mark.parametrize("command", ["show", "evaluate", "replay"])
@pytest.mark.parametrize(("spoil", "says"), TEAMS.values(), ids=TEAMS)
def test_a_team_that_is_damaged_is_refused_in_one_line(
    spoil: Callable[[Path], Any],
    says: str,
    command: str,
    esp_trainer: Callable[..., Any],
    predators: Path,
    prey: Path,
    tmp_path: Path,
    contents: Callable[[Path], Any],
) -> None:
    team = Path(shutil.copy(prey, tmp_path / "spoilt.safetensors"))
    spoil(team)
    before = contents(tmp_path)
    refusal = esp_trainer(command, team, *(["--against", str(predators)] if command != "show" else [])).refusal
    assert says in refusal
    assert str(team) in refusal
    assert contents(tmp_path) == before


# A disk that is full or may not be written.


@pytest.fixture
def mount(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """``mount("size=64k")``: a file system of its own, where the system lets us."""
    mounted: list[Path] = []

    def make(options: str) -> Path:
        path = tmp_path / f"mount{len(mounted)}"
        path.mkdir()
        program = shutil.which("mount")
        arguments = ["-t", "tmpfs", "-o", options, "tmpfs", str(path)]
        if not program or subprocess.run([program, *arguments], capture_output=True, check=False).returncode:
            pytest.skip("this system does not let us mount a file system")
        mounted.append(path)
        return path

    yield make
    for path in mounted:
        subprocess.run(["umount", str(path)], check=True)


def test_a_disk_that_fills_up_ends_the_run_in_one_line_and_leaves_one_that_resumes(
    mount: Callable[[str], Path], esp_trainer: Callable[..., Any], smoke_run: Path, contents: Callable[[Path], Any]
) -> None:
    disk = mount("size=256k")
    outcome = esp_trainer("train", "smoke", "--out", disk / "run", "--quiet")
    assert outcome.code == 1
    assert outcome.out == ""
    assert outcome.err.splitlines()[-1].endswith("No space left on device")
    assert sum("No space" in line for line in outcome.err.splitlines()) == 1
    assert not list(disk.rglob(".*"))
    outcome = esp_trainer("resume", disk / "run", "--quiet")
    assert outcome.code == 1, "it is still full"
    subprocess.run(["mount", "-o", "remount,size=1m", str(disk)], check=True)
    assert esp_trainer("resume", disk / "run", "--quiet").code == 0
    after, expected = contents(disk / "run"), contents(smoke_run)
    for name in ("config.json", "metrics.jsonl", "checkpoint.safetensors"):
        assert after[str(disk / "run" / name)] == expected[str(smoke_run / name)]
    assert {Path(name).name for name in after} == {Path(name).name for name in expected}


def test_a_full_disk_is_told_with_the_file_that_did_not_fit(
    mount: Callable[[str], Path], esp_trainer: Callable[..., Any]
) -> None:
    disk = mount("size=256k")
    outcome = esp_trainer("train", "smoke", "--out", disk / "run", "--quiet")
    assert str(disk / "run") in outcome.err.splitlines()[-1]


def test_a_process_whose_disk_is_full_says_nothing_else(mount: Callable[[str], Path]) -> None:
    """Not even from Python's own clearing up, when the process ends."""
    disk = mount("size=192k")
    command = [*_COMMAND, "train", "smoke", "--out", str(disk / "run"), "--quiet", "--checkpoint_every", "1000"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert [line.split()[0] for line in done.stderr.splitlines()] == ["preparing", "esp-trainer:"], done.stderr


def test_a_full_disk_refuses_a_run_and_keeps_nothing_of_it(
    mount: Callable[[str], Path], esp_trainer: Callable[..., Any], contents: Callable[[Path], Any]
) -> None:
    disk = mount("size=16k")
    with (disk / "mine").open("wb", buffering=0) as file, contextlib.suppress(OSError):
        while file.write(bytes(1024)):
            pass
    before = contents(disk)
    assert "No space left on device" in esp_trainer("train", "smoke", "--out", disk / "run").refusal
    assert contents(disk) == before


def test_a_run_on_a_disk_that_may_only_be_read_is_refused_and_its_teams_play(
    mount: Callable[[str], Path], esp_trainer: Callable[..., Any], smoke_run: Path, tmp_path: Path
) -> None:
    disk = mount("size=4m")
    run = shutil.copytree(smoke_run, disk / "run")
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
    assert "Read-only file system" in esp_trainer("train", "smoke", "--out", disk / "new").refusal
    refusal = esp_trainer("resume", run, "--generations", "30").refusal
    assert "Read-only file system" in refusal
    assert ".part" not in refusal, "that is our name for it, not the user's"
    teams = [run / f"champions/{role}-00003.safetensors" for role in ("predators", "prey")]
    assert esp_trainer("evaluate", teams[0], "--against", teams[1]).code == 0
    few = ["--generations", 4, "--episodes", 8]
    assert esp_trainer("analyse", run, *few).code == 0
    assert esp_trainer("report", run, *few, "--out", tmp_path / "page.html").code == 0
    assert "Read-only file system" in esp_trainer("report", run, *few).err.splitlines()[-1]


def test_what_fails_deep_inside_is_told_without_a_traceback(
    esp_trainer: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(FusedEvaluator, "compile", fail)
    outcome = esp_trainer("train", "smoke")
    assert outcome.code == 1
    assert outcome.err.splitlines()[-1] == "esp-trainer: Input/output error"


def test_a_team_that_is_saved_over_a_directory_leaves_it(prey: Path, tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    with pytest.raises(OSError, match="directory"):
        Team.load(prey).save(tmp_path / "there")
    assert [file.name for file in tmp_path.iterdir()] == ["there"]


def test_a_run_is_found_whole_by_another_program(smoke_run: Path) -> None:
    """Whatever the tests above did to its copies."""
    assert RunDirectory(smoke_run).read_config().generations == 20
    assert len(list((smoke_run / "champions").iterdir())) == 40
