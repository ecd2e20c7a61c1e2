"""Plugins that misbehave, each beside one that does not: found, named, contained.

    python tests/attacks/misbehaving.py [--write] [NAME ...]

prints a table, of the kinds named if any are, and ends with exit code 1 if one gets through; ``--write`` writes
``data/reports/misbehaving.md``.  Each kind is a file ``bad.py``; beside it stands ``good.py``, whose answers must be
what they are without it:

- `classify`: the command answers a linkage as JSON, in a process of its own, with nothing else on standard output;
- `block`: a worker process makes a block of the bad series, then one of the good one;
- `collection`: the command finds in the collection of the bad plugin, whose error ends that request alone.

What is left out is said in one line of printable text that names file or series; nothing is a traceback.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
REPORT = ROOT / "data" / "reports" / "misbehaving.md"

PLUGIN = """
import asyncio, atexit, ctypes, os, signal, sys, threading, time, warnings
import numpy as np
from catalogue.plugin import Family, Guided, Member, Parameter, Series
from catalogue.plugin import circle_pair, hookimpl, linkage_of, normal_pair

CODE, NAME, PARAMETERS, MEMBER, SERIES, FAMILIES = "X.bad", "general", {{}}, {{}}, {{}}, []

def derive(p): return {{"phi2": np.pi - p["phi1"]}}
def pivots(p): return linkage_of(circle_pair(p["kappa"], p["phi1"]), circle_pair(p["kappa"], p["phi2"]))
def guided(p): return [Guided("undulation", normal_pair(np.zeros_like(p["kappa"])), 4)]
def classify(instant): return np.full(len(instant.linkage), 0.5), np.ones(len(instant.linkage))
def say(text="printed by a plugin"): print(text, flush=True); os.write(1, b"written by a plugin\\n")

{text}

def made(code=CODE):
    kappa = Parameter(*{{"name": "kappa", "domain": ((0.1, 0.13),), "meaning": "rho0/R", **PARAMETERS}}.values())
    phi = Parameter("phi1", ((0.3, 1.3),), "direction of crank 1 [rad]")
    member = {{"name": NAME, "family": "four-bar", "parameters": [kappa, phi], "pivots": pivots, "derive": derive}}
    data = {{"code": code, "title": "a test", "inverse": code, "source": "nowhere", "classify": classify,
             "guided": guided, "members": [Member(**member | MEMBER)]}}
    return Series(**data | SERIES)

{hook}
"""
HOOK = "@hookimpl\ndef catalogue_series(): return [made()]"

#: Of each kind what it does to the file above.  "left out": a line names it.  "harmless": it is told or not, and works
#: or not.  "refused": the command ends with exit code 5 and names it.  "interrupted": as if Ctrl-C were pressed.
LEFT_OUT, HARMLESS, REFUSED, INTERRUPTED = "left out", "harmless", "refused", "interrupted"


@dataclass(frozen=True)
class Kind:
    """A way to misbehave."""

    name: str
    how: str  #: which of the three questions shows it
    ends: str
    text: str
    hook: str = HOOK


def _odd(body: str) -> str:
    return f"class Odd(Exception):\n    def __str__(self): {body}\nraise Odd"


_IMPORT = {
    "raises": "1 / 0",
    "error whose text raises": _odd("raise RuntimeError"),
    "error whose text exits": _odd("sys.exit()"),
    "error whose text is no text": _odd("return 3"),
    "error that is endless text": _odd("return 'long ' * 10**6"),
    "error with escape sequences": "raise ValueError('\\x1b[31mred\\x1b[2J\\x07')",
    "error with markup": "raise ValueError('[bold red]red[/] [link=file:///]')",
    "error with closing markup": "raise ValueError('[/nothing]')",
    "error with half a character": "raise ValueError('\\udcff')",
    "error with turned writing": "raise ValueError('\\u202egnp.exe')",
    "error of several lines": "raise ValueError('one\\ntwo\\rthree')",
    "group of errors": "raise ExceptionGroup('many', [ValueError('one')])",
    "GeneratorExit": "raise GeneratorExit",
    "StopIteration": "raise StopIteration",
    "BaseException": "class Mine(BaseException): pass\nraise Mine('mine')",
    "sys.exit(0)": "sys.exit(0)",
    "sys.exit with a text": "sys.exit('good bye')",
    "MemoryError": "raise MemoryError",
    "endless recursion": "def deeper(): return deeper()\ndeeper()",
    "endless loop": "while True: pass",
    "no Python": "def def",
    "null bytes": "x = '\0'",
    "missing module": "import no_such_module_anywhere",
    "wrong import": "from catalogue.plugin import Nothing",
    "version whose text raises": "class V:\n    def __str__(self): raise RuntimeError\n__version__ = V()",
    "version without end": "__version__ = '1.' * 10**6",
    "version with escape sequences": "__version__ = '\\x1b[2J'",
    "version that is a list": "__version__ = [1, 2]",
    "names cannot be listed": "def __dir__(): raise RuntimeError('no names')",
    "forks and raises": "os.fork()\n1 / 0",
    "goes to another folder and raises": "os.chdir('/')\n1 / 0",
    "swallows the first Ctrl-C": "try: time.sleep(60)\nexcept BaseException: time.sleep(60)",
}  # fmt: skip
_HOOKS = {
    "hook raises": "@hookimpl\ndef catalogue_series(): raise RuntimeError('in a hook')",
    "hook exits": "@hookimpl\ndef catalogue_series(): sys.exit()",
    "hook raises GeneratorExit": "@hookimpl\ndef catalogue_series(): raise GeneratorExit",
    "hook loops": "@hookimpl\ndef catalogue_series():\n    while True: pass",
    "hook gives a number": "@hookimpl\ndef catalogue_series(): return 3",
    "hook gives nothing": "@hookimpl\ndef catalogue_series(): made()",
    "hook gives texts": "@hookimpl\ndef catalogue_series(): return ['X.bad']",
    "hook gives a class": "@hookimpl\ndef catalogue_series(): return [Series]",
    "hook gives a coroutine": "@hookimpl\nasync def catalogue_series(): return [made()]",
    "hook raises half-way": "@hookimpl\ndef catalogue_series():\n    yield made()\n    1 / 0",
    "hook without end": "@hookimpl\ndef catalogue_series():\n    n = 0\n    while True: yield made(f'X.{n}'); n += 1",
    "hook gives one twice": "@hookimpl\ndef catalogue_series(): return [made(), made()]",
    "hook misspelt": "@hookimpl\ndef catalogue_seires(): return [made()]",
    "hook with an argument": "@hookimpl\ndef catalogue_series(request): return [made()]",
    "hook not marked": "def catalogue_series(): return [made()]",
    "hook of families exits": f"@hookimpl\ndef catalogue_families(): sys.exit(0)\n{HOOK}",
    "family with markup": f"@hookimpl\ndef catalogue_families(): return [Family('[red]', 'a', 'b', '')]\n{HOOK}",
    "list that raises": "class L(list):\n    def __iter__(self): raise SystemExit\n@hookimpl\ndef catalogue_series(): "
    "return L()",
}  # fmt: skip
_DATA = {
    "code that is a list": "CODE = []",
    "code that is a number": "CODE = 7",
    "code that is blank": "CODE = ' '",
    "code without end": "CODE = 'X' * 10**6",
    "code with half a character": "CODE = 'X\\udcff'",
    "code with markup": "CODE = '[red]X[/]'",
    "code with escape sequences": "CODE = 'X\\x1b[2J'",
    "code that cannot be hashed": "class C(str):\n    __hash__ = None\nCODE = C('X.bad')",
    "title without end": "SERIES = {'title': 'long ' * 10**5}",
    "title that is none": "SERIES = {'title': None}",
    "title with escape sequences": "SERIES = {'title': '\\x1b[2J'}",
    "inverse that is none": "SERIES = {'inverse': None}",
    "no member": "SERIES = {'members': []}",
    "members that are texts": "SERIES = {'members': ['general']}",
    "members of one name": "SERIES = {'members': [Member('a', 'four-bar', [], pivots)] * 2}",
    "name of a member with escape sequences": "NAME = '\\x1b[2J'",
    "weight that is NaN": "MEMBER = {'weight': float('nan')}",
    "weight below zero": "MEMBER = {'weight': -1.0}",
    "weight without bound": "MEMBER = {'weight': float('inf')}",
    "parameters of one name": "PARAMETERS = {'name': 'phi1'}",
    "parameters that are texts": "MEMBER = {'parameters': ['kappa', 'phi1']}",
    "parameter with a quote": "PARAMETERS = {'name': 'a\"; DROP TABLE guide'}",
    "domain that is reversed": "PARAMETERS = {'domain': ((1.0, 0.5),)}",
    "domain with NaN": "PARAMETERS = {'domain': ((float('nan'), 1.0),)}",
    "unknown family": "MEMBER = {'family': 'gears'}",
    "series that checks nothing": "Real = Series\nclass Series(Real):\n    def __post_init__(self): pass\n"
    "SERIES = {'code': ''}",
    "property that raises": "Real = Series\nclass Series(Real):\n    @property\n    def families(self): sys.exit()",
}  # fmt: skip
_CLASSIFY = {
    "classify raises": "def classify(i): 1 / 0",
    "classify exits": "def classify(i): sys.exit()",
    "classify raises GeneratorExit": "def classify(i): raise GeneratorExit",
    "classify raises with escape sequences": "def classify(i): raise ValueError('\\x1b[2J[red]')",
    "classify loops": "def classify(i):\n    while True: pass",
    "classify recurses": "def classify(i): return classify(i)",
    "classify gives nothing": "def classify(i): pass",
    "classify gives one array": "def classify(i): return np.ones(len(i.linkage))",
    "classify gives numbers": "def classify(i): return 0.0, 1.0",
    "classify gives too many": "def classify(i): return np.zeros(99), np.ones(99)",
    "classify gives texts": "def classify(i): return np.array(['a'] * len(i.linkage)), np.ones(len(i.linkage))",
    "classify changes the linkage": "def classify(i): i.linkage.pivots[:] = 0",
    "classify changes the curvature": "def classify(i): i.curvature.kappa[:] = 0",
    "classify forks and raises": "def classify(i):\n    os.fork()\n    1 / 0",
    "classify is none": "classify = None",
}  # fmt: skip
_TOLD = {
    "prints when imported": "say()",
    "takes standard output away": "sys.stdout = None",
    "closes standard output": "sys.stdout.close()",
    "attribute that raises": "def __getattr__(name): raise RuntimeError(name)",
    "every attribute is there": "def __getattr__(name): return lambda *_: 3",
    "NumPy raises": "np.seterr(all='raise')",
    "warnings are errors": "warnings.simplefilter('error')",
    "warns with escape sequences": "warnings.warn('\\x1b[2J')",
    "prints at the end": "atexit.register(say)",
    "thread that prints": "threading.Thread(target=lambda: [time.sleep(0.2) or say() for _ in range(9)]).start()",
    "forks": "os.fork()",
    "forks and waits": "if os.fork() == 0: time.sleep(3)",
    "classify forks": "Real = classify\ndef classify(i): os.fork(); return Real(i)",
    "goes to another folder": "os.chdir('/')",
    "classify goes to another folder": "Real = classify\ndef classify(i): os.chdir('/'); return Real(i)",
    "ignores Ctrl-C": "signal.signal(signal.SIGINT, signal.SIG_IGN)",
    "classify prints": "def classify(i):\n    say()\n    return np.ones(len(i.linkage)), np.ones(len(i.linkage))",
    "classify gives NaN": "def classify(i): return np.full((2, len(i.linkage)), np.nan)",
    "title with markup": "SERIES = {'title': '[bold]title[/nothing]'}",
}  # fmt: skip
#: What goes on whatever is raised in it.
_ENDLESS = {
    "imported without end": "while True:\n    try: time.sleep(0.1)\n    except BaseException: pass",
    "imported without end, deaf": "signal.signal(signal.SIGINT, signal.SIG_IGN)\nwhile True: pass",
    "classify without end": "def classify(i):\n    while True:\n        try: time.sleep(0.1)\n"
    "        except BaseException: pass",
}  # fmt: skip
_BLOCK = {
    "pivots write into parameters": "Real = pivots\ndef pivots(p): r = Real(p); p['kappa'][:] = 9; return r",
    "pivots replace parameters": "Real = pivots\ndef pivots(p): r = Real(p); p['kappa'] = 2 * p['kappa']; return r",
    "derive writes into parameters": "Real = derive\ndef derive(p): p['kappa'][:] *= 2; return Real(p)",
    "guided writes into parameters": "Real = guided\ndef guided(p): p['phi2'][:] += 1; return Real(p)",
    "pivots without end": "def pivots(p):\n    while True:\n        try: time.sleep(0.1)\n"
    "        except BaseException: pass",
    "pivots fork and do not end": "def pivots(p):\n    os.fork()\n    while True: time.sleep(1)",
    "pivots raise": "def pivots(p): 1 / 0",
    "pivots exit": "def pivots(p): sys.exit()",
    "pivots raise KeyboardInterrupt": "def pivots(p): raise KeyboardInterrupt",
    "pivots end the process": "def pivots(p): os._exit(0)",
    "pivots crash": "def pivots(p): ctypes.string_at(0)",
    "pivots kill the process": "def pivots(p): os.kill(os.getpid(), getattr(signal, 'SIGKILL', signal.SIGTERM))",
    "pivots take all memory": "def pivots(p): np.zeros(10**15)",
    "pivots loop": "def pivots(p):\n    while True: pass",
    "pivots loop without a thread": "def pivots(p): return sum(iter(int, 1))",
    "pivots close all files": "def pivots(p): os.closerange(0, 99)",
    "pivots of fewer linkages": "Real = pivots\ndef pivots(p): return Real(p)[:7]",
    "pivots of one linkage": "Real = pivots\ndef pivots(p): return Real(p)[:1]",
    "pivots of more linkages": "Real = pivots\ndef pivots(p): return np.repeat(Real(p), 2, 0)",
    "pivots of a wrong shape": "Real = pivots\ndef pivots(p): return Real(p)[:, 0]",
    "pivots are complex": "Real = pivots\ndef pivots(p): return Real(p) + 1j",
    "pivots are texts": "Real = pivots\ndef pivots(p): return Real(p).astype(str)",
    "pivots are none": "def pivots(p): return None",
    "derived parameter of one value": "def derive(p): return {'phi2': np.pi - p['phi1'][:1]}",
    "derive gives nothing": "def derive(p): return None",
    "guided gives nothing": "def guided(p): return None",
    "guided gives arrays": "def guided(p): return [normal_pair(p['kappa'])]",
    "guided of a wrong shape": "def guided(p): return [Guided('a', np.zeros((3, 2, 3)), 4)]",
    "label with escape sequences": "def guided(p): return [Guided('\\x1b[2J', normal_pair(0 * p['kappa']), 4)]",
    "label that is a number": "def guided(p): return [Guided(7, normal_pair(0 * p['kappa']), 4)]",
    "label without end": "def guided(p): return [Guided('a' * 10**6, normal_pair(0 * p['kappa']), 4)]",
}  # fmt: skip
_BLOCK_TOLD = {
    "pivots fork": "Real = pivots\ndef pivots(p): os.fork(); return Real(p)",
    "pivots go to another folder": "Real = pivots\ndef pivots(p): os.chdir('/'); return Real(p)",
    "pivots print and read": "Real = pivots\ndef pivots(p):\n    say(sys.stdin.read())\n    return Real(p)",
    "pivots are NaN": "Real = pivots\ndef pivots(p): return Real(p) * np.nan",
    "pivots are infinite": "Real = pivots\ndef pivots(p): return Real(p) * np.inf",
}  # fmt: skip
_COLLECTION = {
    "collection whose hook exits": "sys.exit()",
    "collection whose hook prints and raises": "say()\n    1 / 0",
    "collection with a name like markup": "return [coll(name='[red]')]",
    "collection with a title like an escape": "return [coll(title='\\x1b[2J')]",
    "collection drawn by nothing": "return [coll(draw=None)]",
    "draw raises SystemExit": "return [coll(draw=lambda *_: sys.exit())]",
    "draw gives nothing": "return [coll(draw=lambda *_: None)]",
    "draw gives texts": "return [coll(draw=lambda *_: ['a'])]",
    "draw gives what is undeclared": "return [coll(draw=lambda *_: [Specimen('a', 'z', 'c', 'line', 0.1, {}, {})])]",
    "draw gives an escape": "return [coll(draw=lambda *_: [Specimen('a', 'b', '\\x1b[2J', 'line', 0.0, {}, {})])]",
    "measure exits": "return [coll(measure=lambda *_: sys.exit())]",
    "measure gives too few": "return [coll(measure=lambda *_: [])]",
    "measure gives texts": "return [coll(measure=lambda s, r: ['a'] * len(s))]",
    "measure gives NaN": "return [coll(measure=lambda s, r: [Measured(np.nan, None, {}, {})] * len(s))]",
    "classification exits": "return [coll(classify=lambda p: sys.exit())]",
    "classification gives an escape": "return [coll(classify=lambda p: Tags('a', 'b', '\\x1b[2J'))]",
}  # fmt: skip
COLLECTION = """
from catalogue.plugin import Collection, Measured, Specimen, Tags
def coll(**more):
    data = {{"name": "odd", "title": "odd", "source": "nowhere", "plan": "1", "families": {{"a": ["b"]}},
            "metrics": {{}}, "draw": lambda f, rng, n: [Specimen("a", "b", "c", "line", 0.0, {{}}, {{}})] * n,
            "measure": lambda s, r: [Measured(0.0, None, {{}}, {{}})] * len(s),
            "classify": lambda p: Tags("a", "b", "c"), "plot": lambda c, f: None}}
    return Collection(**data | more)
@hookimpl
def catalogue_collections():
    {}
"""


def kinds() -> Iterator[Kind]:
    """Yield all kinds."""
    for texts in (_IMPORT, _DATA):
        yield from (Kind(name, "classify", LEFT_OUT, text) for name, text in texts.items())
    yield from (Kind(name, "classify", LEFT_OUT, "", hook) for name, hook in _HOOKS.items())
    yield from (Kind(name, "classify", LEFT_OUT, text) for name, text in _CLASSIFY.items())
    yield from (Kind(name, "classify", HARMLESS, text) for name, text in _TOLD.items())
    yield Kind("KeyboardInterrupt", "classify", INTERRUPTED, "raise KeyboardInterrupt")
    yield Kind("code of another plugin", "classify", REFUSED, "CODE = 'II.xy'")
    yield from (Kind(name, "classify", REFUSED, text) for name, text in _ENDLESS.items())
    yield from (Kind(name, "block", LEFT_OUT, text) for name, text in _BLOCK.items())
    yield from (Kind(name, "block", HARMLESS, text) for name, text in _BLOCK_TOLD.items())
    yield from (Kind(name, "collection", REFUSED, "", COLLECTION.format(x)) for name, x in _COLLECTION.items())


def seen(kind: Kind, folder: Path) -> tuple[bool, str]:
    """Return whether a kind is found, named and contained, and the line that says so."""
    folder.mkdir(parents=True)
    (folder / "good.py").write_text(PLUGIN.format(text="CODE = 'X.good'", hook=HOOK))
    (folder / "bad.py").write_bytes(PLUGIN.format(text=kind.text, hook=kind.hook).encode("utf-8", "surrogatepass"))
    done = {"classify": _classified, "block": _blocked, "collection": _collected}[kind.how](folder)
    code, out, err = done.returncode, done.stdout, done.stderr
    lines = [line for line in err.splitlines() if line.startswith("catalogue: ")]
    quiet = all(c.isprintable() or c in "\n\t" for c in out + err) and "Traceback" not in out + err
    named = [line for line in lines if "bad.py" in line or "X.bad" in line]
    short = all(len(line) < 1000 for line in err.splitlines())
    line = (named or lines or [""])[0].replace(str(folder), "")
    whole = out == _sound(kind.how)
    good = {
        LEFT_OUT: code == 0 and whole and bool(named),
        HARMLESS: code == 0 and whole,
        REFUSED: code == 5 and not out and bool(named),
        INTERRUPTED: code == 130 and not out and bool(named),
    }[kind.ends]
    return good and quiet and short, line or f"exit code {code}"


_CLASSIFIER = (
    "import catalogue.foreign_code; catalogue.foreign_code.LIMIT = 2.0; from catalogue.cli import main; main()"
)
_BLOCKER = """
import sys
from catalogue.engines.processes import Processes
from catalogue.errors import PluginError
from catalogue.populate.make import begin, make
def made(pool, code):
    return pool.submit(make, code, "four-bar general", 0, 0, 16, "", "").result()
if __name__ == "__main__":
    with Processes(1, begin([sys.argv[1]]), limit=15.0) as pool:
        try:
            made(pool, "X.bad")
        except PluginError as error:
            print(f"catalogue: X.bad: {error}", file=sys.stderr)
        print(made(pool, "X.good").count)
"""
_WATT = "[[[[-1, 0.6], [0, 0.6]], [[1, -0.6], [0, -0.6]]]]"


def _run(words: list[str], stdin: str = "", folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("CATALOGUE_")}
    environment |= {"PYTHONPATH": str(ROOT), "PYTHONFAULTHANDLER": ""}
    return subprocess.run(
        [sys.executable, *words], input=stdin, capture_output=True, text=True, errors="backslashreplace", timeout=60,
        check=False, env=environment, cwd=folder,
    )  # fmt: skip


def _classified(folder: Path) -> subprocess.CompletedProcess[str]:
    return _run(
        ["-c", _CLASSIFIER, "classify", "-", "--format", "json", "--plugins", folder.name], _WATT, folder.parent
    )


def _blocked(folder: Path) -> subprocess.CompletedProcess[str]:
    return _run(["-c", _BLOCKER, str(folder)])


def _collected(folder: Path) -> subprocess.CompletedProcess[str]:
    request = ["find", "straight-line", "--stroke", "1", "--deviation", "0.1", "--collection", "odd"]
    where = ["--format", "json", "--db", str(folder / "some.db"), "--plugins", str(folder)]
    return _run(["-c", _CLASSIFIER, *request, *where])


_SOUND: dict[str, str] = {}


def _sound(how: str) -> str:
    """Return what is printed where all plugins are good."""
    if how not in _SOUND and how != "collection":
        with tempfile.TemporaryDirectory() as folder:
            for name in ("good", "bad"):
                text = PLUGIN.format(text=f"CODE = 'X.{name}'", hook=HOOK)
                (Path(folder) / f"{name}.py").write_text(text)
            _SOUND[how] = (_classified if how == "classify" else _blocked)(Path(folder)).stdout
        if how == "classify":
            assert json.loads(_SOUND[how])
    return _SOUND.get(how, "")


def main() -> None:
    """Print the table, and write it if it is asked for."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
    from measuring import arguments, table, title

    parser = arguments()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    rows, start = [], time.perf_counter()
    for number, kind in enumerate(kinds()):
        if given.names and kind.name not in given.names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            good, line = seen(kind, Path(folder) / "mine")
        told = line.removeprefix("catalogue: ").replace("|", "/").replace(f"{ROOT}/", "")
        rows.append((number + 1, kind.name, kind.ends if good else "GETS THROUGH", told[:150]))
        print(*rows[-1], sep="  ", file=sys.stderr, flush=True)
    bad = sum(row[2] == "GETS THROUGH" for row in rows)
    text = io.StringIO()
    with redirect_stdout(text):
        title("Plugins that misbehave")
        print(f"{len(rows)} kinds, {bad} get through; {time.perf_counter() - start:.0f} s.\n")
        table(("", "kind", "what becomes of it", "what is said"), rows)
    print(text.getvalue())
    if given.write:
        REPORT.write_text(text.getvalue(), "utf-8")
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
