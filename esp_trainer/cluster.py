"""Work spread over a Ray cluster. It needs the extra ``ray``; no other module of the trainer imports Ray.

Every node must have this package, in the driver's version. The result of a task depends on its arguments alone, so a
task that is lost with its worker or its node is simply run again.
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from esp_trainer.run.directory import versions
from predprey_env.extras import extra

RETRIES = 20
"""Number of times that a task is retried after its worker died: a task that kills its workers must fail in the end."""
_PATIENCE = 5.0  # seconds that a head node has to answer; Ray itself waits for two minutes


@contextmanager
def connected(address: str) -> Iterator[None]:
    """Connect to a Ray cluster until the context ends.

    Args:
        address: ``HOST:PORT`` of the head node, ``auto`` for the cluster that this machine belongs to, or ``local`` to
            start a cluster on all cores of this machine, which ends with the connection.

    Raises:
        ConnectionError: No cluster answers at the address.
        DependencyNotInstalled: Ray is not installed.
    """
    check_ray_installed()
    import ray

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


def check_ray_installed() -> None:
    """Raise :class:`gymnasium.error.DependencyNotInstalled`, with the remedy, if Ray is missing."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # users have not agreed to Ray's usage statistics
    with extra("ray", "a Ray cluster"):
        import ray  # noqa: F401


def _check_answers(address: str) -> None:
    """Raise :class:`ConnectionError` at once if nothing listens at HOST:PORT."""
    host, colon, port = address.rpartition(":")
    if not colon and address not in ("auto", "local"):
        raise ConnectionError(f"the address of a Ray cluster must be HOST:PORT, auto or local, got {address}")
    if "//" in host or not colon:  # Ray itself checks ray://, auto and local
        return
    try:
        socket.create_connection((host, int(port)), timeout=_PATIENCE).close()
    except (OSError, ValueError, OverflowError):
        raise ConnectionError(f"no Ray cluster answers at {address}") from None


def cluster_cores() -> int:
    """Return the number of CPU cores of the cluster's nodes that are alive, at least 1."""
    import ray

    return max(1, int(ray.cluster_resources().get("CPU", 1)))


def share_value(value: Any) -> Any:
    """Put a value where every node can read it, and return a reference to it.

    A task that gets the reference as an argument of :func:`submit` receives the value.
    """
    import ray

    return ray.put(value)


def submit(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function on one core of some node. Return a task for :func:`gather`."""
    return _remote(RETRIES).remote(_versions(), function, *arguments)


def gather(tasks: Sequence[Any]) -> list[Any]:
    """Return the results of tasks, in their order.

    Raises the error of a task, or :class:`ConnectionError` if a task was lost too often or a node cannot run it.
    """
    import ray

    try:
        return list(ray.get(list(tasks)))
    except ray.exceptions.RayTaskError as error:
        if isinstance(error.cause, (ImportError, RuntimeError)):  # for example, the package is missing there
            reason = str(error.cause).strip().splitlines()[-1]
            raise ConnectionError(f"a node of the Ray cluster cannot play: {reason}") from None
        raise error.cause from None
    except ray.exceptions.RayError as error:
        raise ConnectionError(f"the Ray cluster lost a task: {str(error).splitlines()[0]}") from None


def ended(tasks: Sequence[Any], timeout: float) -> list[Any]:
    """Return the tasks that have ended. Wait up to ``timeout`` seconds for the first of them."""
    import ray

    if not tasks or not ray.wait(list(tasks), timeout=timeout)[0]:
        return []
    return list(ray.wait(list(tasks), num_returns=len(tasks), timeout=0)[0])


def cancel(tasks: Sequence[Any], grace: float) -> None:
    """Interrupt tasks. Kill the workers of those that still run after ``grace`` seconds."""
    import ray

    left = list(tasks)
    for force in (False, True):
        for task in left:
            ray.cancel(task, force=force)
        left = ray.wait(left, num_returns=len(left), timeout=grace)[1] if left else []


@lru_cache
def _remote(retries: int) -> Any:
    """Return the function that workers run, in Ray's form.

    It is made once, because Ray sends every such function to all workers.
    """
    import ray

    return ray.remote(num_cpus=1, max_retries=retries)(_call)


@lru_cache
def _versions() -> dict[str, str]:
    return versions()


def _call(expected: dict[str, str], function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function in a task, if this node has the driver's versions."""
    if _versions() != expected:
        here, there = (
            ", ".join(f"{name} {version}" for name, version in each.items()) for each in (_versions(), expected)
        )
        raise ValueError(f"node {socket.gethostname()} has {here}; the driver has {there}")
    return function(*arguments)
