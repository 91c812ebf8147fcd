"""Rules are compiled once for each signature, and can be called from Python all the same."""

from __future__ import annotations

from numba import types

from predprey_env.jit import rule


@rule
def weigh(a, b):
    """Return a sum with weights."""
    return 2 * a + b


@rule  # no entry point, whose machine code would come from the cache
def weigh_with_literals(a):
    """Call the rule with a number, and with several literals."""
    return weigh(a, a) + weigh(a, 1) + weigh(0, a) + weigh(1, 2)


def test_python_and_compiled_code_get_the_same_from_a_rule():
    assert weigh(3, 4) == weigh(3, b=4) == 10
    assert weigh_with_literals(3) == 9 + 7 + 3 + 4


def test_literal_integers_are_compiled_like_other_integers():
    weigh_with_literals(3)
    assert list(weigh.overloads) == [(types.int64, types.int64)]


def test_a_rule_that_only_compiled_code_calls_has_no_wrapper_for_python():
    weigh_with_literals(3)
    (compiled,) = weigh.overloads.values()
    names = {function.name for function in compiled.library.get_defined_functions()}
    assert names
    assert not any("cpython" in name or "cfunc" in name for name in names)


def test_a_rule_keeps_its_name_its_documentation_and_its_source():
    assert weigh.__name__ == "weigh"
    assert weigh.__doc__ == "Return a sum with weights."
    assert weigh.py_func(3, 4) == 10
