"""Translation of one rule to a JavaScript function; see :mod:`esp_trainer.report.javascript`."""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import textwrap
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from predprey_env.jit import floats
from predprey_env.policies import chance

GIVEN = ("fma", "power_of_two", "as_float", "as_integer", "zeros", "add_products", "bits_of", "float_of")
"""Functions of :mod:`predprey_env.jit.floats` that are written by hand in JavaScript."""

_SIGNS: dict[type[ast.AST], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Mod: "%",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.BitXor: "^",
    ast.RShift: ">>",
    ast.Eq: "===",
    ast.NotEq: "!==",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.And: "&&",
    ast.Or: "||",
    ast.Not: "!",
    ast.USub: "-",
}
_FUNCTIONS: dict[Any, str] = {abs: "Math.abs", min: "Math.min", max: "Math.max", math.sqrt: "Math.sqrt"}
"""Functions of Python that exact rules may call."""

_RESERVED = {
    *("arguments", "await", "case", "catch", "const", "debugger", "default", "delete", "do", "enum", "eval", "export"),
    *("extends", "function", "implements", "instanceof", "interface", "let", "new", "null", "package", "private"),
    *("protected", "public", "static", "super", "switch", "this", "throw", "typeof", "var", "void"),
}
"""Names that variables of Python can have and those of JavaScript cannot."""

_ROUNDED = (ast.Add, ast.Sub, ast.Mult, ast.Div)  # operations whose results are rounded to 32 bits


def _dispatch(name: str, rules: Mapping[type, Callable[..., Any]]) -> str:
    """Return the JavaScript of a generic function: its only rule, or the one for the ``kind`` of the first argument."""
    if len(rules) == 1:
        return f"const {name} = {next(iter(rules.values())).__name__};"
    named = ", ".join(f"{cls.__name__}: {rule.__name__}" for cls, rule in rules.items())
    return f"function {name}(one, ...others) {{\n  return ({{ {named} }})[one.kind](one, ...others);\n}}"


def source_of(rule: Any) -> Callable[..., Any]:
    """Return the Python function of a compiled rule, or the rule itself if it is not compiled."""
    return getattr(rule, "py_func", rule)


class Translation:
    """The translation of a function.

    ``text`` is its JavaScript, ``called`` the rules that it calls, and ``generics`` the JavaScript of generic functions
    by name.
    """

    def __init__(self, function: Callable[..., Any], classes: Collection[type], exact: str | None) -> None:
        self.called: list[Callable[..., Any]] = []
        self.generics: dict[str, str] = {}
        self._classes = classes
        self._known = function.__globals__
        self._of_integers = function.__module__ == chance.__name__
        self._exact = exact is not None and f"{function.__module__}.".startswith(f"{exact}.")
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        names = [argument.arg for argument in tree.args.args]
        self._local = {*names, *(node.id for node in ast.walk(tree) if _is_stored(node))}  # type: ignore[attr-defined]
        if reserved := sorted(_RESERVED & {tree.name, *self._local}):
            raise ValueError(f"cannot translate names that JavaScript reserves: {', '.join(reserved)}")
        defaults = dict(zip(reversed(names), reversed(tree.args.defaults), strict=False))
        arguments = [f"{n} = {self._value(defaults[n])}" if n in defaults else n for n in names]
        summary = " ".join((ast.get_docstring(tree) or "").split("\n\n")[0].split())
        body = self._block(tree.body)
        fresh = sorted(self._local - set(names))
        declared = [f"  let {', '.join(fresh)};"] if fresh else []
        head = f"// {function.__module__}: {summary}\nfunction {tree.name}({', '.join(arguments)}) {{"
        self.text = "\n".join([head, *declared, *body, "}"])

    # -- statements -----------------------------------------------------------------------------------------------

    def _block(self, statements: list[ast.stmt]) -> list[str]:
        return [f"  {line}" for statement in statements for line in self._statement(statement)]

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Expr(ast.Constant()):  # the docstring
                return []
            case ast.Expr(value):
                return [f"{self._value(value)};"]
            case ast.Return(None):
                return ["return;"]
            case ast.Return(value):
                return [f"return {self._value(value)};"]  # type: ignore[arg-type]
            case ast.If(test, body, orelse):
                lines = [f"if ({self._value(test)}) {{", *self._block(body)]
                return [*lines, *(["} else {", *self._block(orelse)] if orelse else []), "}"]
            case ast.For(ast.Name(i), ast.Call(ast.Name("range"), bounds), body, []):
                return [f"for ({self._range(i, bounds)}) {{", *self._block(body), "}"]
            case ast.While(test, body, []):
                return [f"while ({self._value(test)}) {{", *self._block(body), "}"]
        return self._assignment(node)

    def _assignment(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Assign([target], value):
                return [f"{self._target(target)} = {self._value(value)};"]
            case ast.AnnAssign(target, _, ast.expr() as value):
                return [f"{self._target(target)} = {self._value(value)};"]
            case ast.AugAssign(target, operator, ast.Constant(int(step))):  # a counter
                return [f"{self._target(target)} {_sign(node, operator)}= {step};"]
            case ast.AugAssign(target, operator, value):
                return [f"{self._target(target)} = {self._value(ast.BinOp(target, operator, value))};"]
        raise _cannot(node)

    def _range(self, name: str, bounds: list[ast.expr]) -> str:
        """Return the head of a loop over integers, whose step is a positive constant."""
        first, last = ["0", *map(self._plain, bounds[:2])][-2:]
        step = self._constant(bounds[2]) if len(bounds) > 2 else "1"
        if step is None or int(step) <= 0:
            raise _cannot(bounds[2])
        return f"{name} = {first}; {name} < {last}; {name} += {step}"

    def _target(self, node: ast.expr) -> str:
        if isinstance(node, ast.Tuple):
            return f"[{', '.join(map(self._target, node.elts))}]"
        return node.id if isinstance(node, ast.Name) else self._value(node)

    # -- expressions ----------------------------------------------------------------------------------------------

    def _value(self, node: ast.expr) -> str:
        constant = self._constant(node)
        if constant is not None:
            return constant
        match node:
            case ast.Name(name):
                return name if name in self._local else self._global(name)
            case ast.Attribute(value, name):
                return f"{self._value(value)}.{name}"
            case ast.Subscript(value, index):
                at = index.elts if isinstance(index, ast.Tuple) else [index]
                return self._value(value) + "".join(f"[{self._plain(i)}]" for i in at)
            case ast.Tuple(elements):
                return f"[{', '.join(map(self._value, elements))}]"
            case ast.Call(function, arguments, []):
                return self._call(function, arguments)
        return self._operation(node)

    def _operation(self, node: ast.expr) -> str:
        match node:
            case ast.IfExp(test, body, orelse):
                return f"({self._value(test)} ? {self._value(body)} : {self._value(orelse)})"
            case ast.Compare(left, [operator], [right]):
                return f"({self._value(left)} {_sign(node, operator)} {self._value(right)})"
            case ast.BoolOp(operator, values):
                return f"({f' {_sign(node, operator)} '.join(map(self._value, values))})"
            case ast.UnaryOp(operator, operand):
                return f"{_sign(node, operator)}{self._value(operand)}"
            case ast.BinOp():
                return self._arithmetic(node)
        raise _cannot(node)

    def _plain(self, node: ast.expr) -> str:
        """Translate arithmetic on indices and counters, which needs no rounding."""
        if isinstance(node, ast.BinOp) and isinstance(node.op, _ROUNDED) and self._constant(node) is None:
            return f"({self._plain(node.left)} {_SIGNS[type(node.op)]} {self._plain(node.right)})"
        return self._value(node)

    def _arithmetic(self, node: ast.BinOp) -> str:
        left, right = self._value(node.left), self._value(node.right)
        if isinstance(node.op, ast.FloorDiv):
            return f"Math.floor({left} / {right})"
        plain = f"{left} {_sign(node, node.op)} {right}"
        if self._exact or not isinstance(node.op, _ROUNDED):
            return f"({plain})"
        # Random choices need integers above 2**24, which rounding to 32-bit floats would change.
        if self._of_integers and not self._is_float(node.left):
            return f"Math.imul({left}, {right})" if isinstance(node.op, ast.Mult) else f"({plain})"
        return f"Math.fround({plain})"

    def _call(self, function: ast.expr, arguments: list[ast.expr]) -> str:
        name = function.id if isinstance(function, ast.Name) else None
        match name, arguments:
            case "load", [array, row]:
                return f"{self._value(array)}[{self._plain(row)}]"
            case "store", [array, row, value]:
                return f"{self._value(array)}[{self._plain(row)}] = {self._value(value)}"
            case "where", [mask, one, other]:
                return f"({self._value(mask)} ? {self._value(one)} : {self._value(other)})"
            case "len", [array]:
                return f"{self._value(array)}.length"
            case str(), _:
                values = [self._value(argument) for argument in arguments]
                names = getattr(self._known.get(name), "_fields", None)
                if names:  # a named tuple
                    fields = zip(names, values, strict=True)
                    return f"({{ {', '.join(f'{field}: {value}' for field, value in fields)} }})"
                return f"{self._global(name)}({', '.join(values)})"
        raise _cannot(function)

    def _global(self, name: str) -> str:
        """Return the JavaScript name of a global of the rule's module: another rule, or a function in ``GIVEN``."""
        known = self._known.get(name, getattr(builtins, name, None))
        rules = {cls: source_of(rule) for cls, rule in getattr(known, "registry", {}).items() if cls in self._classes}
        if rules:
            self.called += rules.values()
            self.generics[name] = _dispatch(name, rules)
            return name
        if self._exact and inspect.isbuiltin(known) and known in _FUNCTIONS:
            return _FUNCTIONS[known]
        if name in GIVEN and known is getattr(floats, name):
            return name
        if not hasattr(known, "py_func") and not inspect.isfunction(known):
            raise ValueError(f"{name} is no rule: {known!r}")
        self.called.append(source_of(known))
        return source_of(known).__name__

    def _constant(self, node: ast.expr) -> str | None:
        """Return the value of an expression of literals and module constants; None for any other expression."""
        known: dict[str, Any] = {}
        for part in ast.walk(node):
            if isinstance(part, ast.Name):
                known[part.id] = None if part.id in self._local else self._known.get(part.id)
            elif isinstance(part, ast.Constant):
                known[repr(part.value)] = part.value
            elif not isinstance(part, (ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop, ast.expr_context)):
                return None
        if not all(isinstance(value, (int, float, np.number)) for value in known.values()):
            return None
        value = eval(compile(ast.Expression(node), "<rule>", "eval"), known)
        if isinstance(value, bool):
            return str(value).lower()
        return repr(value.item() if isinstance(value, np.number) else value)

    def _is_float(self, node: ast.expr) -> bool:
        return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "as_float"


def _cannot(node: ast.AST) -> ValueError:
    return ValueError(f"cannot translate {ast.unparse(node)!r}")


def _sign(node: ast.AST, operator: ast.AST) -> str:
    """Return an operator in JavaScript; raise :class:`ValueError`, which quotes ``node``, if there is none."""
    if type(operator) not in _SIGNS:
        raise _cannot(node)
    return _SIGNS[type(operator)]


def _is_stored(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
