"""``export`` and ``schema``: what is stored, for other programs."""

from __future__ import annotations

import csv
import io
import json
import math
import shutil
import sqlite3
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from catalogue import Catalogue

Run = Callable[..., Any]
FEW = ("--series", "II.xy", "--kind", "line")


def rows(path: Path, query: str) -> list[Any]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(query).fetchall()


@pytest.mark.slow
def test_csv_is_the_data_frame(run: Run, small_db: Path, small: Catalogue, tmp_path: Path) -> None:
    file = tmp_path / "guides.csv"
    for reaches in (False, True):
        options = ["--reaches"] * reaches
        done = run("export", *FEW, *options, "--db", small_db)
        assert (done.code, done.err) == (0, "")
        read = list(csv.DictReader(io.StringIO(done.out)))
        frame = small.guides(series="II.xy", kind="line", reaches=reaches)
        assert len(read) == len(frame) > 20
        assert list(read[0]) == list(frame.columns)
        for printed, row in zip(read, frame.to_dict("records"), strict=True):
            for name, value in row.items():
                missing = value is None or value != value
                assert printed[str(name)] == "" if missing else type(value)(printed[str(name)]) == value
        again = run("export", *FEW, *options, "--out", file, "--force", "--db", small_db)
        assert (again.code, again.out) == (0, "")
        assert again.err == f"written: {file}, {len(frame)} rows\n"
        assert file.read_text("utf-8") == done.out
    assert [path.name for path in tmp_path.iterdir()] == ["guides.csv"]


def test_sqlite_is_whole_by_itself(run: Run, small_db: Path, tmp_path: Path) -> None:
    file = tmp_path / "some # guides.db"
    assert run("export", "--format", "sqlite", *FEW, "--out", file, "--db", small_db).code == 0
    few = "SELECT id FROM guide WHERE series = 'II.xy' AND kind = 'line'"
    guides = f"SELECT * FROM guides WHERE id IN ({few}) ORDER BY id"
    reaches = f"SELECT * FROM reach WHERE guide_id IN ({few}) ORDER BY guide_id, level"
    pivots = f"SELECT * FROM pivots WHERE mechanism_id IN (SELECT mechanism_id FROM guide WHERE id IN ({few}))"
    ordered = "ORDER BY mechanism_id, dyad, joint"
    assert rows(file, "SELECT * FROM guides ORDER BY id") == rows(small_db, guides) != []
    assert rows(file, "SELECT * FROM reach ORDER BY guide_id, level") == rows(small_db, reaches) != []
    assert rows(file, f"SELECT * FROM pivots {ordered}") == rows(small_db, f"{pivots} {ordered}") != []
    for table in ("guides", "pivots", "reach", "description"):
        columns = {column[1] for column in rows(file, f"PRAGMA table_info({table})")}
        told = rows(file, f"SELECT column_name FROM description WHERE table_name = '{table}'")
        assert {name for (name,) in told} == columns | {""}
    assert file.stat().st_size < small_db.stat().st_size / 4
    before = file.read_bytes()
    done = run("export", "--format", "sqlite", "--out", file, "--db", small_db)
    assert done.code == 2
    assert done.line.endswith("is there already: name another with --out, or overwrite it with --force")
    assert file.read_bytes() == before


@pytest.mark.slow
def test_parquet_keeps_every_number(run: Run, small_db: Path, small: Catalogue, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="comes with the extra `parquet`, of which `test` is made")
    file = tmp_path / "guides.parquet"
    assert run("export", "--format", "parquet", *FEW, "--out", file, "--db", small_db).code == 0
    table = parquet.read_table(file).to_pydict()
    frame = small.guides(series="II.xy", kind="line")
    assert list(table) == list(frame.columns)
    for name in ("id", "family", "fixed_1_x", "moving_2_y", "contact_order"):
        assert table[name] == frame[name].tolist()
    assert [math.nan if value is None else value for value in table["kappa"]] == frame["kappa"].tolist()


def test_parquet_needs_its_extra(run: Run, small_db: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    done = run("export", "--format", "parquet", *FEW, "--out", tmp_path / "guides.parquet", "--db", small_db)
    assert done.code == 6
    assert done.line == 'catalogue: parquet needs pyarrow: pip install "mechanism-catalogue[parquet]"'
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--format", "parquet"), "parquet cannot be printed: name a file with --out"),
        (("--format", "sqlite"), "sqlite cannot be printed: name a file with --out"),
        (("--out", "{tmp}/absent/guides.csv"), "there is no folder"),
        (("--out", "{tmp}"), "is a folder: name a file with --out"),
        (("--series", "II.xz"), "did you mean 'II.xy'?"),
        (("--kind", "lines"), "did you mean 'line'?"),
    ],
)
def test_export_refuses(run: Run, small_db: Path, tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    done = run("export", *(text.format(tmp=tmp_path) for text in options), "--db", small_db)
    assert done.code == 2
    assert message in done.line


@pytest.mark.parametrize("how", [("--format", "csv", "--out"), ("7", "--format", "json", "--out")])
def test_the_database_in_use_is_not_written_over(
    run: Run, small_db: Path, tmp_path: Path, how: tuple[str, ...]
) -> None:
    file, link = tmp_path / "a.db", tmp_path / "link.db"
    shutil.copy(small_db, file)
    link.symlink_to(file)
    for out, db in ((file, file), (link, file), (file, link)):
        done = run("export", *how, out, "--force", "--db", db)
        assert (done.code, done.line) == (2, f"catalogue: {out} is a database in use: name another file with --out")
    assert file.read_bytes() == small_db.read_bytes()


def test_schema_says_what_the_file_says(run: Run, small_db: Path) -> None:
    names = ("table_name", "column_name", "type", "unit", "meaning")
    told = json.loads(run("schema", "--format", "json").out)
    assert sorted(tuple(one[name] for name in names) for one in told) == sorted(
        rows(small_db, f"SELECT {', '.join(names)} FROM description")
    )
    assert "least transmission angle over the stroke" in " ".join(run("schema").out.split())
    header = run("schema", "--format", "csv").out.splitlines()[0]
    assert header == "table,column,type,unit,meaning"
