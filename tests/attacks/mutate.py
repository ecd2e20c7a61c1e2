"""Change the program at random places, one at a time, and see whether the tests notice.

    python tests/attacks/mutate.py [--count 100] [--seed 1] [--only catalogue/refine] [--minutes 60] [--write]

A mutant is a copy of the checkout in which one operator, number or function has become another one: ``<`` is ``>=``, a
number is a quarter larger, ``min`` is ``max``.  Of the fast part of the tests first those files run that name its
module; for all mutants that are left then the tests of their rooms, and then all others.  A mutant is killed as soon as
one test fails, or if they take ten times as long as they may.  Those left are listed: each is equivalent, or a test is
missing.  After `--minutes` nothing more is begun.  `--write`: the report goes to ``data/reports/mutations.md`` too.
"""

from __future__ import annotations

import ast
import contextlib
import io
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "benchmarks"))
from measuring import arguments, table, title  # noqa: E402  # beside the benchmarks

#: What becomes of an operator, by the name of its class: its sign, and another one.
OPERATORS = {
    "Add": ("+", "-"), "Sub": ("-", "+"), "Mult": ("*", "/"), "Div": ("/", "*"), "Pow": ("**", "*"),
    "Lt": ("<", ">="), "LtE": ("<=", ">"), "Gt": (">", "<="), "GtE": (">=", "<"), "Eq": ("==", "!="),
    "NotEq": ("!=", "=="), "Is": ("is", "is not"), "IsNot": ("is not", "is"), "In": ("in", "not in"),
    "NotIn": ("not in", "in"), "And": ("and", "or"), "Or": ("or", "and"), "BitAnd": ("&", "|"), "BitOr": ("|", "&"),
}  # fmt: skip
#: What becomes of a function or an attribute.
NAMES = {
    "min": "max", "minimum": "maximum", "argmin": "argmax", "all": "any", "sin": "cos", "real": "imag", "floor": "ceil",
}  # fmt: skip
NAMES |= {other: name for name, other in NAMES.items()}
#: Seconds after which tests that have not ended count as failed.
PATIENCE = 1200
#: Which tests run, one stage after the other for all mutants that are left.
STAGES = ("module", "room", "all")


@dataclass(frozen=True)
class Mutation:
    """Characters `start` to `end` of a file that become `text`."""

    path: str
    line: int
    start: int
    end: int
    before: str
    text: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line} `{self.before}` → `{self.text}`"


def mutations(path: str, source: str) -> Iterator[Mutation]:
    """Return all mutations of a file."""
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    tree = ast.parse(source)
    skipped = {id(inner) for node in ast.walk(tree) for part in _unread(node) for inner in ast.walk(part)}

    def offset(line: int, column: int) -> int:
        return len(source.encode()[: starts[line - 1] + column].decode())

    def begin(node: ast.expr) -> int:
        return offset(node.lineno, node.col_offset)

    def end(node: ast.expr) -> int:
        return offset(node.end_lineno or node.lineno, node.end_col_offset or 0)

    def between(left: ast.expr, right: ast.expr, operator: ast.AST) -> Iterator[Mutation]:
        sign, other = OPERATORS.get(type(operator).__name__, ("", ""))
        found = (
            re.search(rf"(?<![*/<>=!]){re.escape(sign)}(?![*/=])", source[end(left) : begin(right)]) if sign else None
        )
        if found is not None:
            at = end(left) + found.start()
            yield Mutation(path, left.lineno, at, at + len(sign), sign, other)

    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.BinOp):
            yield from between(node.left, node.right, node.op)
        elif isinstance(node, ast.Compare):
            for left, right, operator in zip([node.left, *node.comparators], node.comparators, node.ops, strict=False):
                yield from between(left, right, operator)
        elif isinstance(node, ast.BoolOp):
            for left, right in zip(node.values, node.values[1:], strict=False):
                yield from between(left, right, node.op)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not | ast.Invert):
            sign = "not" if isinstance(node.op, ast.Not) else source[begin(node)]
            yield Mutation(path, node.lineno, begin(node), begin(node) + len(sign), sign, "")
        elif isinstance(node, ast.Constant) and (text := _number(node.value)):
            yield Mutation(path, node.lineno, begin(node), end(node), source[begin(node) : end(node)], text)
        elif isinstance(node, ast.Attribute) and node.attr in NAMES:
            yield Mutation(path, node.lineno, end(node) - len(node.attr), end(node), node.attr, NAMES[node.attr])
        elif isinstance(node, ast.Name) and node.id in NAMES:
            yield Mutation(path, node.lineno, begin(node), end(node), node.id, NAMES[node.id])


def _number(value: object) -> str:
    """Return what a number becomes, nothing of what is none."""
    if isinstance(value, float):
        return repr(1.25 * value or 0.25)
    return str(value + 1) if isinstance(value, int) and not isinstance(value, bool) else ""


def _unread(node: ast.AST) -> Iterator[ast.AST]:
    """Return what is beneath a node and never computed: annotations, and imports for them alone."""
    for name in ("annotation", "returns"):
        part = getattr(node, name, None)
        if isinstance(part, ast.AST):
            yield part
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        yield node


def stages(copy: Path, mutation: Mutation) -> dict[str, list[str]]:
    """Return which tests are to notice a mutation, in each stage those that were in none before."""
    path = Path(mutation.path)
    module = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
    names = re.compile(rf"{re.escape(module)}\b|from {re.escape(module.rpartition('.')[0])} import .*\b{path.stem}\b")
    tests = [file for file in sorted((copy / "tests").rglob("test_*.py")) if "dropin" not in file.parts]
    room = copy / "tests" / path.parts[1].removesuffix(".py")
    if path.parts[0] == "plugins":
        room = copy / "tests" / ("spatial_guidance" if "spatial" in mutation.path else "plugins")
    naming = [file for file in tests if names.search(file.read_text("utf-8"))]
    naming.sort(key=lambda file: (path.stem not in file.stem, room not in file.parents))
    own = [file for file in tests if room in file.parents and file not in naming]
    rest = [file for file in tests if file not in naming and file not in own]
    return {name: [str(file) for file in files] for name, files in zip(STAGES, (naming, own, rest), strict=True)}


def noticed(copy: Path, mutation: Mutation, files: list[str]) -> bool:
    """Return whether tests notice a mutation."""
    path = copy / mutation.path
    source = path.read_text("utf-8")
    path.write_text(source[: mutation.start] + mutation.text + source[mutation.end :], "utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "not slow", *files]
    environment = os.environ | {"PYTHONPATH": str(copy)}
    try:
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, timeout=PATIENCE)
        return done.returncode not in (0, 5)
    except subprocess.TimeoutExpired:
        return True
    finally:
        path.write_text(source, "utf-8")


def main() -> None:
    parser = arguments()
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(copy)], check=True)
        every = [
            mutation
            for part in ("catalogue", "plugins")
            for file in sorted((copy / part).rglob("*.py"))
            for mutation in mutations(file.relative_to(copy).as_posix(), file.read_text("utf-8"))
            if mutation.path.startswith(asked.only)
        ]
        chosen = random.Random(asked.seed).sample(every, min(asked.count, len(every)))
        alive, begun = dict(enumerate(chosen, 1)), time.perf_counter()
        tried, dead = dict.fromkeys(STAGES, 0), dict.fromkeys(STAGES, 0)
        for stage in STAGES:
            for number, mutation in list(alive.items()):
                start = time.perf_counter()
                if start - begun > 60 * asked.minutes:
                    break
                tried[stage] += 1
                files = stages(copy, mutation)[stage]
                if killed := bool(files) and noticed(copy, mutation, files):
                    dead[stage] += 1
                    del alive[number]
                told, taken = "killed" if killed else "lives", time.perf_counter() - start
                print(f"{number:4d} {stage:6s} {told} {taken:6.0f} s  {mutation}", file=sys.stderr, flush=True)
    names = ("that name the module", "of its room", "all others")
    rows = [[name, tried[k], dead[k], tried[k] - dead[k]] for name, k in zip(names, STAGES, strict=True)]
    with contextlib.redirect_stdout(io.StringIO()) as report:
        title("Mutations")
        print(f"{len(chosen)} of {len(every)} places.\n")
        table(["tests, of the fast part", "mutants tried", "killed", "left"], rows)
        print("Left:\n\n" + "\n".join(f"- {number}: {mutation}" for number, mutation in alive.items()))
    print(report.getvalue())
    if asked.write:
        (ROOT / "data" / "reports" / "mutations.md").write_text(report.getvalue(), "utf-8")


if __name__ == "__main__":
    main()
