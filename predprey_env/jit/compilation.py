"""Rules, which compiled functions inline, and Numba entry points, which Python calls."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba import types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher

from predprey_env.jit.cache import DigestCache, NoCache
from predprey_env.jit.linking import INLINED, UNWRAPPED, RuleCompiler
from predprey_env.jit.sources import Function, remember

Compiled = TypeVar("Compiled", bound=Function)
_NUMBA = Path(numba.__file__).parent


class _Rule(CPUDispatcher):
    """A compiled function for compiled callers. A call from Python goes to a second one, which has a Python wrapper."""

    def __init__(self, function: Function) -> None:
        super().__init__(function, targetoptions=dict(UNWRAPPED), pipeline_class=RuleCompiler)
        self._for_python = CPUDispatcher(function, targetoptions=dict(INLINED))

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self._for_python(*arguments, **named)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how a compiled caller calls the rule. A literal integer is compiled like any other integer."""
        plain = (types.unliteral(kind) if isinstance(kind, types.IntegerLiteral) else kind for kind in args)
        return super().get_call_template(tuple(plain), kws)


def rule(function: Compiled) -> Compiled:
    """Compile a function that other compiled functions call; it is inlined into them.

    Rules must not allocate memory: Numba's reference counting is switched off, because it costs more than the rules
    themselves.
    """
    remember(function)
    return function if numba.config.DISABLE_JIT else _Rule(function)


class _EntryPoint(CPUDispatcher):
    """A compiled function that Python calls. Raises :class:`ValueError`, in one line, if it does not compile."""

    def __init__(self, function: Function) -> None:
        super().__init__(function, targetoptions={"nopython": True, "nogil": True, "_nrt": False})

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or load what was compiled before, here or in another process."""
        # Numba's lock comes first, because two threads of Python 3.11 must not parse sources at once.
        with global_compiler_lock, self._cache.alone(sig, self.targetctx):
            return super().compile(sig)

    def _compile_for_args(self, *arguments: Any, **named: Any) -> Any:
        try:
            return super()._compile_for_args(*arguments, **named)
        except NumbaError as error:
            raise ValueError(_failure(error)) from error


def _failure(error: NumbaError) -> str:
    """Return an error of Numba as one line: the innermost rule, the place in it, and the reason."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    inside, *callers = re.split(r"resolving callee type: type\(_Rule\(<function (\w+) ", text)  # the innermost first
    rule = f"the rule {callers[0]}" if callers else "a rule"
    places = re.finditer(r'File "([^"]+)", line (\d+)', inside)
    place = next((found for found in places if not Path(found[1]).is_relative_to(_NUMBA)), None)
    where = f" ({Path(place[1]).name}, line {place[2]})" if place else ""
    lines = [line.strip(" >") for line in text.splitlines() if line.strip()]
    at = max((i + 1 for i, line in enumerate(lines[:-1]) if line.startswith("Failed in")), default=0)
    reason = " ".join(lines[at : at + 2]) if lines[at].endswith(":") else lines[at]
    if "Function(<class 'bool'>)" in reason and "Lanes(" in reason:
        reason = "if, while, and, or and not need one truth, got one for each lane; use where(), & and |"
    return f"{rule}{where} does not compile: {reason}"


def entry_point(function: Compiled) -> Compiled:
    """Compile a function that Python calls. Its machine code is cached on disk, and threads can run it at the same
    time.

    Like a rule, it must not allocate memory; callers pass the arrays that it writes to.
    """
    remember(function)
    if numba.config.DISABLE_JIT:
        return function
    dispatcher = _EntryPoint(function)
    try:
        dispatcher._cache = DigestCache(function)
    except RuntimeError:  # no cache directory on this machine can be written to
        dispatcher._cache = NoCache(function)
    return dispatcher
