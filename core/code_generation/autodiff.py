"""Automatic differentiation of laws: forward mode by source transformation (Griewank and Walther 2008, section 3.1).

The source of a law is differentiated line by line into its tangent: every local name gets a second one for its rate of
change along one direction. Names that cannot change get none, so that nothing is computed for them.
"""

import ast
import builtins
import inspect
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import reduce
from pathlib import Path
from textwrap import dedent
from types import MappingProxyType
from typing import Any, NoReturn

from core.errors import ModelError

PARTIAL_DERIVATIVES: Mapping[Callable[..., Any], tuple[str, ...]] = MappingProxyType(
    {
        abs: ("math.copysign(1.0, {0})",),
        math.fabs: ("math.copysign(1.0, {0})",),
        math.exp: ("{y}",),
        math.expm1: ("({y} + 1.0)",),
        math.log: ("1.0 / {0}",),
        math.log1p: ("1.0 / (1.0 + {0})",),
        math.sqrt: ("(0.5 / {y} if {y} else 0.0)",),
        math.sin: ("math.cos({0})",),
        math.cos: ("-math.sin({0})",),
        math.tan: ("(1.0 + {y} * {y})",),
        math.atan: ("1.0 / (1.0 + {0} * {0})",),
        math.sinh: ("math.cosh({0})",),
        math.cosh: ("math.sinh({0})",),
        math.tanh: ("(1.0 - {y} * {y})",),
        math.copysign: ("math.copysign(1.0, {0}) * math.copysign(1.0, {1})", "0.0"),
        math.hypot: ("({0} / {y} if {y} else 0.0)", "({1} / {y} if {y} else 0.0)"),
        math.pow: (
            "({1} * {y} / {0} if {0} else (1.0 if {1} == 1.0 else 0.0))",
            "({y} * math.log({0}) if {0} > 0.0 else 0.0)",
        ),
        min: ("(1.0 if {0} <= {1} else 0.0)", "(0.0 if {0} <= {1} else 1.0)"),
        max: ("(1.0 if {0} >= {1} else 0.0)", "(0.0 if {0} >= {1} else 1.0)"),
    }
)
"""Partial derivatives of the functions that a law may call, as source in the arguments {0} and {1} and the value {y}.

Where a function has no derivative (the square root at zero), it is zero: a law at rest there stays at rest."""
RESERVED = ("change_of_", "part_")
"""Prefixes of the names that are added to those of a law."""
ATOM = re.compile(r"\w+|\d+\.\d*")
"""A name or a number."""
ALLOWED = f"+ - * / ** and {', '.join(sorted(function.__name__ for function in PARTIAL_DERIVATIVES))} of module math"
"""Operations and functions that can be differentiated, for messages."""


@dataclass(frozen=True, slots=True)
class Changing:
    """Source of an expression and of its rate of change."""

    value: str
    change: str | None = None
    """None if the expression does not change."""


@dataclass(slots=True)
class Tangent:
    """A tangent function while it is written."""

    law: Callable[..., Any]
    changing: set[str]
    """Names that change along the direction."""
    lines: list[str] = field(default_factory=list)
    depth: int = 1
    parts: int = 0

    def write(self, line: str) -> None:
        """Append a line, indented as its block."""
        self.lines.append("    " * self.depth + line)

    def part(self, source: str) -> str:
        """Name of an expression that is used more than once."""
        if ATOM.fullmatch(source):
            return source
        self.parts += 1
        self.write(f"part_{self.parts} = {source}")
        return f"part_{self.parts}"

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Indent the lines below a head."""
        self.write(head)
        self.depth += 1
        yield
        self.depth -= 1

    def refuse(self, node: ast.AST, why: str) -> NoReturn:
        """Raise the error that names the line which cannot be differentiated."""
        code = self.law.__code__
        line = code.co_firstlineno + getattr(node, "lineno", 1) - 1
        raise ModelError(f"{Path(code.co_filename).name}, line {line}: `{ast.unparse(node)}`: {why}")


def tangent_source(law: Callable[..., Any], name: str, changing: Collection[str]) -> str:
    """Source of a function that returns a law's results and their rates of change.

    Args:
        law: a plain `def` of floats: assignments, `if`, and expressions of + - * / **, comparisons, conditions and the
            functions of PARTIAL_DERIVATIVES.
        name: of the generated function.
        changing: the law's arguments that change. Their rates of change follow the law's own arguments, in the same
            order.

    Raises:
        ModelError: a line of the law cannot be differentiated; the message names it.
    """
    definition = _definition(law)
    arguments = [argument.arg for argument in definition.args.args]
    tangent = Tangent(law, {argument for argument in arguments if argument in changing})
    rates = [change_of(argument) for argument in arguments if argument in changing]
    _block(tangent, definition.body)
    return "\n".join([f"def {name}({', '.join([*arguments, *rates])}):", *tangent.lines])


def change_of(name: str) -> str:
    """Name of the rate of change of a name."""
    return f"change_of_{name}"


def _definition(law: Callable[..., Any]) -> ast.FunctionDef:
    try:
        source = dedent(inspect.getsource(law))
        definition = ast.parse(source).body[0]
    except (OSError, TypeError, SyntaxError) as error:
        raise ModelError(f"the source of the law {law!r} cannot be read; write it as a `def` in a file") from error
    if not isinstance(definition, ast.FunctionDef):
        raise ModelError(f"the law `{source.strip()}` is no `def`; write it as one, in a file of its own")
    for node in ast.walk(definition):
        name = node.arg if isinstance(node, ast.arg) else node.id if isinstance(node, ast.Name) else ""
        if name.startswith(RESERVED):
            Tangent(law, set()).refuse(node, f"names that begin with {' or '.join(RESERVED)} are reserved")
    return definition


def _block(tangent: Tangent, statements: list[ast.stmt]) -> None:
    for statement in statements:
        match statement:
            case ast.Expr(value=ast.Constant()) | ast.Pass():  # a docstring
                tangent.write("pass")
            case ast.Assign(targets=[target], value=value):
                _assign(tangent, target, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                _assign(tangent, target, value)
            case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
                sum_ = ast.copy_location(ast.BinOp(ast.Name(name, ast.Load()), op, value), statement)
                _assign(tangent, target, ast.fix_missing_locations(sum_))
            case ast.Return(value=ast.expr() as value):
                _return(tangent, value)
            case ast.If():
                _if(tangent, statement)
            case _:
                tangent.refuse(statement, "a law may contain assignments, `if` and `return` only")


def _assign(tangent: Tangent, target: ast.expr, value: ast.expr) -> None:
    match target, value:
        case ast.Name(id=name), _:
            _store(tangent, name, expression(tangent, value))
        case ast.Tuple(elts=names), ast.Tuple(elts=values) if len(names) == len(values):
            if not all(isinstance(one, ast.Name) for one in names):
                tangent.refuse(target, "assign to names only")
            tangents = [expression(tangent, one) for one in values]
            kept = [Changing(_copy(tangent, f.value), f.change and _copy(tangent, f.change)) for f in tangents]
            for one, change in zip(names, kept, strict=True):
                _store(tangent, ast.unparse(one), change)
        case _:
            tangent.refuse(target, "assign to a name, or to as many names as there are values")


def _copy(tangent: Tangent, source: str) -> str:
    return tangent.part(f"({source})")


def _store(tangent: Tangent, name: str, value: Changing) -> None:
    change = value.change and tangent.part(value.change)  # may need the name's old value
    tangent.write(f"{name} = {value.value}")
    tangent.write(f"{change_of(name)} = {change or 0.0}")
    (tangent.changing.add if change else tangent.changing.discard)(name)


def _return(tangent: Tangent, value: ast.expr) -> None:
    results = [expression(tangent, one) for one in (value.elts if isinstance(value, ast.Tuple) else [value])]
    tangent.write(f"return {', '.join([*(r.value for r in results), *(r.change or '0.0' for r in results)])}")


def _if(tangent: Tangent, statement: ast.If) -> None:
    before = set(tangent.changing)
    with tangent.block(f"if {_test(tangent, statement.test)}:"):
        _block(tangent, statement.body)
    after, tangent.changing = tangent.changing, before
    if statement.orelse:
        with tangent.block("else:"):
            _block(tangent, statement.orelse)
    tangent.changing |= after


def _changes(tangent: Tangent, node: ast.AST) -> bool:
    return any(isinstance(part, ast.Name) and part.id in tangent.changing for part in ast.walk(node))


def expression(tangent: Tangent, node: ast.expr) -> Changing:
    """Value and rate of change of an expression; the lines that they need are written first."""
    if not _changes(tangent, node) or isinstance(node, ast.Compare | ast.BoolOp):
        return Changing(_enclosed(ast.unparse(node)))
    match node:
        case ast.Name(id=name):
            return Changing(name, change_of(name))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            inner = expression(tangent, operand)
            return Changing(f"(-{inner.value})", f"(-{inner.change})")
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return expression(tangent, operand)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
            return ARITHMETIC[type(op)](tangent, expression(tangent, left), expression(tangent, right))
        case ast.IfExp():
            return _choice(tangent, node)
        case ast.Call(func=func, args=arguments, keywords=[]):
            return _call(tangent, func, arguments)
    return tangent.refuse(node, f"cannot be differentiated; {ALLOWED} can")


def _enclosed(source: str) -> str:
    return source if ATOM.fullmatch(source) else f"({source})"


def _total(*terms: tuple[str, str | None]) -> str | None:
    """Sum of the products of partial derivatives and rates of change."""
    products = [f"{partial} * {change}" for partial, change in terms if change is not None]
    return f"({' + '.join(products)})" if products else None


def _sum(_: Tangent, a: Changing, b: Changing) -> Changing:
    changes = [change for change in (a.change, b.change) if change]
    return Changing(f"({a.value} + {b.value})", f"({' + '.join(changes)})")


def _difference(tangent: Tangent, a: Changing, b: Changing) -> Changing:
    negative = Changing(b.value, b.change and f"(-{b.change})")
    return Changing(f"({a.value} - {b.value})", _sum(tangent, a, negative).change)


def _product(tangent: Tangent, a: Changing, b: Changing) -> Changing:
    left = tangent.part(a.value) if b.change else a.value
    right = tangent.part(b.value) if a.change else b.value
    return Changing(f"({left} * {right})", _total((right, a.change), (left, b.change)))


def _quotient(tangent: Tangent, a: Changing, b: Changing) -> Changing:
    below = tangent.part(b.value)
    ratio = tangent.part(f"{a.value} / {below}") if b.change else f"({a.value} / {below})"
    return Changing(ratio, _total((f"(1.0 / {below})", a.change), (f"(-{ratio} / {below})", b.change)))


def _power(tangent: Tangent, a: Changing, b: Changing) -> Changing:
    base, literal = tangent.part(a.value), b.value
    if b.change is None and literal.isdigit() and int(literal):
        return Changing(f"{base} ** {literal}", _total((f"{literal} * {base} ** {int(literal) - 1}", a.change)))
    return _partials(tangent, math.pow, [Changing(base, a.change), b], "math.pow")


ARITHMETIC: dict[type[ast.operator], Callable[[Tangent, Changing, Changing], Changing]] = {
    ast.Add: _sum,
    ast.Sub: _difference,
    ast.Mult: _product,
    ast.Div: _quotient,
    ast.Pow: _power,
}
"""Derivatives of the arithmetic operators."""


def _call(tangent: Tangent, name: ast.expr, arguments: list[ast.expr]) -> Changing:
    """Call of a function of PARTIAL_DERIVATIVES, looked up in the law's own namespace."""
    known = {**vars(builtins), **tangent.law.__globals__}
    function = known.get(name.id) if isinstance(name, ast.Name) else None
    if isinstance(name, ast.Attribute) and isinstance(name.value, ast.Name):
        function = getattr(known.get(name.value.id), name.attr, None)
    if function is None or function not in PARTIAL_DERIVATIVES:
        tangent.refuse(name, f"cannot be differentiated; {ALLOWED} can")
    given = [expression(tangent, argument) for argument in arguments]
    if function in (min, max):
        return reduce(lambda a, b: _partials(tangent, function, [a, b], ast.unparse(name)), given)
    return _partials(tangent, function, given, ast.unparse(name))


def _partials(tangent: Tangent, function: Callable[..., Any], given: list[Changing], name: str) -> Changing:
    """Chain rule for one call."""
    arguments = [tangent.part(one.value) for one in given]
    value = tangent.part(f"{name}({', '.join(arguments)})")
    partials = [partial.format(*arguments, y=value) for partial in PARTIAL_DERIVATIVES[function]]
    return Changing(value, _total(*zip(partials, (one.change for one in given), strict=True)))


def _choice(tangent: Tangent, node: ast.IfExp) -> Changing:
    tangent.parts += 1
    value, change = f"part_{tangent.parts}", f"change_of_part_{tangent.parts}"
    for head, branch in ((f"if {_test(tangent, node.test)}:", node.body), ("else:", node.orelse)):
        with tangent.block(head):
            derivative = expression(tangent, branch)
            tangent.write(f"{value} = {derivative.value}")
            tangent.write(f"{change} = {derivative.change or 0.0}")
    return Changing(value, change)


def _test(tangent: Tangent, test: ast.expr) -> str:
    """Source of a condition. An equality counts only if it persists along the direction."""
    match test:
        case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq() as op], comparators=[right]) if _changes(tangent, test):
            apart = _difference(tangent, expression(tangent, left), expression(tangent, right)).change
            lasting = f"and {apart} == 0.0" if isinstance(op, ast.Eq) else f"or {apart} != 0.0"
            return f"({ast.unparse(test)}) {lasting}"
    return ast.unparse(test)
