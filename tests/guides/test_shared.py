"""A folder of answers that a team shares."""

from __future__ import annotations

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from catalogue import Catalogue, StraightLine, recall
from catalogue.errors import InvalidRequest
from catalogue.guides import codes
from catalogue.guides.shared import SharedFolder

LINE = StraightLine(150, 0.5)


@pytest.fixture
def team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a shared folder of somebody with an answers file of his own."""
    folder = tmp_path / "team"
    folder.mkdir()
    monkeypatch.setenv("CATALOGUE_SHARE", str(folder))
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "mine.db"))
    return folder


@pytest.mark.slow
def test_another_user_finds_an_answer_by_its_code(
    small: Catalogue, team: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = small.find(LINE, limit=3, refine=False)
    mine = found.remember()
    assert sorted(file.name for file in team.iterdir()) == sorted(f"{code}.json" for code in mine)
    assert all(json.loads(file.read_text()) for file in team.iterdir())
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "other.db"))
    assert [recall(code) for code in mine] == list(found)
    monkeypatch.delenv("CATALOGUE_SHARE")
    with pytest.raises(InvalidRequest, match="--share DIR"):
        recall(mine[0])


@pytest.mark.slow
def test_an_address_is_shared_as_a_folder_is(small: Catalogue, team: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("fsspec")
    monkeypatch.setenv("CATALOGUE_SHARE", "memory://team/answers")
    found = small.find(LINE, limit=1, refine=False)
    (code,) = found.remember()
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(team / "other.db"))
    assert recall(code) == found[0]
    assert SharedFolder("memory://team/answers").read("a" * 7) is None
    with pytest.raises(InvalidRequest, match="cannot be shared in nothing://x"):
        SharedFolder("nothing://x").check()


def test_what_is_not_the_text_of_its_code_is_refused(team: Path) -> None:
    (code,) = codes.keep(['{"a": 1}'])
    for other in ('{"a": 2}', ""):
        (team / f"{code}.json").write_text(other)
        Path(team.parent / "mine.db").unlink(missing_ok=True)
        with pytest.raises(InvalidRequest, match=f"the shared answer {code} is damaged"):
            codes.stored_record(code)
    (team / f"{code}.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidRequest, match="cannot be read"):
        codes.stored_record(code)


def test_two_records_of_one_code_have_two(team: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def alike(text: str, length: int = codes.CODES.length) -> str:
        return ("a" * codes.CODES.length + text * length)[:length]

    monkeypatch.setattr(codes, "code_of", alike)
    assert codes.keep(["x"]) == ["aaaaaaa"]
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(team.parent / "other.db"))
    assert codes.keep(["y", "x"]) == ["aaaaaaay", "aaaaaaa"]
    assert (codes.stored_record("aaaaaaa"), codes.stored_record("aaaaaaay")) == ("x", "y")


def test_eight_write_at_once(team: Path) -> None:
    texts = [json.dumps({"number": i % 5}) for i in range(40)]
    shared = SharedFolder(str(team))
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda text: shared.write(codes.code_of(text), text), texts))
    assert len([*team.iterdir()]) == 5
    assert all(codes.code_of(file.read_text()) == file.stem for file in team.iterdir())


def test_a_folder_that_cannot_be_used_is_said_in_one_line(team: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CATALOGUE_SHARE", str(team / "none"))
    with pytest.raises(InvalidRequest, match=r"there is no folder .*none to share answers in: make it first"):
        codes.keep(["x"])
    file = team / "file"
    file.write_text("")
    monkeypatch.setenv("CATALOGUE_SHARE", str(file))
    with pytest.raises(InvalidRequest, match="cannot be read"):
        codes.keep(["x"])


@pytest.mark.slow
def test_the_command_shares_what_it_lists(small_db: Path, team: Path, tmp_path: Path) -> None:
    def run(*words: str, share: Path) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "catalogue", *words, "--db", str(small_db), "--share", str(share)]
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)

    (other := tmp_path / "other").mkdir()
    wanted = ("find", "straight-line", "--stroke", "150", "--deviation", "0.5", "--limit", "1", "--no-refine")
    done = run(*wanted, share=other)
    assert done.returncode == 0
    (file,) = other.iterdir()
    assert file.stem in done.stdout
    assert not [*team.iterdir()]
    refused = run("show", file.stem, share=tmp_path / "nowhere")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert refused.stderr.splitlines()[-1].endswith("to share answers in: make it first")
