"""The small errors that mutation testing makes: one a place, chosen so that a survivor means something.

From cosmic-ray: one replacement for each arithmetic and logical operator, comparisons turned round, a condition
negated, `and` for `or`, True for False, a sign dropped. Its numbers go up by one; here numbers from ten on, and
fractions, are doubled instead. Our own: a keyword argument left out, a statement left out, a function for its
counterpart (min for max), `<` for `<=` where something is counted.
Left alone: annotations, `<` for `<=` between real numbers (both are right), and guards against rounding (up to 1e-6).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators import (
    binary_operator_replacement,
    boolean_replacer,
    comparison_operator_replacement,
    number_replacer,
    unary_operator_replacement,
)
from cosmic_ray.operators.operator import Example, Operator
from parso.python import tree

BINARY = (
    "Add_Sub",
    "Sub_Add",
    "Mul_Div",
    "Div_Mul",
    "FloorDiv_Mul",
    "Mod_Mul",
    "Pow_Mul",
    "BitOr_BitAnd",
    "BitAnd_BitOr",
)
TURNED = ("Lt_GtE", "LtE_Gt", "Gt_LtE", "GtE_Lt", "Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is")
ONE_MORE = ("Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt")
COUNTS = ("len(", ".size", ".shape", ".ndim", "count")
COUNTERPARTS = {
    **{
        a: b
        for pair in (
            ("min", "max"),
            ("minimum", "maximum"),
            ("nanmin", "nanmax"),
            ("argmin", "argmax"),
            ("any", "all"),
            ("sin", "cos"),
            ("floor", "ceil"),
            ("sum", "mean"),
            ("logical_and", "logical_or"),
        )
        for a, b in (pair, pair[::-1])
    },
    "median": "mean",
    "sqrt": "square",
    "abs": "negative",
}
UNSEEN_KEYWORDS = {"strict", "dtype", "copy", "check_finite", "full_matrices", "stacklevel", "optimize", "overwrite_a"}


class Mutant(NamedTuple):
    module: Path
    line: int
    operator: str
    occurrence: int


class ReplaceNumber(number_replacer.NumberReplacer):
    """A small whole number goes up by one, any other is doubled; what guards against rounding stays."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        if isinstance(node, tree.Number) and not 0 < abs(eval(node.value)) <= 1e-6:
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        value = eval(node.value)
        changed = value + 1 if value == int(value.real) and abs(value) < 10 else 2 * value
        return tree.Number(f"{changed}", node.start_pos, node.prefix)


class OneMore(Operator):
    """`<` for `<=` and back, where something is counted."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        if node.type == "comparison" and any(word in node.get_code() for word in COUNTS):
            for operator in node.children[1::2]:
                if operator.get_code().strip() in ("<", "<=", ">", ">="):
                    yield operator.start_pos, operator.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        operators = [c for c in node.children[1::2] if c.get_code().strip() in ("<", "<=", ">", ">=")]
        operators[index].value = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}[operators[index].value]
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        return (Example("len(x) < 2", "len(x) <= 2"),)


class Counterpart(Operator):
    """A function or method for its counterpart."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        called = isinstance(node, tree.Name) and node.value in COUNTERPARTS and node.get_next_leaf().value == "("
        if called and node.parent.type in ("trailer", "atom_expr", "power"):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        node.value = COUNTERPARTS[node.value]
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        return (Example("np.min(x)", "np.max(x)"),)


class DropKeyword(Operator):
    """A keyword argument left out of a call."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        if node.type == "argument" and _keyword(node):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        node.children = [tree.Operator("**", node.start_pos, " "), tree.Name("{}", node.start_pos)]
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        return (Example("f(x, axis=1)", "f(x, **{})"),)


class DropStatement(Operator):
    """A statement left out that changes something: x[i] = y, x += y, a call, a raise."""

    def mutation_positions(self, node: Any) -> Iterator[Any]:
        if node.type != "simple_stmt":
            return
        statement = node.children[0]
        changes = statement.type in ("raise_stmt",) or (
            statement.type == "atom_expr" and ")" in statement.get_code()[-1:]
        )
        if statement.type == "expr_stmt":
            operator = statement.children[1].get_code().strip()
            changes = (operator == "=" and statement.children[0].get_code().rstrip().endswith("]")) or (
                len(operator) > 1 and operator.endswith("=") and operator[0] in "+-*/|&@%"
            )
        if changes:
            yield statement.start_pos, statement.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        statement = node.children[0]
        node.children[0] = tree.Name("pass", statement.start_pos, statement.get_first_leaf().prefix)
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        return (Example("x[0] = 1", "pass"),)


def _operators() -> dict[str, Operator]:
    ours = (ReplaceNumber, OneMore, Counterpart, DropKeyword, DropStatement)
    binary = [getattr(binary_operator_replacement, f"ReplaceBinaryOperator_{name}") for name in BINARY]
    turned = [getattr(comparison_operator_replacement, f"ReplaceComparisonOperator_{name}") for name in TURNED]
    logic = [
        boolean_replacer.ReplaceTrueWithFalse,
        boolean_replacer.ReplaceFalseWithTrue,
        boolean_replacer.ReplaceAndWithOr,
        boolean_replacer.ReplaceOrWithAnd,
        boolean_replacer.AddNot,
    ]
    unary = [
        o
        for o in unary_operator_replacement.operators()
        if o.__name__.endswith(("_USub_UAdd", "_Delete_Not", "_Delete_Invert"))
    ]
    return {o.__name__: o() for o in [*ours, *binary, *turned, *logic, *unary]}


OPERATORS = _operators()


def mutants(module: Path) -> list[Mutant]:
    """Every mutant of a module, in the order of its lines."""
    nodes = list(ast_nodes(get_ast(module.read_text())))
    made = []
    for name, operator in OPERATORS.items():
        positions = ((node, line) for node in nodes for (line, _), _ in operator.mutation_positions(node))
        made += [Mutant(module, line, name, i) for i, (node, line) in enumerate(positions) if _computes(node)]
    return sorted(made)


def text_of(mutant: Mutant) -> str:
    return str(mutate_code(mutant.module.read_text(), OPERATORS[mutant.operator], mutant.occurrence))


def change(mutant: Mutant) -> tuple[str, str]:
    """The line before and after."""
    lines = zip(mutant.module.read_text().splitlines(), text_of(mutant).splitlines(), strict=False)
    return next(((a.strip(), b.strip()) for a, b in lines if a != b), ("", ""))


def _keyword(argument: Any) -> str:
    """The name of a keyword argument; empty for any other."""
    first, *rest = argument.children
    return str(first.value) if rest and rest[0].get_code().strip() == "=" else ""


def _computes(node: Any) -> bool:
    """Whether a node is neither in an annotation, nor a star among parameters, nor a keyword that no result shows."""
    if node.parent is not None and node.parent.type in ("param", "parameters"):
        return not isinstance(node, tree.Operator)
    while node.parent is not None:
        above = node.parent
        if node.type == "argument" and _keyword(node) in UNSEEN_KEYWORDS:
            return False
        if above.type in ("annassign", "tfpdef") and node is above.children[1]:
            return False
        if (above.type == "tfpdef" and node is above.children[-1]) or (
            above.type == "funcdef" and node is above.annotation
        ):
            return False
        node = above
    return True
