"""Rules are linked into whatever compiled function calls them, through rules and through others' functions."""

from __future__ import annotations

import numba
import numpy as np

from predprey_env.jit import entry_point, load, rule, where


@rule
def halved(a):
    return where(a < 0, 0, a) // 2


@rule
def halved_twice(a):
    return halved(halved(a))


@numba.njit
def one_more(a):
    return halved(a) + 1


@rule
def total(numbers):
    """Sum up, in a loop, what rules without one return; and call somebody else's function."""
    found = 0
    for i in range(len(numbers)):
        found += halved_twice(load(numbers, i)) + one_more(load(numbers, i))
    return found


NUMBERS = np.array([8, -3, 5], np.int32)
TOTAL = (2 + 5) + (0 + 1) + (1 + 3)


def test_a_rule_is_called_from_python() -> None:
    assert halved_twice(9) == 2
    assert total(NUMBERS) == TOTAL


def test_a_function_for_python_has_all_that_its_rules_call() -> None:
    # The rules are not called from here before: nothing else has their machine code.
    assert entry_point(lambda numbers: total(numbers) + halved_twice(numbers[0]))(NUMBERS) == TOTAL + 2


def test_a_function_of_somebody_elses_has_all_that_its_rules_call() -> None:
    assert numba.njit(lambda numbers: total(numbers) + halved_twice(numbers[0]))(NUMBERS) == TOTAL + 2


def test_rules_have_no_machine_code_of_their_own() -> None:
    entry_point(lambda numbers: total(numbers))(NUMBERS)
    compiled = [found for each in (halved, halved_twice, total) for found in each.overloads.values()]
    assert compiled
    assert not any(found.library.get_pointer_to_function(found.fndesc.llvm_func_name) for found in compiled)
