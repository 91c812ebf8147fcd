"""A Ray cluster to spread work over. Needs the extra ``ray``; nothing else of the trainer knows Ray.

Every node must have this package, in the driver's version. What a task computes depends on its arguments alone, so one
that was lost with its worker or its node is simply played again.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from gymnasium.error import DependencyNotInstalled

from esp_trainer.run.directory import versions

RETRIES = 20
"""How often a task is tried again whose worker died; one that kills its workers must not go on for ever."""
_PATIENCE = 5.0  # seconds until a head node must have answered; Ray itself waits for two minutes


@contextmanager
def connected(address: str) -> Iterator[None]:
    """Connect to a Ray cluster, for as long as it is needed.

    Args:
        address: ``HOST:PORT`` of its head node, ``auto`` for the one that this machine belongs to, or ``local`` to
            start one here, on all cores, that ends with the connection.

    Raises:
        ConnectionError: There is none.
        DependencyNotInstalled: Ray is not installed.
    """
    try:
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # who starts a cluster here has agreed to nothing
        import ray
    except ImportError:
        raise DependencyNotInstalled('a Ray cluster needs ray: install predprey-esp with its extra "ray"') from None
    _check_answers(address)
    own = {"include_dashboard": False} if address == "local" else {}
    try:
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR, **own)
    except (ConnectionError, ValueError, RuntimeError) as error:
        hint = "; if it asks for a token, set RAY_AUTH_MODE=token" if ":" in address else ""
        raise ConnectionError(f"no Ray cluster at {address}: {str(error).splitlines()[0]}{hint}") from None
    try:
        yield
    finally:
        ray.shutdown()


def _check_answers(address: str) -> None:
    """Fail at once if nobody listens at HOST:PORT."""
    host, colon, port = address.rpartition(":")
    if not colon and address not in ("auto", "local"):
        raise ConnectionError(f"the address of a Ray cluster must be HOST:PORT, auto or local, got {address}")
    if "//" in host or not colon:  # ray://, for Ray to judge
        return
    try:
        socket.create_connection((host, int(port)), timeout=_PATIENCE).close()
    except (OSError, ValueError, OverflowError):
        raise ConnectionError(f"no Ray cluster answers at {address}") from None


def cores() -> int:
    """Those of the cluster's nodes that are alive."""
    import ray

    return max(1, int(ray.cluster_resources().get("CPU", 1)))


def share(value: Any) -> Any:
    """Put a value where every node can read it; as an argument of :func:`submit` it becomes the value again."""
    import ray

    return ray.put(value)


def submit(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function on one core of some node; returns what :func:`gather` takes."""
    return _remote(RETRIES).remote(_versions(), function, *arguments)


def gather(tasks: Sequence[Any]) -> list[Any]:
    """The results of tasks, in their order.

    Raises what a task raised; :class:`ConnectionError` if one was lost too often, or if a node cannot run it.
    """
    import ray

    try:
        return list(ray.get(list(tasks)))
    except ray.exceptions.RayTaskError as error:
        if isinstance(error.cause, (ImportError, RuntimeError)):  # as where our package is missing
            reason = str(error.cause).strip().splitlines()[-1]
            raise ConnectionError(f"a node of the Ray cluster cannot play: {reason}") from None
        raise error.cause from None
    except ray.exceptions.RayError as error:
        raise ConnectionError(f"the Ray cluster lost a task: {str(error).splitlines()[0]}") from None


def ended(tasks: Sequence[Any], timeout: float) -> list[Any]:
    """Those of some tasks that have ended; waits up to so many seconds for the first."""
    import ray

    if not tasks or not ray.wait(list(tasks), timeout=timeout)[0]:
        return []
    return list(ray.wait(list(tasks), num_returns=len(tasks), timeout=0)[0])


def cancel(tasks: Sequence[Any], grace: float) -> None:
    """End tasks: by an interrupt, and if that does not help within ``grace`` seconds by killing their workers."""
    import ray

    left = list(tasks)
    for force in (False, True):
        for task in left:
            ray.cancel(task, force=force)
        left = ray.wait(left, num_returns=len(left), timeout=grace)[1] if left else []


@lru_cache
def _remote(retries: int) -> Any:
    """What a worker runs, as Ray takes it: made once, as every one that is made is sent to all workers."""
    import ray

    return ray.remote(num_cpus=1, max_retries=retries)(_call)


@lru_cache
def _versions() -> dict[str, str]:
    return versions()


def _call(expected: dict[str, str], function: Callable[..., Any], *arguments: Any) -> Any:
    """A task: a call, where the versions are those of the driver."""
    if _versions() != expected:
        here, there = (
            ", ".join(f"{name} {version}" for name, version in each.items()) for each in (_versions(), expected)
        )
        raise ValueError(f"node {socket.gethostname()} has {here}; the driver has {there}")
    return function(*arguments)
