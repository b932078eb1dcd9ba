"""Choices whose derivatives are those of the branch that is taken.

The derivative of ``wp.where(r < 1.0, wp.sqrt(1.0 - r), 0.0)`` at r = 1.5 is 0 times that of a root
that there is not, which is no number. Laws have what a branch reads pass through :func:`taken` or
:func:`passed`, whose derivatives select: nothing of the branch that is not taken comes through, and
loops vectorise, as ``wp.where`` itself selects. What is computed beforehand by what has such
derivatives selects what it reads if it is for one branch only, and else is computed within each.
"""

# ruff: noqa: F811, the functions are overloaded

import ast
from collections import Counter
from collections.abc import Callable
from typing import Any

import warp as wp

# What has a derivative everywhere, as sums and products do.
TAME = frozenset(
    "abs ceil clamp cos cross dot float float32 float64 floor int max min round sign sin tanh "
    "vec2 vec3 vec4 where".split()
)


@wp.func
def taken(condition: bool, x: Any):
    return x


@wp.func
def taken(condition: bool, x: wp.float32):
    return wp.where(condition, x, wp.float32(0.0))


@wp.func
def taken(condition: bool, x: wp.float64):
    return wp.where(condition, x, wp.float64(0.0))


@wp.func
def taken(condition: bool, x: wp.vec3f):
    return wp.where(condition, x, wp.vec3f())


@wp.func
def taken(condition: bool, x: wp.vec3d):
    return wp.where(condition, x, wp.vec3d())


@wp.func
def passed(condition: bool, x: Any):
    return taken(not condition, x)


def derivable(tree: ast.Module, is_where: Callable[[ast.AST], bool]) -> ast.Module:
    """The syntax of a function, its choices by ``wp.where`` and ``x if c else y`` made so.

    ``is_where`` tells whether a called name is ``wp.where``.
    """
    (definition,) = tree.body
    if not isinstance(definition, ast.FunctionDef):
        return tree
    choices = _Choices(definition, is_where)
    definition = choices.visit(definition)
    for statement in definition.body:
        if _assigned(statement) in choices.kept:
            statement.value = choices.fixed[_assigned(statement)]
    # Backwards: what was moved may have been all that read what was moved before it. Statements
    # stay as many as they were, for errors to be found again.
    for k in reversed(range(len(definition.body))):
        name = _assigned(definition.body[k])
        if name in choices.moved and name not in _read(definition):
            definition.body[k] = ast.Pass()
    return ast.fix_missing_locations(tree)


class _Choices(ast.NodeTransformer):
    def __init__(self, definition: ast.FunctionDef, is_where: Callable[[ast.AST], bool]):
        self.is_where = is_where
        self.moved: set[str] = set()
        self.kept: set[str] = set()  # those of one branch only, which select where they stand
        nodes = list(ast.walk(definition))
        written = Counter(
            node.id for node in nodes if isinstance(node, ast.Name) and not _is_read(node)
        )
        written.update(node.arg for node in nodes if isinstance(node, ast.arg))
        # v[0] = ... changes what is called v.
        written.update(
            each.id for node in nodes
            if isinstance(node, ast.Subscript | ast.Attribute) and not _is_read(node)
            for each in ast.walk(node) if isinstance(each, ast.Name)
        )  # fmt: skip
        self.own, self.written = set(written), written
        self.reads = _reads(definition)
        # What is written once, of what is written once: it is the same wherever it is computed.
        self.fixed: dict[str, ast.expr] = {}
        for statement in definition.body:
            name = _assigned(statement)
            if name and written[name] == 1:
                value = statement.value  # type: ignore[attr-defined]
                names = {node.id for node in ast.walk(value) if isinstance(node, ast.Name)}
                if all(written[each] <= 1 for each in names):
                    self.fixed[name] = value

    def visit_Call(self, node: ast.Call) -> ast.AST:
        reads = [_reads(each) for each in node.args[1:]]
        node = ast.Call(node.func, [self.visit(each) for each in node.args], node.keywords)
        if not self.is_where(node.func) or len(node.args) != 3 or not self._is_bool(node.args[0]):
            return node
        node.args[1:] = self._selected(reads, *node.args)
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:  # Warp makes wp.where of it
        reads = [_reads(each) for each in (node.body, node.orelse)]
        node = ast.IfExp(*(self.visit(each) for each in (node.test, node.body, node.orelse)))
        if self._is_bool(node.test):
            node.body, node.orelse = self._selected(reads, node.test, node.body, node.orelse)
        return node

    def _selected(
        self, reads: list[Counter], condition: ast.expr, *branches: ast.expr
    ) -> list[ast.expr]:
        """Both branches, with what they read selected; ``reads``: how often they read a name."""
        if isinstance(condition, ast.Name) and not self._chooses(self.fixed[condition.id]):
            condition = self.fixed[condition.id]  # known as early as what it reads
        found = []
        names = ("_taken_derived", "_passed_derived")
        for name, branch, count in zip(names, branches, reads, strict=True):
            kept = self._of_branch(condition, count)
            select = _Selected(name, condition, self.own - kept)
            for each in kept:
                self.fixed[each] = select.visit(_copy(self.fixed[each]))
            self.kept |= kept
            inlined = _Inlined(self, kept).visit(_copy(branch))
            found.append(select.visit(inlined) if kept or self.is_wild(inlined) else branch)
        return found

    def _of_branch(self, condition: ast.expr, reads: Counter) -> set[str]:
        """What is computed before for this branch only, if some of it is wild."""
        inside, kept, order = reads.copy(), set[str](), list(self.fixed)
        for k, name in reversed(list(enumerate(order))):
            value = self.fixed[name]
            ready = all(
                each in order[:k] or (each not in self.fixed and self.written[each] <= 1)
                for each in _read(condition)
            )
            if ready and inside[name] == self.reads[name] > 0 and not self._chooses(value):
                kept.add(name)
                inside.update(_reads(value))
        return kept if any(self.is_wild(self.fixed[name]) for name in kept) else set()

    def _chooses(self, node: ast.AST) -> bool:
        return any(
            isinstance(each, ast.IfExp) or (isinstance(each, ast.Call) and self.is_where(each.func))
            for each in ast.walk(node)
        )

    def _is_bool(self, node: ast.expr) -> bool:
        if isinstance(node, ast.Name) and node.id in self.fixed:
            node = self.fixed[node.id]
        negated = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)
        return negated or isinstance(node, ast.Compare | ast.BoolOp)

    def is_wild(self, node: ast.AST) -> bool:
        """Whether it has derivatives that there may not be."""
        for each in ast.walk(node):
            if isinstance(each, ast.BinOp) and isinstance(each.op, ast.Div | ast.Pow):
                return True
            if isinstance(each, ast.Call):
                name = getattr(each.func, "attr", getattr(each.func, "id", ""))
                if name not in TAME and not name.endswith("_derived"):
                    return True
        return False


class _Inlined(ast.NodeTransformer):
    """What a branch reads, computed within it where that is wild, but for what is kept."""

    def __init__(self, choices: _Choices, kept: set[str]):
        self.choices, self.kept = choices, kept

    def visit_Name(self, node: ast.Name) -> ast.AST:
        value = self.choices.fixed.get(node.id)
        if value is None or node.id in self.kept:
            return node
        value = self.visit(self.choices.visit(_copy(value)))
        if not self.choices.is_wild(value):
            return node
        self.choices.moved.add(node.id)
        return value


class _Selected(ast.NodeTransformer):
    """What a branch reads, through a function that selects the derivative."""

    def __init__(self, name: str, condition: ast.expr, own: set[str]):
        self.name, self.condition, self.own = name, condition, own

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id not in self.own:
            return node
        function = ast.Name(self.name, ast.Load())
        return ast.Call(function, [_copy(self.condition), node], [])

    def visit_Call(self, node: ast.Call) -> ast.AST:
        node.args = [self.visit(each) for each in node.args]
        return node


def _read(tree: ast.AST) -> set[str]:
    """The names that are read."""
    return set(_reads(tree))


def _reads(tree: ast.AST) -> Counter:
    """The names that are read, and how often."""
    nodes = ast.walk(tree)
    return Counter(each.id for each in nodes if isinstance(each, ast.Name) and _is_read(each))


def _is_read(node: ast.AST) -> bool:
    return isinstance(getattr(node, "ctx", None), ast.Load)  # type: ignore[attr-defined]


def _assigned(statement: ast.stmt) -> str | None:
    """The name that a plain assignment gives a value."""
    if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
        target = statement.targets[0]
        return target.id if isinstance(target, ast.Name) else None
    return None


def _copy(node: ast.expr) -> ast.expr:
    return ast.parse(ast.unparse(node), mode="eval").body
