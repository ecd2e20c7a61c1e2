"""What may happen to a file while it is built, drawn into, upgraded or read: one clear line, and nothing lost.

    python tests/attacks/trouble.py [--write] [--seconds 60]

Prints a table; ``--write`` writes ``data/reports/trouble.md``; ends with exit code 1 if anything was lost, or said
otherwise than in one line.  POSIX only: the disk is filled by a limit on the size of files, and root gives up its
rights by `setpriv`.
"""

from __future__ import annotations

import io
import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import closing, redirect_stdout
from pathlib import Path
from typing import Any

from kills import POPULATE, ROOT, dump

REPORT = ROOT / "data" / "reports" / "trouble.md"
COUNT = 300
BUILD = ["build", "--count", str(COUNT), "--series", "T.few", "--series", "T.less", "--processes", "1"]
COLLECT = ["build", "--collection", "swings", "--count", "1200"]
MORE = [*BUILD[:2], str(2 * COUNT), *BUILD[3:]]
FIND = ["find", "straight-line", "--stroke", "1", "--deviation", "0.05", "--no-refine", "--limit", "3"]


#: What runs a command without the right to write where nobody may, which root has.
BOUND = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.geteuid() == 0 else []


def start(words: list[str], path: Path, bound: Sequence[str] = (), **options: Any) -> subprocess.Popen[str]:
    """Start the command on a file."""
    folders = (POPULATE / "dropin", ROOT / "tests" / "collections" / "dropin")
    return subprocess.Popen(
        [*bound, sys.executable, "-m", "catalogue", *words, "--db", str(path)],
        env={**os.environ, "PYTHONPATH": str(ROOT), "CATALOGUE_PLUGINS": os.pathsep.join(map(str, folders)),
             "CATALOGUE_ANSWERS": str(path.with_name("answers.db"))},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Return exit code and last line of a command; a traceback is none."""
    _, err = process.communicate(timeout=300)
    lines = [line for line in err.splitlines() if line.strip()] or [""]
    return (process.returncode, lines[-1]) if "Traceback" not in err else (-1, lines[-1])


def begun(path: Path, process: subprocess.Popen[str], table: str = "batch") -> None:
    """Wait until a first block is stored."""
    while process.poll() is None:
        if path.exists():
            with closing(sqlite3.connect(path)) as connection:
                try:
                    if connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]:
                        return
                except sqlite3.OperationalError:
                    pass
        time.sleep(0.02)


def finished(path: Path, whole: list[str]) -> bool:
    """Return whether a build that goes on ends with the content of one that was not disturbed."""
    return ended(start(BUILD, path))[0] == 0 and dump(path) == whole


def full_disk(path: Path, whole: list[str]) -> tuple[bool, str]:
    """The disk is full after half a megabyte."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))

    code, line = ended(start(BUILD, path, preexec_fn=limit))
    return code == 4 and finished(path, whole), line


def removed(path: Path, whole: list[str]) -> tuple[bool, str]:
    """The file is removed while it is filled."""
    process = start(BUILD, path)
    begun(path, process)
    for file in path.parent.glob("some.db*"):
        file.unlink()
    code, line = ended(process)
    return code in (0, 4) and finished(path, whole), line


def replaced(path: Path, whole: list[str]) -> tuple[bool, str]:
    """Another file takes the place of one that is filled, and is left alone or filled in turn."""
    process = start(BUILD, path)
    begun(path, process)
    other = path.with_name("other.db")
    assert ended(start([*BUILD, "--seed", "0"], other))[0] == 0
    other.replace(path)
    code, line = ended(process)
    return code in (0, 4) and finished(path, whole), line


def truncated(path: Path, whole: list[str]) -> tuple[bool, str]:
    """Half a finished file is gone."""
    assert ended(start(BUILD, path))[0] == 0
    os.truncate(path, path.stat().st_size // 2)
    code, line = ended(start(FIND, path))
    path.unlink()
    return code == 4 and "delete" not in line and finished(path, whole), line


def locked(path: Path, whole: list[str]) -> tuple[bool, str]:
    """Another program holds the file."""
    assert ended(start(BUILD, path))[0] == 0
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("BEGIN EXCLUSIVE")
        code, line = ended(start(BUILD, path))
    return code == 4 and finished(path, whole), line


def read_only_file(path: Path, whole: list[str]) -> tuple[bool, str]:
    """Nobody may write to a finished file: it is read, and not built on."""
    assert ended(start(BUILD, path))[0] == 0
    path.chmod(0o444)
    found = ended(start(FIND, path, BOUND))[0]
    code, line = ended(start(MORE, path, BOUND))
    same = dump(path) == whole
    path.chmod(0o644)
    return (found, code) == (0, 4) and same and finished(path, whole), line


def read_only_folder(path: Path, whole: list[str]) -> tuple[bool, str]:
    """Nobody may write to the folder of a finished file: it is read, and no other one is begun."""
    assert ended(start(BUILD, path))[0] == 0
    path.parent.chmod(0o555)
    found = ended(start(FIND, path, BOUND))[0]
    code, line = ended(start(BUILD, path.with_name("new.db"), BOUND))
    same, left = dump(path) == whole, sorted(file.name for file in path.parent.iterdir())
    path.parent.chmod(0o755)
    return (found, code) == (0, 4) and same and left == [path.name] and finished(path, whole), line


def two_builders(path: Path, whole: list[str]) -> tuple[bool, str]:
    """Two builds begin at once: one of them may give up."""
    both = [start(BUILD, path) for _ in range(2)]
    codes, lines = zip(*map(ended, both), strict=True)
    line = next((line for code, line in zip(codes, lines, strict=True) if code), lines[0])
    return set(codes) <= {0, 4} and finished(path, whole), line


def two_collectors(path: Path, _: list[str]) -> tuple[bool, str]:
    """Two first uses of a collection at once."""
    both = [start(COLLECT, path) for _ in range(2)]
    codes = [ended(one)[0] for one in both]
    alone = path.with_name("alone.db")
    ended(start(COLLECT, alone))
    query = "SELECT family, block, place, parameters FROM specimens ORDER BY 1, 2, 3"
    held = []
    for file in (path, alone):
        with closing(sqlite3.connect(file)) as connection:
            held.append(connection.execute(query).fetchall())
    return codes == [0, 0] and held[0] == held[1], f"{len(held[0])} specimens, each once"


def upgrade_beside_reader(path: Path, _: list[str]) -> tuple[bool, str]:
    """A file is upgraded while another program reads it; a copy of the older one stays, one only."""
    assert ended(start(BUILD, path))[0] == 0
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.executescript("UPDATE alembic_version SET version_num = '0007'; DROP TABLE specimens;")
        connection.executescript(
            "CREATE TABLE specimens (id INTEGER PRIMARY KEY, collection TEXT, family TEXT, series TEXT,"
            " configuration TEXT, kind TEXT, block INTEGER, deviation REAL, parameters TEXT, metrics TEXT) STRICT"
        )
        reader = connection.execute("SELECT * FROM reach")
        reader.fetchone()
        process = start(FIND, path)
        time.sleep(3)
        reader.fetchall()
        code, line = ended(process)
    copies = [file.name for file in path.parent.glob("some.db.backup*")]
    return code == 0 and copies == ["some.db.backup-0007"], line or ", ".join(copies)


def readers(path: Path, seconds: float) -> tuple[bool, str]:
    """Twelve readers and a builder: no error, and no batch of which only a part is there."""
    reader = (
        "import sys, time, catalogue\n"
        "end, took = time.monotonic() + float(sys.argv[2]), []\n"
        "with catalogue.open(sys.argv[1], build=False) as cat:\n"
        "    while (begin := time.monotonic()) < end:\n"
        "        with cat.database.engine.connect() as one:\n"
        "            query = ('SELECT count(*) FROM batch b WHERE b.kept <> (SELECT count(*) FROM mechanism m WHERE'\n"
        "                     ' m.batch_id = b.id) OR b.guides <> (SELECT count(*) FROM guide g JOIN mechanism m ON'\n"
        "                     ' m.id = g.mechanism_id WHERE m.batch_id = b.id)')\n"
        "            assert one.exec_driver_sql(query).scalar() == 0\n"
        "        if cat.database.get_setting('complete') and len(took) % 5 == 0:\n"
        "            cat.find(catalogue.StraightLine(1, 0.05), refine=False, limit=3)\n"
        "        took.append(time.monotonic() - begin)\n"
        "print(*took)\n"
    )
    ended(start(["build", "--count", "20", "--series", "T.few"], path))
    many = [
        subprocess.Popen([sys.executable, "-c", reader, str(path), str(seconds)], text=True,
                         env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for _ in range(12)
    ]  # fmt: skip
    count, codes = 100, []
    while any(one.poll() is None for one in many):
        codes.append(ended(start([*BUILD[:2], str(count), *BUILD[3:]], path))[0])
        count += 100
    told = [one.communicate() for one in many]
    good = set(codes) == {0} and all(one.returncode == 0 for one in many)
    wrong = next((err.splitlines()[-1] for _, err in told if err), "")
    took = sorted(float(seconds) for out, _ in told for seconds in out.split())
    late = took[int(0.99 * len(took))] if took else 0.0
    return good, wrong or f"{len(took)} looks, 99 of 100 within {late:.2f} s, {len(codes)} builds, no half batch"


def main() -> None:
    """Print the table, and write it if it is asked for."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
    from measuring import arguments, table, title

    parser = arguments()
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--seconds", type=float, default=60)
    given = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "whole.db"
        assert ended(start(BUILD, path))[0] == 0
        whole = dump(path)
    tried: list[Callable[[Path, list[str]], tuple[bool, str]]] = [
        full_disk, read_only_file, read_only_folder, removed, replaced, truncated, locked, two_builders, two_collectors,
        upgrade_beside_reader,
        lambda path, _: readers(path, given.seconds),
    ]  # fmt: skip
    for one in tried:
        folder = tempfile.mkdtemp()
        good, line = one(Path(folder) / "some.db", whole)
        name = "twelve readers and a builder" if one is tried[-1] else one.__name__.replace("_", " ")
        rows.append((name, "held" if good else "LOST", line.replace(folder, "")[:160]))
        print(*rows[-1], sep="  ", file=sys.stderr, flush=True)
        shutil.rmtree(folder)
    text = io.StringIO()
    with redirect_stdout(text):
        title("Files in trouble")
        table(("what happens", "in the end", "what is said"), rows)
    print(text.getvalue())
    if given.write:
        REPORT.write_text(text.getvalue(), "utf-8")
    sys.exit(any(row[1] == "LOST" for row in rows))


if __name__ == "__main__":
    main()
