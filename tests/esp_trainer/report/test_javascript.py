"""The translator of rules; whether the page plays as the trainer does is in ``test_page_plays.py``."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
import pytest

from esp_trainer.report.javascript import translate
from esp_trainer.report.matches import rules_in_javascript
from predprey_env.jit.compilation import rule
from predprey_env.jit.floats import as_float, fma
from predprey_env.jit.lanes import load, store, where
from predprey_env.policies import chance

HALF, ONE, FLAG, COUNT = np.float32(0.1), np.float32(1), True, 1 << 20


@rule
def halve(a: Any) -> Any:
    """The half of a number,
    or nearly.

    More about it.
    """
    return a * HALF


@rule
def everything(world: Any, at: int, n: int = 3) -> Any:
    """Most of what rules are made of."""
    total = 0
    for i in range(n):
        for k in range(1, at + 1):
            total += k
        if i == 2 and not FLAG:
            store(world.x, i + 1, where(load(world.x, i) < COUNT, halve(n), fma(as_float(at), ONE / 2, -ONE / 2)))
        else:
            world.y[i, 0] = -total // 2
    one, other = total % 2, len(world.x) if n > 1 else 0
    return one, other


@rule
def exactly(a: Any, n: int) -> Any:
    """Arithmetic that is not rounded."""
    low, led = min(abs(a[0]), max(a[1], n)), 0
    for k in range(8, n + 1, 4):
        led += k > 9 and (low < k or not FLAG)
    while led > 0 and low * led > n / 3:
        led -= 1
    return 0.8 * sqrt(low + led) - n // 2


def test_a_rule_keeps_its_name_and_its_summary() -> None:
    text = translate(halve)
    assert f"// {__name__}: The half of a number, or nearly.\nfunction halve(a) {{\n" in text
    assert "More about it" not in text


def test_numbers_of_32_bits_are_written_out_in_full_and_results_rounded() -> None:
    assert "return Math.fround(a * 0.10000000149011612);" in translate(halve)
    assert float(np.float32(0.1)) == 0.10000000149011612


def test_all_that_rules_are_made_of() -> None:
    lines = [line.strip() for line in translate(everything).splitlines()]
    assert lines[1:] == [
        "function everything(world, at, n = 3) {",
        "let i, k, one, other, total;",
        "total = 0;",
        "for (i = 0; i < n; i += 1) {",
        "for (k = 1; k < (at + 1); k += 1) {",
        "total = Math.fround(total + k);",
        "}",
        "if (((i === 2) && false)) {",
        "world.x[(i + 1)] = ((world.x[i] < 1048576) ? halve(n) : fma(as_float(at), 0.5, -0.5));",
        "} else {",
        "world.y[i][0] = Math.floor(-total / 2);",
        "}",
        "}",
        "[one, other] = [(total % 2), ((n > 1) ? world.x.length : 0)];",
        "return [one, other];",
        "}",
        "",
        f"// {__name__}: The half of a number, or nearly.",
        "function halve(a) {",
        "return Math.fround(a * 0.10000000149011612);",
        "}",
    ]


def test_exact_rules_compute_with_the_numbers_of_javascript() -> None:
    lines = [line.strip() for line in translate(exactly, exact=__name__).splitlines()]
    assert lines[1:] == [
        "function exactly(a, n) {",
        "let k, led, low;",
        "[low, led] = [Math.min(Math.abs(a[0]), Math.max(a[1], n)), 0];",
        "for (k = 8; k < (n + 1); k += 4) {",
        "led = (led + ((k > 9) && ((low < k) || false)));",
        "}",
        "while (((led > 0) && ((low * led) > (n / 3)))) {",
        "led -= 1;",
        "}",
        "return ((0.8 * Math.sqrt((low + led))) - Math.floor(n / 2));",
        "}",
    ]


def test_only_the_rules_of_the_exact_package_are_exact() -> None:
    text = translate(chance.next_state, halve, exact="esp_trainer.analysis")
    assert "Math.imul" in text
    assert "Math.fround" in text
    assert translate(halve, exact=__name__[:-1]) == translate(halve), "a package is not a part of a name"


@pytest.mark.parametrize("numbers", [([3, -4], 9), ([-30, 2], 40), ([7, 0], 8), ([10**9, 10**9], 10**4)])
def test_exact_rules_give_in_javascript_what_they_give_in_python(numbers: Any, blank_tab: Any) -> None:
    script = f"(given) => {{ {translate(exactly, exact=__name__)} return exactly(...given); }}"
    given = np.array(numbers[0]), numbers[1]
    assert blank_tab(script, list(numbers)) == exactly(*given) == exactly.py_func(*given)


def test_products_of_large_integers_keep_their_low_bits() -> None:
    assert "((Math.imul(state, 1664525) + 1013904223) & 2147483647)" in translate(chance.next_state)
    assert "Math.floor(2147483648 / n)" in translate(chance.pick)
    assert "Math.fround(as_float(state) * 4.656612873077393e-10)" in translate(chance.unit_float)


def test_each_rule_is_translated_once() -> None:
    text = rules_in_javascript("")
    names = [line.split("(")[0] for line in text.splitlines() if line.startswith("function ")]
    assert len(names) == len(set(names)) > 30
    assert {
        "function step",
        "function offsets_seen",
        "function vote",
        "function sample_action",
        "function surround",
    } <= set(names)


def stops(a: Any) -> Any:
    while a > 0:
        break
    return a


def counts_down(a: Any) -> Any:
    for k in range(a, 0, -1):
        a = k
    return a


def not_exact(a: Any) -> Any:
    return abs(a)


def keyword(a: Any) -> Any:
    return halve(a=a)


def foreign(a: Any) -> Any:
    return np.sin(a)


def text(a: Any) -> Any:
    return "a" + a


def chained(a: Any) -> Any:
    return 0 < a < 1


@pytest.mark.parametrize("function", [stops, counts_down, not_exact, keyword, foreign, text, chained])
def test_what_is_in_no_rule_is_refused(function: Any) -> None:
    with pytest.raises(ValueError, match=r"cannot translate|is no rule"):
        translate(function)


def test_two_rules_of_one_name_are_refused() -> None:
    other = {"halve": rule(lambda a: a)}["halve"]
    other.py_func.__name__ = "halve"
    with pytest.raises(ValueError, match="two rules are called halve"):
        translate(halve, other)


def adds(a: Any) -> Any:
    n = 0
    n += 1
    a += 0.1
    a += n * a
    return a


def test_a_sum_is_rounded_however_it_is_written() -> None:
    text = translate(adds)
    assert "n += 1;" in text
    assert "a = Math.fround(a + 0.1);" in text
    assert "a = Math.fround(a + Math.fround(n * a));" in text


def reserved(a: Any) -> Any:
    new = a + 1
    return new * new


def within(a: Any) -> Any:
    return a if a in (1, 2) else 0


def shifted(a: Any) -> Any:
    return a << 1


@pytest.mark.parametrize(
    ("function", "why"),
    [
        (reserved, "cannot translate names that JavaScript reserves: new"),
        (within, r"cannot translate .a in \(1, 2\)."),
        (shifted, "cannot translate 'a << 1'"),
    ],
)
def test_what_javascript_cannot_say_is_refused_in_one_line(function: Any, why: str) -> None:
    with pytest.raises(ValueError, match=f"^{why}$"):
        translate(function)
