"""Count passages that a stranger has to read twice: run it for a list, with --lower to record lower counts."""

from __future__ import annotations

import argparse
import ast
import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
RECORD = Path(__file__).with_name("golden") / "plain_words.json"
SHIPPED = ("catalogue", "plugins", "data/documents")

#: Longest first sentence of a docstring [words]; well-kept libraries have a median of nine.
MAX_SUMMARY = 16
#: Widest line of a docstring or comment [columns]: two files side by side on a usual screen.  The formatter
#: sets code.
MAX_WIDTH = 100

FAULTS = ("long", "clauses", "leans", "constants", "numbers", "skip", "wide")
RELATIVE_PRONOUN = re.compile(r"\b(that|which|what|whose|where|whom)\b", re.IGNORECASE)
LEANING_START = re.compile(r"(the same|as above|so (is|are|do|does)|also|those)\b", re.IGNORECASE)
END_OF_SENTENCE = re.compile(r"(?<=[.;:])\s")


Documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


class Passage(NamedTuple):
    """A passage to reword: where it is, which of `FAULTS` it has, and its text."""

    line: int
    fault: str
    text: str


def passages(source: str) -> Iterator[Passage]:
    """Yield the passages of one module to reword."""
    tree = ast.parse(source)
    lines = source.splitlines()
    prose = {number for number, line in enumerate(lines, 1) if line.lstrip().startswith("#")}
    for node in ast.walk(tree):
        if isinstance(node, Documented) and ast.get_docstring(node) is not None:
            yield from _of_summary(node)
            prose.update(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    for statement in tree.body:
        yield from _of_constants(statement)
    for number, line in enumerate(lines, 1):
        if "fmt: skip" in line:
            yield Passage(number, "skip", line.strip())
        if number in prose and len(line) > MAX_WIDTH:
            yield Passage(number, "wide", line.strip())


def _of_summary(node: Documented) -> Iterator[Passage]:
    summary = (ast.get_docstring(node) or "").split("\n\n")[0].replace("\n", " ")
    sentence = END_OF_SENTENCE.split(summary)[0]
    line = getattr(node, "lineno", 1)
    if len(sentence.split()) > MAX_SUMMARY:
        yield Passage(line, "long", sentence)
    elif len(RELATIVE_PRONOUN.findall(sentence)) > 1:
        yield Passage(line, "clauses", sentence)
    if LEANING_START.match(sentence):
        yield Passage(line, "leans", sentence)


def _of_constants(statement: ast.stmt) -> Iterator[Passage]:
    if not isinstance(statement, ast.Assign | ast.AnnAssign) or statement.value is None:
        return
    targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
    names = targets[0].elts if isinstance(targets[0], ast.Tuple) else targets[:1]
    if not all(isinstance(name, ast.Name) and name.id.isupper() for name in names):
        return
    text = ast.unparse(targets[0])
    if len(names) > 1:
        yield Passage(statement.lineno, "constants", text)
    values = statement.value.elts if len(names) > 1 and isinstance(statement.value, ast.Tuple) else [statement.value]
    for _ in filter(_is_number, values):
        yield Passage(statement.lineno, "numbers", text)


def _is_number(node: ast.expr) -> bool:
    """Tell whether an expression is made of literal numbers alone."""
    if isinstance(node, ast.BinOp):
        return _is_number(node.left) and _is_number(node.right)
    if isinstance(node, ast.UnaryOp):
        return _is_number(node.operand)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def room(path: Path) -> str:
    """Return the folder below `catalogue` or `plugins` to which a module belongs."""
    folders = path.relative_to(ROOT).parts[:-1]
    return "/".join(folders[:2])


def modules() -> list[Path]:
    """List the modules that users receive or that make the documents."""
    return sorted(path for folder in SHIPPED for path in (ROOT / folder).rglob("*.py"))


def counts() -> dict[str, dict[str, int]]:
    """Count the passages of each room by fault."""
    tally = Counter((room(path), passage.fault) for path in modules() for passage in passages(path.read_text("utf-8")))
    rooms = sorted({room(path) for path in modules()})
    return {name: {fault: tally[name, fault] for fault in FAULTS} for name in rooms}


def recorded() -> dict[str, dict[str, int]]:
    """Read the counts that no room may exceed."""
    record: dict[str, dict[str, int]] = json.loads(RECORD.read_text("utf-8"))
    return record


def lower() -> None:
    """Record the counts of today where they are below those recorded."""
    before = recorded() if RECORD.exists() else {}
    after = {
        name: {fault: min(count, before.get(name, {}).get(fault, count)) for fault, count in found.items()}
        for name, found in counts().items()
    }
    RECORD.write_text(json.dumps(after, indent=1) + "\n", "utf-8")


def main() -> None:
    """List passages, or lower the record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("paths", nargs="*", type=Path, help="modules or folders (default: all that users receive)")
    parser.add_argument("--fault", choices=FAULTS, action="append", help="only this fault; may be repeated")
    parser.add_argument("--count", action="store_true", help="print counts per room")
    parser.add_argument("--lower", action="store_true", help="record lower counts")
    given = parser.parse_args()
    if given.lower:
        lower()
    elif given.count:
        print(f"{'room':32}" + "".join(f"{fault:>10}" for fault in FAULTS))
        for name, found in counts().items():
            print(f"{name:32}" + "".join(f"{found[fault]:10}" for fault in FAULTS))
    else:
        for path in _modules_below(given.paths) if given.paths else modules():
            for line, fault, text in sorted(passages(path.read_text("utf-8"))):
                if fault in (given.fault or FAULTS):
                    print(f"{path}:{line}: {fault}: {text[:160]}")


def _modules_below(paths: list[Path]) -> list[Path]:
    return [path for root in paths for path in ([root] if root.is_file() else sorted(root.rglob("*.py")))]


if __name__ == "__main__":
    main()
