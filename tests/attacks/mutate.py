"""Change the program at random places, one at a time, and see whether the tests notice.

    python tests/attacks/mutate.py [--count 100] [--seed 1] [--only catalogue/refine] [--jobs 2] [--write]

A mutant is a copy of the checkout in which one operator, number or function has become another one: ``<`` is ``>=``, a
number is a quarter larger, ``min`` is ``max``.  The fast part of the tests runs once under `coverage <https://coverage.
readthedocs.io>`_ (``pip install coverage``), which says by which tests a place is run; of each mutant those tests run,
the quickest first, until one fails.  What a module does as it is imported is run by all tests that run any of it.
Where no test is seen to run a place (compiled functions, other processes), those run that name its module (of a kernel,
that name `compiled`), and then those of its room.  Mutants that are left are listed: each is equivalent, or a test is
missing, or a slow one notices.  After `--minutes` nothing more is begun.  `--record FOLDER` keeps what the tests run
for the next time.  `--write`: the report goes to ``data/reports/mutations.md`` too.
"""

from __future__ import annotations

import ast
import contextlib
import io
import json
import os
import queue
import random
import re
import subprocess
import sys
import tempfile
import time
from bisect import bisect_right
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

import pytest

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
#: Seconds that tests of one mutant may take, by what they took when they were recorded.
BUDGET = 300.0


@dataclass(frozen=True)
class Mutation:
    """Characters `start` to `end` of a file that become `text`; `lines`: of its statement, outside of functions all."""

    path: str
    line: int
    lines: tuple[int, int]
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
    lines = _lines(tree)

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
            yield Mutation(path, left.lineno, lines[id(left)], at, at + len(sign), sign, other)

    def replaced(node: ast.expr, start: int, stop: int, text: str) -> Mutation:
        return Mutation(path, node.lineno, lines[id(node)], start, stop, source[start:stop], text)

    for node in _computed(tree):
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
            yield replaced(node, begin(node), begin(node) + len(sign), "")
        elif isinstance(node, ast.Constant) and (text := _number(node.value)):
            yield replaced(node, begin(node), end(node), text)
        elif isinstance(node, ast.Attribute | ast.Name):
            name = node.attr if isinstance(node, ast.Attribute) else node.id
            if name in NAMES:
                yield replaced(node, end(node) - len(name), end(node), NAMES[name])


def _number(value: object) -> str:
    """Return what a number becomes, nothing of what is none."""
    if isinstance(value, float):
        return repr(1.25 * value or 0.25)
    return str(value + 1) if isinstance(value, int) and not isinstance(value, bool) else ""


def _computed(node: ast.AST) -> Iterator[ast.AST]:
    """Return a node and all beneath it that is ever computed: no annotations, nor imports for them alone."""
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        return
    yield node
    for name, field in ast.iter_fields(node):
        for part in field if isinstance(field, list) else [field]:
            if isinstance(part, ast.AST) and name not in ("annotation", "returns"):
                yield from _computed(part)


def _lines(tree: ast.AST) -> dict[int, tuple[int, int]]:
    """Return the first and last line of the statement of each expression, of a compound one those of its head; outside
    of functions all lines."""
    found = {id(node): (1, sys.maxsize) for node in ast.walk(tree) if isinstance(node, ast.expr)}
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            for statement in (inner for top in function.body for inner in ast.walk(top) if isinstance(inner, ast.stmt)):
                parts = [part for part in ast.iter_child_nodes(statement) if not isinstance(part, ast.stmt)]
                inner = [node for part in parts for node in ast.walk(part) if isinstance(node, ast.expr)]
                ends = [statement.lineno, *(node.end_lineno or 0 for node in inner)]
                found |= {id(node): (statement.lineno, max(ends)) for node in inner}
    return found


# What the tests run: this module is a plugin of pytest as they are recorded.


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[Any]:
    """Tell coverage which test runs, and the report of the test by which fixtures."""
    item.user_properties.append(("fixtures", getattr(item, "fixturenames", [])))
    _switch(item.nodeid)
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: Any, request: Any) -> Iterator[Any]:
    """Tell coverage which fixture is made that tests share."""
    if fixturedef.scope != "function":
        _switch(fixturedef.argname)
    made = yield
    _switch(request._pyfuncitem.nodeid)
    return made


def _switch(context: str) -> None:
    coverage = pytest.importorskip("coverage").Coverage.current()
    if coverage is not None:
        coverage.switch_context(context)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add what a test takes, and its fixtures, to the file that the environment names."""
    if report.when == "call" and report.passed and "MUTATE_TIMES" in os.environ:
        with Path(os.environ["MUTATE_TIMES"]).open("a", encoding="utf-8") as file:
            row = report.nodeid, report.duration, dict(report.user_properties)["fixtures"]
            file.write(json.dumps(row) + "\n")


class Record:
    """By which of the fast tests the lines of a checkout are run, and what each of these takes.

    Parameters
    ----------
    folder : Path
        Where it is kept: ``lines.db``, by coverage, and ``times.jsonl``.
    """

    def __init__(self, folder: Path) -> None:
        from coverage import CoverageData

        self.lines = CoverageData(str(folder / "lines.db"))
        self.lines.read()
        rows = [json.loads(line) for line in (folder / "times.jsonl").read_text("utf-8").splitlines()]
        self.seconds = {name: seconds for name, seconds, _ in rows}
        self.fixtures = {name: set(fixtures) for name, _, fixtures in rows}

    @staticmethod
    def make(copy: Path, folder: Path) -> None:
        """Run the fast tests of a checkout and write what they run."""
        settings = folder / "settings"
        settings.write_text(
            f"[run]\ndata_file = {folder / 'lines.db'}\nrelative_files = true\nsource = catalogue,plugins\n"
        )
        (folder / "times.jsonl").touch()
        environment = _environment(copy) | {"MUTATE_TIMES": str(folder / "times.jsonl")}
        command = ["coverage", "run", f"--rcfile={settings}", "-m", "pytest", "-p", "mutate", *QUIET]
        subprocess.run([sys.executable, "-m", *command], cwd=copy, env=environment, check=True, stdout=sys.stderr)

    def running(self, mutation: Mutation) -> list[str]:
        """Return the tests that are seen to run a place, themselves or by a fixture."""
        by_line, (first, last) = self.lines.contexts_by_lineno(mutation.path), mutation.lines
        names = {name for line, run in by_line.items() if first <= line <= last for name in run}
        return self._affordable(
            names & self.seconds.keys(), {name for name, fixtures in self.fixtures.items() if fixtures & names} - names
        )

    def beside(self, copy: Path, mutation: Mutation) -> list[str]:
        """Return the tests whose files name the module of a mutation, then the others of its room."""
        path = Path(mutation.path)
        module, within = re.escape(".".join(path.with_suffix("").parts)), re.escape(".".join(path.parts[:-1]))
        names = r"\bcompiled\b" if "kernel" in path.parts else rf"{module}\b|{within} import .*\b{path.stem}\b"
        room = path.parts[1].removesuffix(".py")
        if path.parts[0] == "plugins":
            room = "spatial_guidance" if "spatial" in room else "plugins"
        files = {name: name.partition("::")[0] for name in self.seconds}
        naming = {file for file in set(files.values()) if re.search(names, (copy / file).read_text("utf-8"))}
        first = {name for name, file in files.items() if file in naming}
        rest = {name for name, file in files.items() if file.startswith(f"tests/{room}/")} - first
        return self._affordable(first, rest)

    def _affordable(self, *groups: set[str]) -> list[str]:
        """Return tests of groups, as many as the budget allows: of each function one, then the rest, the quickest
        first."""
        chosen: list[str] = []
        for group in groups:
            again: list[str] = []
            seen: set[str] = set()
            for name in sorted(group, key=self.seconds.__getitem__):
                function = name.partition("[")[0]
                (again if function in seen else chosen).append(name)
                seen.add(function)
            chosen += again
        spent = list(accumulate(map(self.seconds.__getitem__, chosen)))
        return chosen[: bisect_right(spent, BUDGET)]


#: Options of every run of the tests.
QUIET = ("-q", "-p", "no:cacheprovider", "-m", "not slow")


def _environment(copy: Path) -> dict[str, str]:
    """Return the environment of tests of a copy, which has compiled code of its own."""
    path = os.pathsep.join([str(copy), str(Path(__file__).parent)])
    return dict(os.environ) | {"PYTHONPATH": path, "NUMBA_CACHE_DIR": str(copy / "compiled")}


def noticed(copy: Path, mutation: Mutation, tests: list[str]) -> bool:
    """Return whether tests notice a mutation."""
    path = copy / mutation.path
    source = path.read_text("utf-8")
    path.write_text(source[: mutation.start] + mutation.text + source[mutation.end :], "utf-8")
    wanted = copy / "wanted.txt"
    wanted.write_text("\n".join(tests), "utf-8")
    command = [sys.executable, "-m", "pytest", "-x", *QUIET, f"@{wanted}"]
    try:
        done = subprocess.run(command, cwd=copy, env=_environment(copy), capture_output=True, timeout=PATIENCE)
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
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--record", type=Path)
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        copies: queue.Queue[Path] = queue.Queue()
        for job in range(asked.jobs):
            copies.put(copy := Path(temporary) / f"copy{job}")
            subprocess.run(["git", "clone", "-q", str(ROOT), str(copy)], check=True)
        folder = asked.record or Path(temporary) / "record"
        if not (folder / "lines.db").exists():
            folder.mkdir(parents=True, exist_ok=True)
            Record.make(copy, folder.absolute())
        record = Record(folder)
        every = [
            mutation
            for part in ("catalogue", "plugins")
            for file in sorted((copy / part).rglob("*.py"))
            for mutation in mutations(file.relative_to(copy).as_posix(), file.read_text("utf-8"))
        ]
        every = [mutation for mutation in every if mutation.path.startswith(asked.only)]
        chosen = random.Random(asked.seed).sample(every, min(asked.count, len(every)))
        begun = time.perf_counter()

        def fate(number: int) -> str:
            """Return what becomes of a mutant, or nothing if there is no time left."""
            mutation, start = chosen[number], time.perf_counter()
            if start - begun > 60 * asked.minutes:
                return ""
            copy = copies.get()
            try:
                seen = record.running(mutation)
                tests = seen or record.beside(copy, mutation)
                killed = bool(tests) and noticed(copy, mutation, tests)
            finally:
                copies.put(copy)
            told = "killed" if killed else "lives" if seen else "unseen"
            spent = time.perf_counter() - start
            print(f"{number:4d} {told:6s} {spent:4.0f} s {len(tests):5d}  {mutation}", file=sys.stderr, flush=True)
            return told

        with ThreadPoolExecutor(asked.jobs) as pool:
            fates = list(pool.map(fate, range(len(chosen))))
    with contextlib.redirect_stdout(io.StringIO()) as report:
        title("Mutations")
        print(f"{len(chosen)} of {len(every)} places, the fast part of the tests.\n")
        rows = [[fates.count(told)] for told in ("killed", "lives", "unseen")]
        table(["killed", "left", "left, and no test is seen to run them"], [[value for row in rows for value in row]])
        left = [mutation for mutation, told in zip(chosen, fates, strict=True) if told in ("lives", "unseen")]
        print("\nLeft:\n\n" + "\n".join(f"- {mutation}" for mutation in left))
    print(report.getvalue())
    if asked.write:
        (ROOT / "data" / "reports" / "mutations.md").write_text(report.getvalue(), "utf-8")


if __name__ == "__main__":
    main()
