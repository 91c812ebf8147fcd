"""Kinds of network: what an Elman network remembers, and networks of one's own."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import pytest

from esp_trainer.cli import main
from esp_trainer.coevolution.coevolution import Coevolution
from esp_trainer.coevolution.sides import new_sides, side_controller
from esp_trainer.config import SideConfig
from esp_trainer.esp.controller import make_controller, wiring_for
from esp_trainer.esp.team import Team
from esp_trainer.evaluation.reference import predprey_reference
from esp_trainer.exact.chances import ask_in
from esp_trainer.files import DamagedFileError
from esp_trainer.networks import network_class, respond
from esp_trainer.networks.feedforward import FeedForward
from esp_trainer.presets import preset
from esp_trainer.run.checkpoint import load_checkpoint, save_checkpoint
from esp_trainer.types import PolicyError
from predprey_env import EnvConfig
from predprey_env.jit import add_products, load, rule, store, zeros

HERE = __name__


def team(side: SideConfig, n_opponents: int = 2, seed: int = 0) -> Team:
    controller = make_controller(side, wiring_for(side, n_opponents), 4)
    genomes = np.random.default_rng(seed).normal(0, 3, (1, *controller.shape)).astype(np.float32)
    return Team("prey", side, controller, genomes)


def logistic(z: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-z))


# -- Elman ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bias", [False, True])
def test_hidden_neurons_read_what_all_of_them_were_in_the_step_before(bias: bool) -> None:
    side = SideConfig(network="elman", controller="monolithic", n_hidden=3, bias=bias, input_scale=0.1, output="linear")
    prey, n_inputs = team(side, n_opponents=1, seed=10), 2 + bias
    assert prey.controller.n_genes == n_inputs + 3 + 4
    (genes,) = prey.genomes[0].astype(float)
    inward, recurrent, outward = np.split(genes, [n_inputs, n_inputs + 3], axis=1)
    seen = np.random.default_rng(1).integers(-9, 10, (40, 2))
    hidden, expected = np.zeros(3), []
    for offset in seen:
        hidden = logistic(inward @ np.append(offset * 0.1, [1.0] * bias) + recurrent @ hidden)
        expected.append(int(np.argmax(hidden @ outward)))
    prey.reset(seed=0)
    found = [prey.act({"prey_0": offset.astype(np.float32)})["prey_0"] for offset in seen]
    assert found == expected
    assert len(set(found)) > 2
    prey.reset(seed=0)
    assert prey.act({"prey_0": seen[0].astype(np.float32)})["prey_0"] == expected[0], "reset() forgets"


def test_what_an_elman_network_does_depends_on_what_it_saw_before() -> None:
    side = SideConfig(network="elman", controller="monolithic", n_hidden=3, input_scale=0.1, output="linear")
    prey = team(side, n_opponents=1, seed=10)
    seen = np.random.default_rng(1).integers(-9, 10, (40, 2)).astype(np.float32)
    orders = []
    for views in (seen, seen[::-1]):
        prey.reset(seed=0)
        orders.append([prey.act({"prey_0": view})["prey_0"] for view in views])
    assert orders[0] != orders[1][::-1]


def test_every_network_of_every_agent_remembers_its_own() -> None:
    """A split controller of two equal networks adds twice the votes of one network, whatever was seen before."""
    one = team(SideConfig(network="elman", n_hidden=2, output="linear"), n_opponents=1)
    both = team(SideConfig(network="elman", n_hidden=2, output="linear"), n_opponents=2)
    both.genomes[:] = one.genomes[:, :1]
    two = Team("prey", both.side, both.controller, np.repeat(both.genomes, 2, axis=0))
    seen = np.random.default_rng(2).integers(-3, 4, (30, 2, 2)).astype(np.float32)
    alone: list[list[int]] = [[], []]
    for agent in (0, 1):
        one.reset(0)
        alone[agent] = [one.act({"prey_0": view})["prey_0"] for view in seen[:, agent]]
    assert alone[0] != alone[1]
    two.reset(0)
    together = [two.act({f"prey_{i}": np.tile(view[i], 2) for i in (0, 1)}) for view in seen]
    assert [each["prey_0"] for each in together] == alone[0]
    assert [each["prey_1"] for each in together] == alone[1]


@pytest.mark.parametrize("choice", ["most_votes", "drawn"])
def test_an_elman_network_without_recurrent_weights_is_the_papers(choice: Literal["most_votes", "drawn"]) -> None:
    """Where actions are drawn, the random state stays apart from what the network remembers."""
    elman = team(SideConfig(network="elman", n_hidden=4, choice=choice), n_opponents=2)
    plain = team(SideConfig(n_hidden=4, choice=choice), n_opponents=2)
    elman.genomes[..., :2], elman.genomes[..., 2:6] = plain.genomes[..., :2], 0
    elman.genomes[..., 6:] = plain.genomes[..., 2:]
    elman.reset(1)
    plain.reset(1)
    for view in np.random.default_rng(3).integers(-9, 10, (50, 4)).astype(np.float32):
        assert elman.act({"prey_0": view}) == plain.act({"prey_0": view})


def test_a_team_that_remembers_is_saved_and_loaded(tmp_path: Path) -> None:
    saved = team(SideConfig(network="elman", n_hidden=4))
    saved.save(tmp_path / "team.safetensors")
    loaded = Team.load(tmp_path / "team.safetensors")
    assert loaded.side.network == "elman"
    for view in np.random.default_rng(3).integers(-9, 10, (20, 4)).astype(np.float32):
        assert loaded.act({"prey_0": view}) == saved.act({"prey_0": view})


def test_what_remembers_has_no_exploitability() -> None:
    config = EnvConfig(n_predators=2, n_prey=1, size=4)
    with pytest.raises(PolicyError, match=r"^elman networks have memory: .* exploitability is not defined$"):
        ask_in(team(SideConfig(network="elman"), n_opponents=2), np.zeros((1, 1, 4), np.float32), "prey", config)


# -- networks of one's own -----------------------------------------------------------------------------------------


class Linear(FeedForward):
    """A network whose hidden neurons do no more than add."""


@rule
def _linear(
    network: Any, weights: Any, at: int, inputs: Any, n_inputs: int, first: int, memory: Any, context: int
) -> Any:
    outputs = zeros(weights, network.blank)
    for _ in range(network.n_hidden):
        total = load(weights, at) * load(inputs, 0)
        for i in range(1, n_inputs):
            total = total + load(weights, at + i) * load(inputs, i)
        outputs = add_products(outputs, weights, at + n_inputs + first, total)
        at += network.n_genes
    return outputs


respond.register(Linear, _linear)


def test_a_network_of_ones_own_plays_and_is_loaded(tmp_path: Path) -> None:
    name = f"{HERE}:Linear"
    prey = team(SideConfig(network=name, n_hidden=3, output="linear", controller="monolithic"))
    prey.save(tmp_path / "team.safetensors")
    (genes,) = prey.genomes[0].astype(float)
    matrix = genes[:, :4].T @ genes[:, 4:]
    for view in np.random.default_rng(3).integers(-9, 10, (20, 4)).astype(np.float32):
        expected = {"prey_0": int(np.argmax(view @ matrix))}
        assert prey.act({"prey_0": view}) == expected
        assert Team.load(tmp_path / "team.safetensors").act({"prey_0": view}) == expected


def test_a_network_of_ones_own_evolves() -> None:
    """By the reference evaluator: examples/own_network.py does so in a kernel that is compiled for its network."""
    few = {
        "env.max_cycles": 5,
        "esp.n_trials": 20,
        "esp.n_episodes": 1,
        "champion.n_candidates": 2,
        "champion.n_held_out": 4,
    }
    config = preset("smoke").with_fields({"prey.network": f"{HERE}:Linear", **few})
    assert side_controller(config, "prey").shape != side_controller(config, "predators").shape
    run = Coevolution(config, new_sides(config), predprey_reference(config.env))
    assert run.step(0).champions["prey"].genomes.shape[1:] == side_controller(config, "prey").shape


def test_a_network_that_has_got_other_genes_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files hold neurons with a gene for each input and output, and the network has since got one gene more."""
    name = f"{HERE}:Linear"
    team(SideConfig(network=name, n_hidden=3), n_opponents=1).save(tmp_path / "team.safetensors")
    config = preset("smoke").with_fields({"prey.network": name})
    save_checkpoint(tmp_path / "checkpoint", config, new_sides(config), 0)
    monkeypatch.setattr(Linear, "genes", staticmethod(lambda n_inputs, n_outputs, _: n_inputs + n_outputs + 1))
    shape = re.escape("must have shape (agents, *(1, 3, 7)), got (1, 1, 3, 6)")
    with pytest.raises(DamagedFileError, match=f"genomes of {name} networks {shape}$"):
        Team.load(tmp_path / "team.safetensors")
    with pytest.raises(DamagedFileError, match=f"prey.hall_of_fame of {name} networks must be float32 of shape"):
        load_checkpoint(tmp_path / "checkpoint", config)


class NoRule(Linear):
    """Refused: it has no rule of its own."""


class NoGenes(NamedTuple):
    n_hidden: int
    n_genes: int
    blank: tuple[np.float32, ...]


class ShortRule(NamedTuple):
    n_hidden: int
    n_genes: int
    n_memory: int
    blank: tuple[np.float32, ...]
    genes = memory = staticmethod(len)


respond.register(ShortRule, rule(lambda network, weights: weights))


class HalfGenes(FeedForward):
    @staticmethod
    def genes(n_inputs: int, n_outputs: int, n_hidden: int) -> float:
        return 1.5


respond.register(HalfGenes, _linear)


class Breaks(HalfGenes):
    @staticmethod
    def memory(n_hidden: int) -> int:
        raise RuntimeError("no\nmemory")


respond.register(Breaks, _linear)


class OfObjects(HalfGenes):
    def genes(self, n_inputs: int, n_outputs: int, n_hidden: int) -> int:  # type: ignore[override]
        return n_inputs + n_outputs


respond.register(OfObjects, _linear)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("elmann", "network must be one of feedforward, elman or module:Class, got 'elmann'; did you mean elman\\?"),
        ("no_such_module:Net", "network no_such_module:Net cannot be imported: ModuleNotFoundError: No module .*"),
        ("json:JSONDecoder", "network json:JSONDecoder must be a named tuple, got JSONDecoder"),
        (f"{HERE}:NoGenes", r"network .* has no n_memory and no genes\(\) and no memory\(\)"),
        (f"{HERE}:NoRule", r"network .*:NoRule has no rule: put @respond.register\(NoRule\) above it"),
        (f"{HERE}:ShortRule", "the rule of network .* must take network, weights, at, .*, got network, weights"),
        (f"{HERE}:HalfGenes", r"genes\(\) of network .* must return an integer of at least 1, got 1.5"),
        (f"{HERE}:Breaks", r"memory\(\) of network .*:Breaks raised RuntimeError: no memory"),
        (f"{HERE}:OfObjects", r"genes\(\) of network .*:OfObjects raised TypeError: .* missing .* 'n_hidden'"),
    ],
)
def test_what_is_no_network_is_refused_in_one_line(name: str, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}$") as refused:
        team(SideConfig(network=name))
    assert "\n" not in str(refused.value)
    if ":" in name and name.split(":")[1] not in ("HalfGenes", "Breaks", "OfObjects"):
        with pytest.raises(ValueError, match=f"^{message}$"):
            network_class(name)


def test_a_team_whose_network_is_not_there_is_refused_in_one_line(tmp_path: Path) -> None:
    saved = team(SideConfig(network=f"{HERE}:Linear"))
    gone = Team("prey", saved.side.replace(network="gone_module:Net"), saved.controller, saved.genomes)
    gone.save(tmp_path / "team.safetensors")
    with pytest.raises(DamagedFileError, match="is not a usable team: network gone_module:Net cannot be imported: Mod"):
        Team.load(tmp_path / "team.safetensors")


class Unknown(Linear):
    """Its rule uses a name that is nowhere."""


@rule
def _unknown(
    network: Any, weights: Any, at: int, inputs: Any, n_inputs: int, first: int, memory: Any, context: int
) -> Any:
    return nowhere  # type: ignore[name-defined]  # noqa: F821


respond.register(Unknown, _unknown)


@pytest.mark.slow  # compiles most of the kernel
def test_a_rule_that_does_not_compile_is_told_in_one_line_before_a_run_begins(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "run"
    assert main(["train", "smoke", "--prey.network", f"{HERE}:Unknown", "--out", str(place)]) == 1
    *_, last = capsys.readouterr().err.splitlines()
    assert last == "esp-trainer: the rule _unknown does not compile: NameError: name 'nowhere' is not defined"
    assert not place.exists()


class Forgetful(Linear):
    """It says that it reads two genes less than it does."""

    @staticmethod
    def genes(n_inputs: int, n_outputs: int, n_hidden: int) -> int:
        return n_inputs + n_outputs - 2


class Remembering(Linear):
    """It uses memory, of which it says that there is none."""


@rule
def _remembering(
    network: Any, weights: Any, at: int, inputs: Any, n_inputs: int, first: int, memory: Any, context: int
) -> Any:
    store(memory, context + 4, 1)
    return _linear(network, weights, at, inputs, n_inputs, first, memory, context)


class Lonely(Linear):
    """It returns one value for all outputs."""


@rule
def _lonely(
    network: Any, weights: Any, at: int, inputs: Any, n_inputs: int, first: int, memory: Any, context: int
) -> Any:
    return load(inputs, 0)


class Undefined(Linear):
    """It divides zero by zero."""


@rule
def _undefined(
    network: Any, weights: Any, at: int, inputs: Any, n_inputs: int, first: int, memory: Any, context: int
) -> Any:
    nothing = load(inputs, 0) * 0
    return add_products(zeros(weights, network.blank), weights, at, nothing / nothing)


respond.register(Forgetful, _linear)
respond.register(Remembering, _remembering)
respond.register(Lonely, _lonely)
respond.register(Undefined, _undefined)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("Forgetful", "must keep to the first 12 rows of weights, as genes() says, got row 13"),
        ("Remembering", "must keep to the first 0 rows of memory, as memory() says, got row 4"),
        ("Lonely", "must return 4 finite outputs, got np.float32(0.12573022)"),
        ("Undefined", "must return 4 finite outputs, got (np.float32(nan), "),
    ],
)
def test_a_rule_that_breaks_its_promises_is_refused_in_one_line(name: str, line: str) -> None:
    """Three neurons of two inputs and four outputs; compiled code would read, and write, whatever lies beyond."""
    with pytest.raises(ValueError, match=f"^the rule of network {HERE}:{name} {re.escape(line)}[^\\n]*$"):
        team(SideConfig(network=f"{HERE}:{name}", n_hidden=3), n_opponents=1)


def test_a_module_that_exits_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "that_exits.py").write_text("raise SystemExit('bye')")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ValueError, match=r"^network that_exits:Any cannot be imported: SystemExit: bye$"):
        network_class("that_exits:Any")
