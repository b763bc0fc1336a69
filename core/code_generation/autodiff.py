"""Automatic differentiation of laws: forward mode by source transformation (Griewank and Walther 2008, section 3.1).

The source of a law is differentiated line by line into its tangent: every local name gets another one for its rate of
change along each of a few directions. The directions share the values, which cost most where a law takes powers. Names
that cannot change get none, so that nothing is computed for them.
"""

import ast
import builtins
import inspect
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
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
        math.asinh: ("1.0 / math.sqrt(1.0 + {0} * {0})",),
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
    """Source of an expression and of its rates of change."""

    value: str
    changes: tuple[str, ...] = ()
    """Along each direction; empty if the expression does not change."""


@dataclass(slots=True)
class Tangent:
    """A tangent function while it is written."""

    law: Callable[..., Any]
    changing: set[str]
    """Names that change along the directions."""
    directions: int = 1
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

    def changes_of(self, name: str) -> tuple[str, ...]:
        """Names of a name's rates of change."""
        return tuple(change_of(name, direction) for direction in range(self.directions))

    def store(self, name: str, value: Changing) -> None:
        """Assign a value and its rates of change to a name."""
        self.write(f"{name} = {value.value}")
        for own, change in zip(self.changes_of(name), value.changes or ("0.0",) * self.directions, strict=True):
            self.write(f"{own} = {change}")

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


def tangent_source(law: Callable[..., Any], name: str, changing: Collection[str], directions: int = 1) -> str:
    """Source of a function that returns a tuple of a law's results, and one of their rates of change per direction.

    Args:
        law: a plain `def` of floats: assignments, `if`, and expressions of + - * / **, comparisons, conditions and the
            functions of PARTIAL_DERIVATIVES.
        name: of the generated function.
        changing: the law's arguments that change. Their rates of change along each direction follow the law's own
            arguments, in the same order.
        directions: how many there are.

    Raises:
        ModelError: a line of the law cannot be differentiated; the message names it.
    """
    definition = _definition(law)
    arguments = [argument.arg for argument in definition.args.args]
    tangent = Tangent(law, {argument for argument in arguments if argument in changing}, directions)
    rates = [change_of(one, number) for number in range(directions) for one in arguments if one in changing]
    _block(tangent, definition.body)
    return "\n".join([f"def {name}({', '.join([*arguments, *rates])}):", *tangent.lines])


def change_of(name: str, direction: int) -> str:
    """Name of the rate of change of a name along a direction."""
    return f"change_of_{name}_{direction}"


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
            kept = [
                Changing(_copy(tangent, f.value), tuple(_copy(tangent, one) for one in f.changes)) for f in tangents
            ]
            for one, change in zip(names, kept, strict=True):
                _store(tangent, ast.unparse(one), change)
        case _:
            tangent.refuse(target, "assign to a name, or to as many names as there are values")


def _copy(tangent: Tangent, source: str) -> str:
    return tangent.part(f"({source})")


def _store(tangent: Tangent, name: str, value: Changing) -> None:
    changes = tuple(tangent.part(one) for one in value.changes)  # may need the name's old value
    tangent.store(name, Changing(value.value, changes))
    (tangent.changing.add if changes else tangent.changing.discard)(name)


def _return(tangent: Tangent, value: ast.expr) -> None:
    results = [expression(tangent, one) for one in (value.elts if isinstance(value, ast.Tuple) else [value])]
    unchanged = ("0.0",) * tangent.directions
    each = ([one.value for one in results], *zip(*(one.changes or unchanged for one in results), strict=True))
    tangent.write(f"return {', '.join(as_tuple(one) for one in each)}")


def as_tuple(sources: Iterable[str]) -> str:
    """Source of a tuple of these expressions."""
    return f"({', '.join(sources)},)"


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
            return Changing(name, tangent.changes_of(name))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            inner = expression(tangent, operand)
            return Changing(f"(-{inner.value})", _negative(inner.changes))
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


def _total(*terms: tuple[str, Sequence[str]]) -> tuple[str, ...]:
    """Sum of the products of partial derivatives and rates of change, along each direction."""
    return _added(*([f"{partial} * {change}" for change in changes] for partial, changes in terms))


def _added(*terms: Sequence[str]) -> tuple[str, ...]:
    """Sum of rates of change, along each direction; terms that do not change are empty."""
    return tuple(f"({' + '.join(one)})" for one in zip(*filter(None, terms), strict=True))


def _negative(changes: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"(-{change})" for change in changes)


def _sum(_: Tangent, a: Changing, b: Changing) -> Changing:
    return Changing(f"({a.value} + {b.value})", _added(a.changes, b.changes))


def _difference(_: Tangent, a: Changing, b: Changing) -> Changing:
    return Changing(f"({a.value} - {b.value})", _added(a.changes, _negative(b.changes)))


def _product(tangent: Tangent, a: Changing, b: Changing) -> Changing:
    left = tangent.part(a.value) if b.changes else a.value
    right = tangent.part(b.value) if a.changes else b.value
    return Changing(f"({left} * {right})", _total((right, a.changes), (left, b.changes)))


def _quotient(tangent: Tangent, a: Changing, b: Changing) -> Changing:
    below = tangent.part(b.value)
    ratio = tangent.part(f"{a.value} / {below}") if b.changes else f"({a.value} / {below})"
    return Changing(ratio, _total((f"(1.0 / {below})", a.changes), (f"(-{ratio} / {below})", b.changes)))


def _power(tangent: Tangent, a: Changing, b: Changing) -> Changing:
    base, literal = tangent.part(a.value), b.value
    if not b.changes and literal.isdigit() and int(literal):
        return Changing(f"{base} ** {literal}", _total((f"{literal} * {base} ** {int(literal) - 1}", a.changes)))
    return _partials(tangent, math.pow, [Changing(base, a.changes), b], "math.pow")


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
    return Changing(value, _total(*zip(partials, (one.changes for one in given), strict=True)))


def _choice(tangent: Tangent, node: ast.IfExp) -> Changing:
    tangent.parts += 1
    value = f"part_{tangent.parts}"
    for head, branch in ((f"if {_test(tangent, node.test)}:", node.body), ("else:", node.orelse)):
        with tangent.block(head):
            tangent.store(value, expression(tangent, branch))
    return Changing(value, tangent.changes_of(value))


def _test(tangent: Tangent, test: ast.expr) -> str:
    """Source of a condition. An equality counts only if it persists along all directions."""
    match test:
        case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq() as op], comparators=[right]) if _changes(tangent, test):
            apart = _difference(tangent, expression(tangent, left), expression(tangent, right)).changes
            joined, compared = ("and", "==") if isinstance(op, ast.Eq) else ("or", "!=")
            return f" {joined} ".join([f"({ast.unparse(test)})", *(f"{one} {compared} 0.0" for one in apart)])
    return ast.unparse(test)
