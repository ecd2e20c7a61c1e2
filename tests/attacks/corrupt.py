"""What becomes of answers when the file they come from is damaged, or values in it are replaced.

``python tests/attacks/corrupt.py DATABASE [--count 1000] [--values 0.25] [--seed 0] [--write]`` damages so many copies
of a small database, replaces such a part of its columns by what they cannot be, asks each copy, reads saved answers of
which a value is false, and prints what came of it; ``--write`` writes it to ``data/reports/corrupt.md``. Some thousand
guides are enough: each copy takes seconds.
"""

from __future__ import annotations

import contextlib
import io
import json
import shutil
import sqlite3
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import catalogue
from catalogue import Catalogue, CatalogueError, CircularArc, StraightLine
from catalogue.find import answers, census
from catalogue.guides.codes import record
from catalogue.guides.dwell import StandStill
from catalogue.plugin.registry import Registry

ASKED = StraightLine(100, 0.5), CircularArc(100, 0.5)
PAGE = 4096


def _moved(value: Any) -> Any:
    """Return the pivots of a linkage with the first moved, or a place moved."""
    if isinstance(value[0], list):
        return [_moved(value[0]), *value[1:]]
    return [value[0] + 99.0, *value[1:]]


#: What a stored value is replaced by.  NULL is what SQLite makes of NaN.
VALUES: dict[str, Any] = {
    "NULL": None, "infinity": float("inf"), "minus infinity": float("-inf"), "-7": -7, "1e306": 1e306, "1e-320": 1e-320,
    "2**62": 2**62, "a word": "word", "no text": b"\xff\xfe\xfd", "broken UTF-8": "CAST(x'fffe41' AS TEXT)",
    "no JSON": '{"a": [', "a list": "[1]", "NaN in JSON": '{"a": NaN}', "a long text": "x" * 3_000,
    "a word in JSON": '{"a1": "x"}', "a list in JSON": '{"a1": [1, {}]}',
    "control characters": "A\x1b[2J\x1b]0;t\x07[red]",
}  # fmt: skip
#: What a value of a saved answer is replaced by, besides those of `VALUES` that JSON can hold.
FALSE: dict[str, Callable[[Any], Any]] = {
    "twice as much": lambda value: 2 * value + 1, "a hundredth more": lambda value: 1.01 * value, "moved": _moved,
}  # fmt: skip
#: What of an answer depends on the request, or on where it comes from: a measurement tells nothing of it.
UNMEASURED = {"id", "series", "configuration", "order", "allowance", "expected", "score", "front", "nearest", "gap",
              "alternations", "cognate", "number", "circuit", "given", "nearest_series", "residual", "asked_deviation",
              "asked_angle", "asked_residual"}  # fmt: skip
TABLES = ("mechanism", "guide", "reach", "batch", "setting")

Damage = Callable[[bytearray, np.random.Generator], None]


# -- damage -----------------------------------------------------------------------------------------------------------
def _bytes(content: bytearray, draw: np.random.Generator) -> None:
    for at in draw.integers(0, len(content), draw.integers(1, 200)):
        content[at] = int(draw.integers(256))


def _bit(content: bytearray, draw: np.random.Generator) -> None:
    content[draw.integers(len(content))] ^= 1 << int(draw.integers(8))


def _header(content: bytearray, draw: np.random.Generator) -> None:
    for at in draw.integers(16, 400, 3):
        content[at] = int(draw.integers(256))


def _noise(content: bytearray, draw: np.random.Generator) -> None:
    at = PAGE * int(draw.integers(len(content) // PAGE))
    content[at : at + PAGE] = draw.bytes(PAGE)


def _zeros(content: bytearray, draw: np.random.Generator) -> None:
    at = PAGE * int(draw.integers(len(content) // PAGE))
    content[at : at + PAGE] = bytes(PAGE)


def _swapped(content: bytearray, draw: np.random.Generator) -> None:
    one, other = (PAGE * int(k) for k in draw.choice(len(content) // PAGE, 2, replace=False))
    content[one : one + PAGE], content[other : other + PAGE] = (
        content[other : other + PAGE],
        content[one : one + PAGE],
    )


def _cut(content: bytearray, draw: np.random.Generator) -> None:
    del content[int(draw.integers(len(content))) :]


def _unsealed(damage: Damage) -> Damage:
    def damaged(content: bytearray, draw: np.random.Generator) -> None:
        content[60:64] = bytes(4)  # where the seal is
        damage(content, draw)

    return damaged


DAMAGES: dict[str, Damage] = {
    "random bytes": _bytes, "one bit": _bit, "bytes of the header": _header, "a page of noise": _noise,
    "a page of zeros": _zeros, "two pages swapped": _swapped, "cut off": _cut,
    "random bytes, no seal": _unsealed(_bytes), "two pages swapped, no seal": _unsealed(_swapped),
    "a page of noise, no seal": _unsealed(_noise),
}  # fmt: skip


def tampered(path: Path) -> Iterator[tuple[str, str, Any]]:
    """Yield table, column and value of all that can be replaced."""
    with contextlib.closing(sqlite3.connect(path)) as file:
        for table in TABLES:
            for _, column, *_ in file.execute(f"PRAGMA table_info({table})").fetchall():
                yield from ((table, column, value) for value in VALUES)


def tamper(path: Path, table: str, column: str, value: str, *, rows: int = 10**9) -> bool:
    """Replace a column of the first rows of a file that is not sealed, and return whether SQLite does it: rules and
    types of the tables are taken away before."""
    given = VALUES[value]
    text = isinstance(given, str) and given.startswith("CAST")
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as file:
        file.executescript(
            "PRAGMA user_version = 0; PRAGMA writable_schema = ON; PRAGMA ignore_check_constraints = ON;"
            "UPDATE sqlite_schema SET sql = replace(replace(sql, 'NOT NULL', ''), ' STRICT', '');"
            "PRAGMA writable_schema = RESET;"
        )
        try:
            file.execute(
                f"UPDATE {table} SET {column} = {given if text else '?'} WHERE rowid <= {rows}",
                () if text else (given,),
            )
        except (sqlite3.Error, OverflowError):
            return False
    return True


# -- questions --------------------------------------------------------------------------------------------------------
@cache
def registry() -> Registry:
    """Return the plugins, and have what a census draws kept: it does not come from the file."""
    kept: dict[tuple[str, str], Any] = {}
    plain = census._configurations

    def configurations(series: Any, member: Any) -> Any:
        key = series.code, member.key
        if key not in kept:
            kept[key] = plain(series, member)
        return kept[key]

    census._configurations = configurations
    return Registry()


def _find(request: Any, **how: Any) -> Callable[[Catalogue], Any]:
    return lambda opened: [one.to_dict() | {"drift": None} for one in opened.find(request, limit=3, **how)]


def _frame(opened: Catalogue, **how: Any) -> str:
    out = io.StringIO()
    opened.guides(**how).to_csv(out)
    return out.getvalue()


def _shown(opened: Catalogue, name: int | str) -> Any:
    guide = opened.guide(name)
    return {k: str(v) for k, v in vars(guide).items() if k not in ("rows", "linkage")}, guide.at(1.0).to_dict()


QUESTIONS: dict[str, Callable[[Catalogue], Any]] = {
    "find": _find(ASKED[0], refine=False),
    "find arc": _find(ASKED[1], refine=False),
    "find refined": _find(ASKED[0], families="four-bar"),
    "show": lambda opened: [_shown(opened, name) for name in (1, 100, "watt")],
    "census": lambda opened: census.census(opened.database, registry()),
    "export": lambda opened: (_frame(opened), _frame(opened, reaches=True)),
    "settings": lambda opened: (opened.complete, opened.database.get_number("count", 0)),
}


def ask(path: Path, name: str) -> Any:
    """Return the answer to a question, or the documented error: a `CatalogueError`."""
    try:
        with catalogue.open(path, build=False) as opened:
            vars(opened)["registry"] = registry()
            return QUESTIONS[name](opened)
    except CatalogueError as error:
        if len(str(error)) > 1000 or "\n" in str(error):
            raise AssertionError("an error is no short line") from error
        return error


def right(answer: Any, question: str) -> bool:
    """Return whether another answer than that of the sound file is right all the same: measured again, from its pivots
    alone, it keeps to what was asked."""
    if not question.startswith("find"):
        return False
    request = ASKED[question == "find arc"]
    for one in answer:
        measured = catalogue.measure(
            catalogue.guide(one["pivots"], one["guided"]), stroke=request.stroke, arc=question == "find arc", limit=30
        )
        if min((m.deviation for m in measured), default=np.inf) > request.deviation * 1.01:
            return False
    return True


def records(opened: Catalogue) -> list[dict[str, Any]]:
    """Return saved answers: of a line, an arc, a dwell, and a stretch of a linkage of one's own."""
    found = [opened.find(one, limit=1)[0] for one in ASKED]
    dwell = opened.find_dwells(StandStill(60, 1, 20), limit=1)
    return [record(one) for one in (*found, *dwell, found[0].measure(stroke=80.0)[0])]


def falsified(held: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield each name with each value that it can be replaced by, and what is then read."""
    for name, old in held.items():
        kept = {k: v for k, v in VALUES.items() if isinstance(v, str | int | float | None)}
        for value, new in kept.items():
            yield name, value, held | {name: new}
        for value, make in FALSE.items():
            with contextlib.suppress(TypeError, IndexError):  # of what it cannot be made
                yield name, value, held | {name: make(old)}


def read(name: str, held: dict[str, Any], sound: Any) -> str:
    """Return what came of reading an answer of which a value is another; what a measurement tells nothing of, and what
    is said no longer, may be believed."""
    try:
        answer = answers.of_record(json.loads(json.dumps(held)))
    except CatalogueError as error:
        return (
            "error" if len(str(error)) < 1000 and str(error).isprintable() else "traceback: an error is no short line"
        )
    except Exception as error:
        return f"traceback: {type(error).__name__}: {error}"[:150]
    if answer == sound or record(answer) == record(sound):
        return "same"
    if "\\x1b" in repr(answer.to_dict()):
        return "traceback: a control character"
    if _alike(name, getattr(answer, name), getattr(sound, name)):
        return "right"
    return "other" if name in UNMEASURED or getattr(answer, name) is None else "traceback: a false number is believed"


def _alike(name: str, said: Any, was: Any) -> bool:
    """Return whether two numbers are one but for rounding; an arc as good as straight has a radius."""
    if name == "radius":
        said, was = (0.0 if radius is None else 1 / radius for radius in (said, was))
    numbers = isinstance(said, int | float) and isinstance(was, int | float)
    return numbers and abs(said - was) <= 1e-12 * max(1.0, abs(was))


def outcome(path: Path, question: str, sound: Any) -> str:
    """Return what came of a question: error, same, right (another answer, which is right), other, or a traceback."""
    try:
        answer = ask(path, question)
        if isinstance(answer, CatalogueError):
            return "error"
        if "\\x1b" in repr(answer):
            return "traceback: a control character"
        return "same" if answer == sound else "right" if right(answer, question) else "other"
    except Exception as error:
        return f"traceback: {type(error).__name__}: {error}"[:150]


def run(path: Path, count: int, seed: int, *, values: float = 1.0, questions: Any = QUESTIONS) -> Iterator[Any]:
    """Yield for each copy what was done to it, the question and what came of it."""
    content = path.read_bytes()
    draw = np.random.default_rng(seed)
    sound = {name: ask(path, name) for name in questions}
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy.db"
        for k in range(count):
            name = [*DAMAGES][k % len(DAMAGES)]
            damaged = bytearray(content)
            DAMAGES[name](damaged, draw)
            copy.write_bytes(damaged)
            for question in questions:
                yield name, question, outcome(copy, question, sound[question]), k
            copy.unlink()
        for table, column, value in tampered(path):
            if draw.random() >= values:
                continue
            shutil.copy(path, copy)
            if tamper(copy, table, column, value):
                for question in questions:
                    what = "a value that cannot be, no seal"
                    yield what, question, outcome(copy, question, sound[question]), f"{table}.{column} = {value}"
            copy.unlink()
    with catalogue.open(path, build=False) as opened:
        every = [(held, answers.of_record(held)) for held in records(opened)]
    for held, right_one in every:
        for name, value, false in falsified(held):
            if draw.random() < values:
                case = f"{held['kind']}.{name} = {value}"
                yield "a saved answer with a false value", "read", read(name, false, right_one), case


def main() -> None:
    """Damage, ask, print."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
    from measuring import arguments, table, title

    parser = arguments()
    parser.add_argument("database", type=Path)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--values", type=float, default=0.25, help="which part of the values to replace")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rows: dict[str, Counter[str]] = {}
    copies: dict[str, set[Any]] = {}
    others: dict[tuple[str, str], set[str]] = {}
    for what, question, came, case in run(given.database, given.count, given.seed, values=given.values):
        rows.setdefault(what, Counter())[came.partition(":")[0]] += 1
        copies.setdefault(what, set()).add(case)
        if came == "other":
            column, _, value = (what, "", f"copy {case}") if isinstance(case, int) else case.partition(" = ")
            others.setdefault((column, question), set()).add(value)
        if came not in ("error", "same", "right"):
            print(what, question, case, came, file=sys.stderr, flush=True)
    out = io.StringIO()
    kinds = ("error", "same", "right", "other", "traceback")
    with contextlib.redirect_stdout(out):
        title("What becomes of answers when the file is damaged")
        print(
            f"Each copy of a database was asked {len(QUESTIONS)} questions: {', '.join(QUESTIONS)}.\n"
            "Error: one line, a documented class.  Same: the answer of the sound file.  Right: another answer, which\n"
            "keeps to what was asked when it is measured again from its pivots.  Other: another answer, of stored\n"
            "values that may be, listed below.  No seal: the file had been written to by somebody since it was built.\n"
            "Saved answers are read as from a file without their codes; a code tells of any change.\n"
        )
        table(["damage", "copies", *kinds], [[w, len(copies[w]), *(n[k] for k in kinds)] for w, n in rows.items()])
        print("\nOther answers, by what was replaced:\n")
        table(["replaced", "asked", "by"], [[*at, ", ".join(sorted(by))] for at, by in sorted(others.items())])
    print(out.getvalue())
    if given.write:
        (Path(__file__).parents[2] / "data" / "reports" / "corrupt.md").write_text(out.getvalue(), "utf-8")


if __name__ == "__main__":
    main()
