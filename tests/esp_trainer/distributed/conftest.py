"""Ray clusters on this machine: of one node with some cores, or of two nodes, one of which can be killed."""

from __future__ import annotations

import logging
import os
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from waiting import join, wait

from esp_trainer.evaluation.sharded import ShardedEvaluator
from esp_trainer.presets import preset

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from esp_trainer.config import RunConfig
    from esp_trainer.types import TrialBatch, TrialResult

pytest.importorskip("ray")

import ray
from ray.cluster_utils import Cluster

os.environ["RAY_USAGE_STATS_ENABLED"] = "0"


class TwoNodes(NamedTuple):
    """A cluster of two nodes with a core each; the driver is connected to the first."""

    cluster: Cluster
    second: Any

    @property
    def address(self) -> str:
        return str(self.cluster.address)

    @property
    def first(self) -> Any:
        return self.cluster.head_node

    def kill_second(self) -> None:
        self.cluster.remove_node(self.second, allow_graceful=False)


@pytest.fixture
def two_nodes(only_cluster: None) -> Iterator[TwoNodes]:
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    second = cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False, logging_level=logging.ERROR)
    try:
        yield TwoNodes(cluster, second)
    finally:
        ray.shutdown()
        cluster.shutdown()


@pytest.fixture(scope="module")
def two_workers(only_cluster_of_module: None) -> Iterator[None]:
    """Connected to a cluster with two cores, all tests of a module one after the other."""
    ray.init(address="local", num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level=logging.ERROR)
    try:
        yield
    finally:
        ray.shutdown()


@pytest.fixture(scope="session")
def config() -> RunConfig:
    """A run with all that it writes, of a few generations."""
    smoke = preset("smoke")
    return smoke.replace(generations=5, checkpoint_every=2, esp=smoke.esp.replace(pairing="mixed", hof_size=3))


class Processes:
    """Those of this machine, as ``/proc`` shows them."""

    def title(self, pid: int) -> str:
        """What a process calls itself; nothing if it is gone."""
        try:
            return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
        except OSError:
            return ""

    def parents(self) -> dict[int, int]:
        """Of every process, its parent."""
        found = {}
        for entry in Path("/proc").iterdir():
            try:
                if entry.name.isdecimal():
                    found[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except OSError:
                continue
        return found

    def descendants(self, pid: int) -> set[int]:
        """Children, their children and so on."""
        parents, found = self.parents(), {pid}
        while more := {child for child, parent in parents.items() if parent in found} - found:
            found |= more
        return found - {pid}

    def at_work(self) -> list[int]:
        """Ray's workers that are running a task of ours."""
        return [pid for pid in self.parents() if self.title(pid).startswith("ray::_call")]

    def at_work_on(self, node: Any) -> list[int]:
        """Those of one of the test's nodes."""
        raylet = node.all_processes["raylet"][0].process.pid
        return [pid for pid in self.descendants(raylet) if self.title(pid).startswith("ray::_call")]


@pytest.fixture
def play_and(processes: Processes) -> Callable[..., TrialResult]:
    """``play_and(kill, batch, when)``: play a batch in shards, and once ``when()`` finds something, ``kill`` that."""

    def play(kill: Callable[[Any], None], batch: TrialBatch, when: Callable[[], Any]) -> TrialResult:
        results: list[TrialResult] = []
        evaluator = ShardedEvaluator(preset("paper-3v2").env, shards=4)
        evaluator.evaluate(batch.part(slice(400)))  # workers are up, with their kernels
        thread = threading.Thread(target=lambda: results.append(evaluator.evaluate(batch)), daemon=True)
        thread.start()
        kill(wait(when))
        join(thread)
        (result,) = results
        return result

    return play


@pytest.fixture(scope="session")
def processes() -> Processes:
    return Processes()
