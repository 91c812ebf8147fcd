"""Rules become machine code once, in the function that Python calls.

Numba optimises each compiled function and generates its machine code, and does both again wherever the function is
inlined. Rules are always inlined, so most of this work on the rules themselves is wasted; it took half of the compile
time. Here a rule is only lowered to LLVM instructions. Its caller links them in, with the instructions of everything
that the rule calls, and optimises the whole. Only rules with a loop are also optimised by themselves, because kernels
are a tenth slower otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

from numba._dynfunc import make_function
from numba.core.analysis import compute_cfg_from_blocks
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering
from numba.extending import overload

# Numba and llvmlite declare no types.
_Module: TypeAlias = Any
_Library: TypeAlias = Any


class _Instructions(JITCodeLibrary):
    """A library whose functions are inlined elsewhere; they need no machine code."""

    has_loop = False
    _whole: _Module = None

    def finalize(self) -> None:
        """Optimise a rule that has a loop, with everything that it calls, and accept no more functions."""
        self._raise_if_finalized()
        if self.has_loop:
            self._link_called(self._final_module)
            self._linking_libraries.clear()
            self._optimize_final_module()
        self._finalized = True

    def _get_module_for_linking(self) -> _Module:
        """Return the instructions of this library and of all that it calls, as a module that may be linked in often."""
        if self._whole is None:
            self._whole = self._own().clone()
            self._link_called(self._whole)
        return self._whole

    def _link_called(self, module: _Module) -> None:
        for library in self._called({id(self)}):
            called = library._own() if isinstance(library, _Instructions) else library._get_module_for_linking()
            module.link_in(called, preserve=True)

    def _own(self) -> _Module:
        """Return the instructions of this library alone, as a module that may be linked in often."""
        return super()._get_module_for_linking()

    def _called(self, seen: set[int]) -> Iterator[_Library]:
        """Yield each library that is called from here, directly or not, and was not seen."""
        for library in self._linking_libraries:
            if id(library) not in seen:
                seen.add(id(library))
                yield library
                if isinstance(library, _Instructions):
                    yield from library._called(seen)


@register_pass(mutates_CFG=False, analysis_only=False)
class _LowerOnly(NativeLowering):
    """Numba's lowering without its last part, which optimises and generates machine code."""

    _name = "lower_only"

    def run_pass(self, state: Any) -> bool:
        """Lower a function to instructions, and tell its callers where they are."""
        state.library = _Instructions(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        state.library.has_loop = bool(compute_cfg_from_blocks(state.func_ir.blocks).loops())
        lowered, name = state.cr, state.func_id.func_name
        # Callers look the function up by this object. It has no address, so Python cannot call it.
        known = make_function(lowered.fndesc.lookup_module(), name, "", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(known, lowered.fndesc, [state.library])
        state.cr = lowered._replace(cfunc=known)
        return True


class RuleCompiler(Compiler):
    """Numba's compiler for functions that only compiled functions call, and that are inlined into them."""

    def define_pipelines(self) -> list[Any]:
        """Return Numba's passes, with :class:`_LowerOnly` in place of lowering."""
        pipelines = super().define_pipelines()
        for passes in pipelines:
            passes.passes = [(_LowerOnly if each is NativeLowering else each, name) for each, name in passes.passes]
            passes.finalize()
        return pipelines


INLINED: dict[str, object] = {"nopython": True, "nogil": True, "_nrt": False, "forceinline": True}
"""Options of rules."""
UNWRAPPED: dict[str, object] = INLINED | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Options of rules that only compiled functions call: without wrappers for Python and C, which take time to compile."""


def inlined(function: Callable[..., object]) -> Any:
    """Return a decorator like :func:`numba.extending.overload`, for implementations that are inlined as rules are."""
    return overload(function, jit_options=UNWRAPPED | {"pipeline_class": RuleCompiler})
