"""Answers and the seal of the catalogue, in any order of keeping, recalling, damaging, building: what always holds."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections import OrderedDict
from contextlib import closing, suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule, run_state_machine_as_test

import catalogue
from catalogue.guides import codes

#: Answers that the file keeps here, few, so that they are dropped often.
KEPT = 6
TEXTS = st.integers(0, 30).map(lambda k: f'{{"answer": {k}}}')


class Machine(RuleBasedStateMachine):
    """One file of answers beside one sealed catalogue; the model is an ordered dictionary."""

    source: Path

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.answers, self.store = self.folder / "answers.db", self.folder / "some.db"
        shutil.copy(self.source, self.store)
        self.patch = pytest.MonkeyPatch()
        self.patch.setenv("CATALOGUE_ANSWERS", str(self.answers))
        self.patch.setattr(codes, "CODES", codes.CODES._replace(kept=KEPT))
        self.held: OrderedDict[str, str] = OrderedDict()
        self.changed = False

    def teardown(self) -> None:
        self.patch.undo()
        shutil.rmtree(self.folder)

    @rule(texts=st.lists(TEXTS, min_size=1, max_size=4, unique=True), times=st.integers(1, 20))
    def keep(self, texts: list[str], times: int) -> None:
        for _ in range(times):
            found = codes.keep(texts)
        assert found == [codes.code_of(text) for text in texts]
        for code, text in zip(found, texts, strict=True):
            self.held.pop(code, None)
            self.held[code] = text
        while len(self.held) > KEPT:
            self.held.popitem(last=False)

    @rule()
    def forget_the_mark(self) -> None:
        """As a file written before there was one."""
        if self.answers.exists():
            with closing(sqlite3.connect(self.answers)) as file, file:
                file.execute("PRAGMA application_id = 0")

    @rule(at=st.integers(0, 99), byte=st.integers(0, 255))
    def damage_for_a_while(self, at: int, byte: int) -> None:
        """The user puts the whole file back after an attempt that may fail, but only in words."""
        if not self.answers.exists():
            return
        before = self.answers.read_bytes()
        self.answers.write_bytes(before[:at] + bytes([byte]) + before[at + 1 :])
        for ask in (lambda: codes.stored_record("abcdefg"), lambda: codes.keep(["{}"])):
            with suppress(catalogue.InvalidRequest):
                ask()
        for file in self.folder.glob("answers.db*"):
            file.unlink()
        self.answers.write_bytes(before)

    @precondition(lambda self: not self.changed)
    @rule()
    def change_the_catalogue(self) -> None:
        with closing(sqlite3.connect(self.store)) as file, file:
            file.execute("UPDATE reach SET size = size * 10")
        self.changed = True

    @precondition(lambda self: self.changed)
    @rule()
    def put_the_catalogue_back(self) -> None:
        shutil.copy(self.source, self.store)
        self.changed = False

    @rule()
    def build(self) -> None:
        before = self.store.read_bytes()
        with catalogue.open(self.store, build=False) as cat:
            if not self.changed:
                assert cat.complete
                cat.database.check()
                return
            with pytest.raises(catalogue.DatabaseError, match="damaged"):
                cat.build()
        assert self.store.read_bytes() == before  # not made good

    @invariant()
    def what_was_kept_last_is_recalled_and_nothing_else(self) -> None:
        for code, text in self.held.items():
            assert codes.stored_record(code) == text
        for k in range(31):
            code = codes.code_of(f'{{"answer": {k}}}')
            assert (codes.stored_record(code) is None) == (code not in self.held)


@pytest.mark.slow
def test_answers_and_seal_hold_whatever_is_done_in_any_order(small_db: Path) -> None:
    Machine.source = small_db
    check = settings(max_examples=15, stateful_step_count=15, deadline=None, suppress_health_check=[*HealthCheck])
    run_state_machine_as_test(Machine, settings=check)
