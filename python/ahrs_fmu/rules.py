"""The small language of the rules between parameters in a descriptor.

A rule is a Boolean expression in Python syntax over parameter names, numbers, ``inf``, ``epsilon``
(the relative rounding of the precision in use), the items of an enumeration, indices such as
``q0[0]``, arithmetic, comparisons, ``and``, ``or``, ``not``. It is evaluated in Python and
translated to C from the same syntax tree.
"""

from __future__ import annotations

import ast
import operator
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ahrs_fmu.errors import DescriptorError

Value = float | int | bool | Sequence[float]

_CONSTANTS: Mapping[str, str] = {"inf": "AHRS_INFINITY", "epsilon": "AHRS_REAL_EPSILON"}
_ARITHMETIC: dict[type[ast.operator], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", operator.add),
    ast.Sub: ("-", operator.sub),
    ast.Mult: ("*", operator.mul),
    ast.Div: ("/", operator.truediv),
}
_COMPARISONS: dict[type[ast.cmpop], tuple[str, Callable[[Any, Any], bool]]] = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
}


class Rule:
    """A parsed rule.

    Parameters
    ----------
    text : str
        The expression as the descriptor has it.

    Raises
    ------
    DescriptorError
        If the text is not an expression of the language.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            self._tree = ast.parse(text, mode="eval").body
        except SyntaxError as error:
            raise DescriptorError(f"rule '{text}' is not an expression: {error.msg}") from error

    @property
    def names(self) -> list[str]:
        """Every name in the rule, in order of first appearance, without ``inf`` and ``epsilon``."""
        found = [node.id for node in ast.walk(self._tree) if isinstance(node, ast.Name)]
        return [name for name in dict.fromkeys(found) if name not in _CONSTANTS]

    def holds(
        self, values: Mapping[str, Value], items: Mapping[str, int], epsilon: float = sys.float_info.epsilon
    ) -> bool:
        """Evaluate with parameter `values`, the numbers of enumeration `items` and a relative rounding."""
        scope = {**items, **values, "inf": float("inf"), "epsilon": epsilon}
        return bool(self._evaluate(self._tree, scope))

    def to_c(self, parameter: Callable[[str], str], items: Mapping[str, str]) -> str:
        """Translate to a C expression.

        Parameters
        ----------
        parameter : callable
            Gives the C expression of a parameter's name.
        items : mapping
            The C constant of each enumeration item.
        """
        return self._translate(self._tree, parameter, items)

    def _refuse(self, node: ast.AST) -> DescriptorError:
        return DescriptorError(f"rule '{self.text}' uses {type(node).__name__}, which rules cannot express")

    def _evaluate(self, node: ast.expr, scope: Mapping[str, Any]) -> Any:
        match node:
            case ast.BoolOp(op=ast.And(), values=values):
                return all(self._evaluate(value, scope) for value in values)
            case ast.BoolOp(values=values):
                return any(self._evaluate(value, scope) for value in values)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return not self._evaluate(operand, scope)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -self._evaluate(operand, scope)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _ARITHMETIC:
                return _ARITHMETIC[type(op)][1](self._evaluate(left, scope), self._evaluate(right, scope))
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
                return _COMPARISONS[type(op)][1](self._evaluate(left, scope), self._evaluate(right, scope))
            case ast.Subscript(value=value, slice=ast.Constant(value=int(index))):
                return self._evaluate(value, scope)[index]
            case ast.Constant(value=int() | float() as number):
                return number
            case ast.Name(id=name) if name in scope:
                return scope[name]
            case _:
                raise self._refuse(node)

    def _translate(self, node: ast.expr, parameter: Callable[[str], str], items: Mapping[str, str]) -> str:
        def go(child: ast.expr) -> str:
            return self._translate(child, parameter, items)

        match node:
            case ast.BoolOp(op=op, values=values):
                return f" {'&&' if isinstance(op, ast.And) else '||'} ".join(
                    f"({go(value)})" for value in values
                )
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"!({go(operand)})"
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"-({go(operand)})"
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _ARITHMETIC:
                return f"({go(left)} {_ARITHMETIC[type(op)][0]} {go(right)})"
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
                return f"{go(left)} {_COMPARISONS[type(op)][0]} {go(right)}"
            case ast.Subscript(value=value, slice=ast.Constant(value=int(index))):
                return f"{go(value)}[{index}]"
            case ast.Constant(value=int() as number):
                return str(number)
            case ast.Constant(value=float() as number):
                return f"AHRS_C({number!r})"
            case ast.Name(id=name) if name in _CONSTANTS:
                return _CONSTANTS[name]
            case ast.Name(id=name):
                return items[name] if name in items else parameter(name)
            case _:
                raise self._refuse(node)
