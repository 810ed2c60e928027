"""Conditions on the columns of a table, as ``lanes >= 2 and road_class == 'primary'``.

Nothing of what a user writes is run: the text is parsed, and only comparisons, ``in``, ``and``,
``or``, ``not``, arithmetic on numbers, names of columns and constants are understood.
"""

from __future__ import annotations

import ast
import difflib
import operator
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults, did_you_mean

LONGEST = 2000  # characters
DEEPEST = 50  # levels of the parsed text

Flags = npt.NDArray[np.bool_]
Kind = Literal["text", "number", "truth", "nothing"]

_SAME: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Is: operator.eq,
    ast.IsNot: operator.ne,
}
_ORDER: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_ARITHMETIC: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_UNDERSTOOD: tuple[type[ast.AST], ...] = (
    *_SAME,
    *_ORDER,
    *_ARITHMETIC,
    *(ast.Expression, ast.BoolOp, ast.And, ast.Or, ast.UnaryOp, ast.Not, ast.USub, ast.UAdd),
    *(ast.Compare, ast.In, ast.NotIn, ast.BinOp, ast.Name, ast.Load, ast.Constant),
    *(ast.List, ast.Tuple),
)
_KINDS: dict[str, Kind] = {
    "boolean": "truth",
    "integer": "number",
    "floating": "number",
    "mixed-integer-float": "number",
    "decimal": "number",
    "empty": "nothing",
}


@dataclass(frozen=True)
class _Values:
    """What a part of the expression is, in every row: its kind, values, and where it has none."""

    kind: Kind
    values: npt.NDArray[Any]
    missing: Flags
    text: str


def rows_where(table: pd.DataFrame, expression: str, faults: Faults) -> Flags:
    """Return in which rows an expression holds, shape (rows,); faults are noted, all at once.

    A comparison with a missing value does not hold; ``name == None`` holds where it is missing.
    """
    tree = _parse(expression, faults)
    if tree is None or not _is_understood(tree, table, faults):
        return np.zeros(len(table), bool)
    found = len(faults.found)
    result = _Reader(table, faults).read(tree.body)
    if len(faults.found) == found and result.kind != "truth":
        faults.add("must be a condition, as lanes >= 2", value=expression)
    return _holds(result)


def add_unknown_texts(table: pd.DataFrame, expression: str, faults: Faults) -> None:
    """Note texts that an expression holds against a column in no row of which they stand.

    To be asked where it has proved to be understood, and to hold in no row.
    """
    tree = ast.parse(expression.strip(), mode="eval")
    for node in ast.walk(tree):
        if not isinstance(node, ast.Compare) or len(node.ops) > 1:
            continue
        if not isinstance(node.ops[0], ast.Eq | ast.Is | ast.In):
            continue
        sides = [node.left, *getattr(node.comparators[0], "elts", node.comparators)]
        columns = [side.id for side in sides if isinstance(side, ast.Name)]
        texts = [side.value for side in sides if isinstance(side, ast.Constant)]
        for column in columns[:1]:
            known = [str(text) for text in table[column].dropna().unique()]
            for text in (text for text in texts if isinstance(text, str) and text not in known):
                what = f"no link has this {column}{did_you_mean(text, known)}"
                faults.add(what, column="where", value=text)


def _parse(expression: str, faults: Faults) -> ast.Expression | None:
    if len(expression) > LONGEST:
        faults.add(f"is longer than {LONGEST} characters", value=expression)
        return None
    try:
        tree = ast.parse(expression.strip(), mode="eval")
    except SyntaxError as error:
        what = f"cannot be read at character {error.offset}; write it as lanes >= 2 and name == 'a'"
        faults.add(what, value=expression)
        return None
    except (ValueError, RecursionError, MemoryError):
        faults.add("cannot be read: nested too deeply, or with characters of control")
        return None
    level: list[ast.AST] = [tree]
    for _ in range(DEEPEST):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return tree
    faults.add("is nested too deeply", value=expression)
    return None


def _is_understood(tree: ast.Expression, table: pd.DataFrame, faults: Faults) -> bool:
    """Note all that is no part of the language, and all unknown columns."""
    before = len(faults.found)
    lists = {id(part) for node in ast.walk(tree) for part in _lists_of(node)}
    for node in ast.walk(tree):
        if not isinstance(node, _UNDERSTOOD):
            what = (
                "is not understood; use columns, numbers, 'texts', ==, !=, <, >, in, and, or, not"
            )
            faults.add(what, value=_text(node))
        elif isinstance(node, ast.List | ast.Tuple) and id(node) not in lists:
            faults.add("a list is understood after in only", value=_text(node))
        elif isinstance(node, ast.Name) and node.id not in _columns(table):
            faults.add(_unknown_column(node.id, table), value=node.id)
    return len(faults.found) == before


def _lists_of(node: ast.AST) -> list[ast.expr]:
    """Return the lists that stand where they may: behind ``in``."""
    if not isinstance(node, ast.Compare):
        return []
    pairs = zip(node.ops, node.comparators, strict=True)
    return [right for sign, right in pairs if isinstance(sign, ast.In | ast.NotIn)]


def _columns(table: pd.DataFrame) -> list[str]:
    return [str(name) for name in table.columns if table.dtypes[name].name != "geometry"]


def _unknown_column(name: str, table: pd.DataFrame) -> str:
    columns = _columns(table)
    near = difflib.get_close_matches(name, columns, n=1)
    advice = f"did you mean {near[0]}" if near else f"there are {', '.join(columns)}"
    return f"no such column: {advice}; or is it a text, which stands in quotes?"


def _text(node: ast.AST) -> str:
    try:
        return ast.unparse(node) or type(node).__name__
    except (AttributeError, ValueError):
        return type(node).__name__


class _Reader:
    """Reads the parts of an understood expression, noting where kinds do not go together."""

    def __init__(self, table: pd.DataFrame, faults: Faults) -> None:
        self.table = table
        self.faults = faults

    def read(self, node: ast.expr) -> _Values:
        if isinstance(node, ast.Name):
            return _column(self.table[node.id])
        if isinstance(node, ast.Constant):
            return self._constant(node)
        if isinstance(node, ast.Compare):
            return self._compare(node)
        if isinstance(node, ast.BoolOp):
            parts = [self._condition(part) for part in node.values]
            join = np.logical_and if isinstance(node.op, ast.And) else np.logical_or
            return self._truth(join.reduce(parts), node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return self._truth(~self._condition(node.operand), node)
        if isinstance(node, ast.UnaryOp):
            sign = ast.Constant(-1 if isinstance(node.op, ast.USub) else 1)
            return self._calculate(ast.BinOp(sign, ast.Mult(), node.operand))
        if isinstance(node, ast.BinOp):
            return self._calculate(node)
        raise AssertionError("no other part is understood")

    def _truth(self, holds: npt.NDArray[Any], node: ast.AST) -> _Values:
        return _Values("truth", np.asarray(holds, bool), np.zeros(len(holds), bool), _text(node))

    def _nothing(self, node: ast.AST) -> _Values:
        rows = len(self.table)
        return _Values("nothing", np.zeros(rows), np.ones(rows, bool), _text(node))

    def _constant(self, node: ast.Constant) -> _Values:
        value, rows = node.value, len(self.table)
        kind: Kind = "nothing"
        if isinstance(value, bool):
            kind = "truth"
        elif isinstance(value, int | float) and abs(value) < 1e300:
            kind = "number"
            value = float(value)
        elif isinstance(value, str):
            kind = "text"
        elif value is not None:
            self.faults.add("is no text, number, True, False or None", value=_text(node))
        values = np.full(rows, value, dtype=object if kind == "text" else None)
        return _Values(kind, values, np.full(rows, kind == "nothing"), _text(node))

    def _condition(self, node: ast.expr) -> Flags:
        part = self.read(node)
        if part.kind not in ("truth", "nothing"):
            self.faults.add(f"is a {part.kind}, no condition: compare it", value=part.text)
        return _holds(part)

    def _compare(self, node: ast.Compare) -> _Values:
        holds = np.ones(len(self.table), bool)
        left = node.left
        for sign, right in zip(node.ops, node.comparators, strict=True):
            if isinstance(sign, ast.In | ast.NotIn):
                holds &= self._among(left, sign, right)
            else:
                holds &= self._pair(self.read(left), sign, self.read(right))
            left = right
        return self._truth(holds, node)

    def _among(self, left: ast.expr, sign: ast.cmpop, right: ast.expr) -> Flags:
        values = self.read(left)
        if not isinstance(right, ast.List | ast.Tuple):
            self.faults.add("in wants a list, as ['a', 'b']", value=_text(right))
            return _holds(values)
        each = [self._pair(values, ast.Eq(), self.read(part)) for part in right.elts]
        among: Flags = np.logical_or.reduce(each) if each else np.zeros(len(self.table), bool)
        return among if isinstance(sign, ast.In) else ~among & ~values.missing

    def _pair(self, left: _Values, sign: ast.cmpop, right: _Values) -> Flags:
        if type(sign) in _SAME and "None" in (left.text, right.text):
            other = left if right.text == "None" else right
            wanted = isinstance(sign, ast.Eq | ast.Is)
            return np.equal(other.missing, wanted)
        if "nothing" in (left.kind, right.kind):
            return np.zeros(len(self.table), bool)
        if left.kind != right.kind:
            what = f"{left.text} is a {left.kind}, {right.text} is a {right.kind}"
            advice = "; a text stands in quotes, a number does not"
            self.faults.add(f"cannot be compared: {what}{advice}")
            return np.zeros(len(self.table), bool)
        if type(sign) in _ORDER and left.kind != "number":
            what = f"{left.text} is a {left.kind}, and only numbers have an order: use == or in"
            self.faults.add(what)
            return np.zeros(len(self.table), bool)
        return _both(left, right, (_SAME | _ORDER)[type(sign)])

    def _calculate(self, node: ast.BinOp) -> _Values:
        left, right = self.read(node.left), self.read(node.right)
        for part in (left, right):
            if part.kind in ("text", "truth"):
                self.faults.add(f"is a {part.kind}, no number to reckon with", value=part.text)
        if not left.kind == right.kind == "number":
            return self._nothing(node)
        with np.errstate(all="ignore"):  # what cannot be reckoned is missing
            values = _ARITHMETIC[type(node.op)](left.values, right.values)
        missing = left.missing | right.missing | ~np.isfinite(values)
        return _Values("number", values, missing, _text(node))


def _column(column: pd.Series) -> _Values:
    missing = column.isna().to_numpy(bool)
    kind = _KINDS.get(pd.api.types.infer_dtype(column, skipna=True), "text")
    if missing.all():
        kind = "nothing"
    filled = column.to_numpy(object, copy=True)
    filled[missing] = {"number": np.nan, "truth": False}.get(kind, "")
    dtype = {"number": np.float64, "truth": np.bool_}.get(kind)
    values = filled.astype(dtype) if dtype else np.array([str(one) for one in filled], object)
    return _Values(kind, values, missing, str(column.name))


def _both(left: _Values, right: _Values, compare: Callable[[Any, Any], Any]) -> Flags:
    holds: Flags = np.asarray(compare(left.values, right.values), bool)
    return holds & ~left.missing & ~right.missing


def _holds(part: _Values) -> Flags:
    if part.kind != "truth":
        return np.zeros(len(part.missing), bool)
    holds: Flags = part.values.astype(bool) & ~part.missing
    return holds
