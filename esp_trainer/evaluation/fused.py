"""Compiled evaluator of the predator-prey world: a fused kernel plays blocks of trials, spread over threads."""

from __future__ import annotations

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise, starmap
from typing import Any

import numpy as np

from esp_trainer.config import SideConfig
from esp_trainer.cores import cores
from esp_trainer.esp.controller import make_controller
from esp_trainer.evaluation.kernel import BatchSide, Recorded, make_memory, play_blocks
from esp_trainer.evaluation.starts import CellStarts
from esp_trainer.networks.controller import Controller
from esp_trainer.types import (
    EvolvedTeams,
    Role,
    ScriptedTeams,
    TeamBatch,
    Trace,
    TrialBatch,
    TrialResult,
    no_teams,
)
from predprey_env.config import EnvConfig
from predprey_env.jit.lanes import LANES
from predprey_env.policies.scripted import Script

# Limits memory: a part copies its indices to int64; with subpopulations of 100, eight times their size in the batch.
_MOST_BLOCKS = 128
_MOST_STEPS = 115_200  # per part, about 0.1 s: stopping a run waits for the parts in progress
_PARTS_PER_THREAD = 2  # so that a thread with short episodes takes over parts from the others


class FusedEvaluator:
    """Plays batches in compiled code. The results do not depend on the number of threads.

    Args:
        env: The world. Its ``reward`` and ``captured_prey`` concern only the PettingZoo environment, not this class.
        threads: Number of threads; by default one for each core.
    """

    def __init__(self, env: EnvConfig, threads: int | None = None) -> None:
        self.env = env
        self.starts = CellStarts(env)
        self.threads = threads or cores()
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0  # id of the process that the pool's threads belong to

    def __getstate__(self) -> dict[str, Any]:
        """Leave the threads out of copies and pickles."""
        return self.__dict__ | {"_pool": None}

    def compile(self, predators: Controller | None = None, prey: Controller | None = None) -> None:
        """Load the kernel for two controllers, or scripts, from the cache; else compile it, which takes about 15 s.

        Raises :class:`ValueError`, in one line, if the rule of a network or sight of one's own does not compile.
        """
        teams = no_teams(predators, self.env.n_predators), no_teams(prey, self.env.n_prey)
        self.evaluate(TrialBatch(*teams, np.zeros(self._shape(0, 1))))

    def evaluate(self, batch: TrialBatch) -> TrialResult:
        """Play every episode of every trial."""
        return self._play(batch, n_traced=0)[0]

    def play(self, batch: TrialBatch) -> tuple[TrialResult, Trace]:
        """Play every episode of every trial. Return the results and the course of the episodes."""
        return self._play(batch, n_traced=len(batch.starts))

    def _threads(self) -> ThreadPoolExecutor:
        """Return the thread pool of this process. A forked process copies the object but not its threads."""
        if self._pool is None or self._process != os.getpid():
            self._pool, self._process = ThreadPoolExecutor(self.threads), os.getpid()
        return self._pool

    def _shape(self, n_trials: int, n_episodes: int) -> tuple[int, int, int, int]:
        return n_trials, n_episodes, self.env.n_agents, 2

    def _play(self, batch: TrialBatch, n_traced: int) -> tuple[TrialResult, Trace]:
        env, starts = self.env, np.require(batch.starts, np.int32, ["C", "W"])
        if starts.shape != self._shape(*starts.shape[:2]):
            raise ValueError(f"starts must have shape (trials, episodes, {env.n_agents}, 2), got {starts.shape}")
        if starts.size and not 0 <= starts.min() <= starts.max() < env.size:
            raise ValueError(f"starts must lie in [0, {env.size}), got {starts.min()} to {starts.max()}")
        n_trials, n_episodes = starts.shape[:2]
        if n_episodes < 1:
            raise ValueError("a trial needs at least one episode, got none")
        predators = _side("predators", batch.predators, n_trials, env)
        prey = _side("prey", batch.prey, n_trials, env)
        outcome = Recorded(
            fitness=np.zeros((n_trials, n_episodes, env.n_agents)),
            caught_at=np.zeros((n_trials, n_episodes, env.n_prey), np.int32),
            steps=np.zeros((n_trials, n_episodes), np.int64),
            cells=np.full((n_traced, n_episodes, env.max_cycles + 1, env.n_agents, 2), -1, np.int32),
            actions=np.full((n_traced, n_episodes, env.max_cycles, env.n_agents), -1, np.int8),
        )

        def play(part: slice) -> None:
            sides = _part(predators, part), _part(prey, part)
            ours = Recorded(*(array[part] for array in outcome))
            play_blocks(env.rules, *sides, starts[part], ours, make_memory(env.rules, *sides))

        most = max(1, min(_MOST_BLOCKS, _MOST_STEPS // (n_episodes * env.max_cycles)))
        if self.threads == 1:  # in this thread, where Ctrl-C works even while the kernel compiles
            for part in blocks(n_trials, 1, most):
                play(part)
        else:
            list(self._threads().map(play, blocks(n_trials, self.threads * _PARTS_PER_THREAD, most)))
        result = TrialResult(outcome.fitness, outcome.caught_at > 0, outcome.steps)
        return result, Trace(outcome.cells, outcome.actions, outcome.caught_at[:n_traced])


def blocks(n_trials: int, n: int, most: int = sys.maxsize) -> list[slice]:
    """Split trials into ``n`` parts of whole blocks.

    The parts are fewer if there are fewer blocks, and more if a part would have more than ``most`` blocks. Without
    trials there is one part.
    """
    n_blocks = -(-n_trials // LANES)
    n_parts = max(1, min(n, n_blocks), -(-n_blocks // most))
    bounds = LANES * np.linspace(0, n_blocks, n_parts + 1).astype(int)
    return list(starmap(slice, pairwise(bounds.tolist())))


def _part(side: BatchSide, part: slice) -> BatchSide:
    """Return the teams of a part of the trials, with indices of the kernel's type."""
    if side.script.number:
        return side
    return side._replace(indices=np.require(side.indices[part], np.int64, ["C", "W"]))


def _side(role: Role, teams: TeamBatch, n_trials: int, env: EnvConfig) -> BatchSide:
    """Return one side of a batch in the layout that the kernel was compiled for."""
    match teams:
        case EvolvedTeams():
            return _evolved_side(role, teams, n_trials, env)
        case ScriptedTeams():
            return _scripted_side(role, teams, env)
    raise TypeError(f"teams must be EvolvedTeams or ScriptedTeams, got {type(teams).__name__}")


def _scripted_side(role: Role, teams: ScriptedTeams, env: EnvConfig) -> BatchSide:
    n_agents, _, n_actions, _ = env.team(role)
    nobody = make_controller(SideConfig(), np.array([[0, 1]]), n_actions)
    empty = np.zeros((1, n_agents, 0, 0), np.int64)
    script = teams.policy(role, env).compiled(role, env, LANES)
    return BatchSide(script, nobody, np.zeros((1, 1, 1, 1, 1), np.float32), empty)


def _evolved_side(role: Role, teams: EvolvedTeams, n_trials: int, env: EnvConfig) -> BatchSide:
    n_agents, n_opponents, n_actions, _ = env.team(role)
    controller = teams.controller
    got = len(teams.indices), teams.indices.shape[1] * controller.n_together, controller.n_actions
    if got != (n_trials, n_agents, n_actions):
        expected = f"{n_trials} trials, {n_agents} agents and {n_actions} actions"
        raise ValueError(f"teams must have {expected}, got {got[0]}, {got[1]} and {got[2]}")
    n_seen = controller.sight.n_seen(n_agents, n_opponents) * controller.n_together
    if controller.wiring.max() >= n_seen:
        raise ValueError(f"networks must read entries below {n_seen}, got {controller.wiring.max()}")
    n_candidates = teams.genomes.shape[3]
    if teams.indices.size and not 0 <= teams.indices.min() <= teams.indices.max() < n_candidates:
        raise ValueError(f"indices must lie in [0, {n_candidates}), got {teams.indices.min()} to {teams.indices.max()}")
    # Numba would compile again for read-only arrays, such as other processes share.
    genomes = np.require(teams.genomes, np.float32, ["C", "W"])
    controller = controller._replace(wiring=np.require(controller.wiring, np.int64, ["C", "W"]))
    return BatchSide(Script(0, n_opponents, n_actions), controller, genomes, teams.indices)
