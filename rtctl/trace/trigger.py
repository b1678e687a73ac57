"""Conditions on signals, such as `abs(error) > 1e-3 and u1 < 2`, that start a capture.

An expression may hold signal names, numbers (SI, no units), + - * /, comparisons, and, or, not, abs, min, max. It is
evaluated column by column and never run as Python.
"""

import ast
import operator
import warnings
from collections.abc import Callable, Iterable
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError, nearest

LONGEST = 500  # characters
MOST_NODES = 200  # of the syntax tree; keeps the recursion shallow
ARITHMETIC: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.true_divide,
}
JOIN: dict[type, Callable[..., Any]] = {ast.And: np.logical_and, ast.Or: np.logical_or}
COMPARE: dict[type, Callable[..., Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
CALLS: dict[str, Callable[..., Any]] = {"abs": np.abs, "min": np.minimum, "max": np.maximum}


class _Part(NamedTuple):
    is_condition: bool
    value: Callable[[np.ndarray], Any]  # rows -> column or number


class Trigger:
    """`trigger(rows)` returns the first row where the condition turns true, or -1; keeps its state between batches.

    A condition must be false once before it can turn true. A comparison with nan is false. Raises UserError for an
    invalid expression; for an unknown signal it names the nearest known signal.
    """

    def __init__(self, expression: str, names: Iterable[str]):
        self.expression = expression
        self._names = tuple(names)
        self._condition = self._parse(expression)
        self._was = True

    def __call__(self, rows: np.ndarray) -> int:
        if not len(rows):
            return -1
        with np.errstate(all="ignore"):
            now = np.broadcast_to(np.asarray(self._condition(rows), dtype=bool), len(rows))
        turns = now & ~np.concatenate(([self._was], now[:-1]))
        self._was = bool(now[-1])
        return int(np.argmax(turns)) if turns.any() else -1

    def _parse(self, expression: str) -> Callable[[np.ndarray], Any]:
        if len(expression) > LONGEST:
            raise UserError(f"the trigger is {len(expression)} characters long; at most {LONGEST} are allowed")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # "invalid decimal literal" of a text that is refused below
                tree = ast.parse(expression.strip(), mode="eval")
        except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
            where = f" near column {error.offset}" if isinstance(error, SyntaxError) and error.offset else ""
            raise UserError(
                f"trigger '{expression}' cannot be read{where}; write e.g. abs(error) > 1e-3 and u1 < 2 (SI, no units)"
            ) from None
        if sum(1 for _ in ast.walk(tree)) > MOST_NODES:
            raise UserError(f"trigger '{expression}' has too many parts; record all and select afterwards")
        return self._expect(tree.body, condition=True).value

    def _expect(self, node: ast.expr, condition: bool) -> _Part:
        part = self._part(node)
        if part.is_condition != condition:
            has, want = ("a condition", "a number") if part.is_condition else ("a number", "a condition such as u > 2")
            raise self._error(node, f"is {has}, where {want} is needed")
        return part

    def _part(self, node: ast.expr) -> _Part:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return self._number(node, number)
            case ast.Name(id=name):
                return self._signal(name)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                inner = self._expect(operand, condition=True).value
                return _Part(True, lambda rows: np.logical_not(inner(rows)))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                inner = self._expect(operand, condition=False).value
                return _Part(False, lambda rows: -inner(rows))
            case ast.BinOp(op=op) if type(op) in ARITHMETIC:
                return _Part(False, self._fold(ARITHMETIC[type(op)], [node.left, node.right], condition=False))
            case ast.BoolOp(op=op, values=values):
                return _Part(True, self._fold(JOIN[type(op)], values, condition=True))
            case ast.Compare():
                return self._comparison(node)
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in CALLS:
                return self._call(node, name, arguments)
        raise self._error(node, "is not allowed in a trigger")

    def _number(self, node: ast.expr, number: float) -> _Part:
        try:
            value = float(number)
        except OverflowError:
            raise self._error(node, "is too large a number") from None
        return _Part(False, lambda rows: np.float64(value))

    def _signal(self, name: str) -> _Part:
        if name not in self._names:
            near = nearest(name, self._names)
            hint = f"did you mean '{near}'?" if near else f"there are {', '.join(self._names)}"
            raise UserError(f"trigger '{self.expression}': no signal '{name}'; {hint}")
        return _Part(False, lambda rows: rows[name].astype(np.float64))

    def _comparison(self, node: ast.Compare) -> _Part:
        if not all(type(op) in COMPARE for op in node.ops):
            raise self._error(node, "is not a comparison of numbers")
        sides = [self._expect(side, condition=False).value for side in (node.left, *node.comparators)]
        pairs = [(COMPARE[type(op)], a, b) for op, a, b in zip(node.ops, sides, sides[1:], strict=False)]
        return _Part(True, lambda rows: reduce(np.logical_and, [op(a(rows), b(rows)) for op, a, b in pairs]))

    def _call(self, node: ast.expr, name: str, arguments: list[ast.expr]) -> _Part:
        if (len(arguments) != 1) if name == "abs" else (len(arguments) < 2):
            raise self._error(node, "needs one argument" if name == "abs" else "needs two arguments or more")
        if name == "abs":
            inner = self._expect(arguments[0], condition=False).value
            return _Part(False, lambda rows: np.abs(inner(rows)))
        return _Part(False, self._fold(CALLS[name], arguments, condition=False))

    def _fold(self, join: Callable[..., Any], nodes: list[ast.expr], condition: bool) -> Callable[[np.ndarray], Any]:
        parts = [self._expect(node, condition).value for node in nodes]
        return lambda rows: reduce(join, [part(rows) for part in parts])

    def _error(self, node: ast.expr, why: str) -> UserError:
        return UserError(f"trigger '{self.expression}': '{ast.unparse(node)}' {why}")
