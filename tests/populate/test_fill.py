"""Filling a file: the same content whatever happened on the way, and plugins that fail harm nobody."""

from __future__ import annotations

import re
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from catalogue.api import Catalogue
from catalogue.errors import DatabaseError, InvalidRequest, PluginWarning
from catalogue.plugin.registry import Registry
from catalogue.populate.fill import fill
from catalogue.progress import Progress
from catalogue.store import Database

pytestmark = pytest.mark.slow

FEW = ("T.few", "T.less")
Content = Callable[[Path], dict[str, list[Any]]]
Filled = Callable[..., Progress]


class Interrupted(Exception):
    """What a caller raises in `report`."""


def after(blocks: int) -> Callable[[Progress], None]:
    """Return a report that raises after so many blocks."""
    seen: list[Progress] = []

    def report(progress: Progress) -> None:
        seen.append(progress)
        if len(seen) == blocks:
            raise Interrupted

    return report


def dump(path: Path) -> list[str]:
    with closing(sqlite3.connect(path)) as connection:
        return list(connection.iterdump())


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a name for a database."""
    return tmp_path / "some.db"


def test_same_seed_gives_the_same_file_for_any_number_of_processes(
    filled: Filled, path: Path, undisturbed: Path
) -> None:
    filled(path, processes=1)
    assert dump(path) == dump(undisturbed)


def test_another_seed_gives_other_content(filled: Filled, path: Path, undisturbed: Path, content: Content) -> None:
    filled(path, seed=1)
    other, first = content(path), content(undisturbed)
    for table in ("mechanism", "guide", "reach"):
        assert not {row[5:] for row in other[table]} & {row[5:] for row in first[table]}, table


@pytest.mark.parametrize("blocks", [1, 4])
def test_interrupted_and_resumed_is_undisturbed(
    filled: Filled, path: Path, undisturbed: Path, content: Content, blocks: int
) -> None:
    with pytest.raises(Interrupted):
        filled(path, report=after(blocks), processes=2)
    assert len(content(path)["batch"]) == blocks
    last = filled(path)
    assert last.rows > 0
    assert content(path) == content(undisturbed)


def test_what_another_plan_drew_is_replaced(filled: Filled, path: Path, undisturbed: Path, content: Content) -> None:
    filled(path)
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE batch SET plan = 'of old'")
        connection.execute("PRAGMA user_version = 0")  # as of a file without a seal
    filled(path)
    assert content(path) == content(undisturbed)


def test_extended_later_is_a_larger_build(filled: Filled, path: Path, tmp_path: Path, content: Content) -> None:
    small = filled(path, count=250)
    large = filled(path, count=900)
    assert small.guides < large.guides
    filled(tmp_path / "large.db", count=900)
    assert content(path) == content(tmp_path / "large.db")


def test_series_one_by_one_are_all_of_them(filled: Filled, path: Path, undisturbed: Path, content: Content) -> None:
    filled(path, count=300, series=("T.less",))
    assert {row[0] for row in content(path)["batch"]} == {"T.less"}
    filled(path)
    assert content(path) == content(undisturbed)


def test_progress_counts_what_is_in_the_file(filled: Filled, path: Path, content: Content) -> None:
    reports: list[Progress] = []
    last = filled(path, report=reports.append)
    there = content(path)
    assert reports[-1] == last
    assert last.guides == len(there["guide"]) == pytest.approx(600, rel=0.05)
    assert last.rows == sum(len(there[table]) for table in ("mechanism", "guide", "reach"))
    assert [r.guides for r in reports] == sorted(r.guides for r in reports)
    assert last.rate == pytest.approx(last.rows / last.seconds)
    assert (last.series, last.failed) == ("", ())
    again = filled(path)
    assert (again.rows, again.guides, again.rate) == (0, last.guides, 0.0)


def test_places_in_the_coverage_order_follow_each_other(undisturbed: Path) -> None:
    query = (
        "SELECT group_concat(g.cover) FROM guide g JOIN mechanism m ON m.id = g.mechanism_id"
        " WHERE m.batch_id IS NOT NULL GROUP BY m.series, m.member, g.kind"
    )
    with closing(sqlite3.connect(undisturbed)) as connection:
        orders = [[int(n) for n in text.split(",")] for (text,) in connection.execute(query)]
        differ = "SELECT count(*) FROM reach r JOIN guide g ON g.id = r.guide_id WHERE r.cover <> g.cover"
        assert connection.execute(differ).fetchone() == (0,)
    assert len(orders) >= 4
    assert all(sorted(one) == list(range(len(one))) for one in orders)


def test_interrupted_build_is_finished_as_it_was_begun(
    filled: Filled, path: Path, registry: Registry, tmp_path: Path, content: Content
) -> None:
    with pytest.raises(Interrupted):
        filled(path, count=250, series=("T.less",), seed=7, report=after(1))
    with Catalogue(Database.open(path), registry.folders) as opened:
        assert not opened.complete
        opened.build()
        assert opened.complete
    filled(tmp_path / "straight.db", count=250, series=("T.less",), seed=7)
    assert content(path) == content(tmp_path / "straight.db")


def test_member_without_guides_is_given_up_once(rude: Registry, filled: Filled, path: Path, content: Content) -> None:
    for _ in range(2):
        assert filled(path, series=("R.empty",), registry=rude).guides == 0
        assert len(content(path)["batch"]) == 8


@pytest.mark.parametrize(
    ("failing", "complete"),
    [
        (
            {
                "R.raises": "ZeroDivisionError: first line",
                "R.exits": "SystemExit: enough",
                "R.ends": "the worker process of R.ends ended with exit code 7",
                "R.few": r"PluginError: four-bar general: pivots have shape \(7, .* n = 1024",
                "R.refused": "IntegrityError: CHECK constraint failed: ck_guide_contact_order",
            },
            "yes",
        ),
        # the system may do better
        (
            {"R.killed": "the worker process of R.killed was killed by SIGKILL, 3 times: .* fewer processes"},
            "no",
        ),
    ],
)
def test_series_that_fail_are_reported_and_the_others_are_complete(
    filled: Filled,
    path: Path,
    rude: Registry,
    undisturbed: Path,
    content: Content,
    failing: dict[str, str],
    complete: str,
) -> None:
    count = 600 + 225 * len(failing)  # 600 are the share of the others
    with pytest.warns(PluginWarning) as told:
        last = filled(path, count=count, series=(FEW[0], *failing, FEW[1]), registry=rude)
    for (code, reason), warned, failed in zip(failing.items(), told, last.failed, strict=True):
        assert re.search(rf"plugin rude .*: {code} four-bar general is left out: {reason}$", str(warned.message))
        assert re.fullmatch(f"rude: {reason}", failed)
    found, expected = content(path), content(undisturbed)
    for table in ("batch", "mechanism", "guide", "reach", "index"):
        assert found[table] == expected[table], table
    with Database.open(path) as database:
        assert database.get_setting("complete") == complete


def test_member_that_fails_leaves_the_other_members(filled: Filled, path: Path, rude: Registry) -> None:
    with pytest.warns(PluginWarning, match="R.half four-bar raises is left out"):
        assert filled(path, count=200, series=("R.half",), registry=rude).guides >= 100


def test_two_builds_of_one_file_meet_with_a_clear_line(filled: Filled, path: Path) -> None:
    def report(_: Progress) -> None:
        filled(path)

    with pytest.raises(DatabaseError, match=r"some\.db is being filled by another process: wait"):
        filled(path, report=report)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"series": ["T.few", "T.new"]}, "unknown series T.new; there are .*T.few"),
        ({"count": 0}, "count must be at least 1"),
        ({"seed": -1}, "seed must be at least 0"),
        ({"processes": 0}, "processes must be at least 1, not 0"),
    ],
)
def test_impossible_build_is_refused_before_anything_is_written(
    path: Path, registry: Registry, content: Content, options: dict[str, Any], message: str
) -> None:
    with Database.open(path) as database, pytest.raises(InvalidRequest, match=message):
        fill(database, registry, **options)
    assert content(path)["setting"] == []


def command(path: Path, environment: dict[str, str], *options: str) -> subprocess.Popen[str]:
    chosen = [word for code in FEW for word in ("--series", code)]
    return subprocess.Popen(
        [sys.executable, "-m", "catalogue", "build", "--db", str(path), *chosen, *options],
        env=environment, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, preexec_fn=_interruptible,
    )  # fmt: skip


def _interruptible() -> None:
    """Let Ctrl-C through, which a shell keeps from what it runs in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def test_command_builds_and_then_has_nothing_to_do(
    path: Path, environment: dict[str, str], undisturbed: Path, content: Content
) -> None:
    with command(path, environment, "--count", "600") as process:
        output, messages = process.communicate()
    assert process.returncode == 0, messages
    assert output == ""
    assert "guides" in messages
    assert "rows/s" in messages
    assert content(path) == content(undisturbed)
    with command(path, environment) as process:  # as many as before
        output, messages = process.communicate()
    assert (process.returncode, output) == (0, "")
    assert messages.splitlines()[-1].startswith("nothing to do: ")


def test_command_ends_on_ctrl_c_and_goes_on_later(
    path: Path, environment: dict[str, str], undisturbed: Path, content: Content, all_gone: Any
) -> None:
    with command(path, environment, "--count", "600") as process:
        wait_for_batches(path, 2)
        process.send_signal(signal.SIGINT)
        output, messages = process.communicate(timeout=20)
    assert process.returncode == 130
    assert output == ""
    assert messages.splitlines()[-1] == "catalogue: interrupted; what was finished is kept"
    assert "Traceback" not in messages
    all_gone(5)
    Database.open(path, create=False).close()
    done = len(content(path)["batch"])
    assert done >= 2
    with command(path, environment, "--count", "600") as process:
        _, messages = process.communicate()
    assert process.returncode == 0, messages
    assert len(content(path)["batch"]) > done
    assert content(path) == content(undisturbed)


def wait_for_batches(path: Path, count: int) -> None:
    end = time.monotonic() + 30
    while time.monotonic() < end:
        if path.exists():
            with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)) as connection:
                try:
                    (found,) = connection.execute("SELECT count(*) FROM batch").fetchone()
                except sqlite3.OperationalError:  # no tables yet
                    found = 0
            if found >= count:
                return
        time.sleep(0.01)
    raise AssertionError(f"no {count} batches in time")
