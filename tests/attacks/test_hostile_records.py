"""Hostile texts in every field of a record: refused at the door; past it, text in every picture, page, file and script.

What is made of a hostile record has the elements, statements and cells of what is made of an honest one: none of its
texts became any.
"""

from __future__ import annotations

import ast
import csv
import io
import json
import re
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from dataclasses import fields, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

import catalogue
from catalogue import InvalidRequest
from catalogue.cli.serve import wish_form
from catalogue.cli.tables import print_csv
from catalogue.draw.cards import cards_html, guide_html
from catalogue.draw.datasheet_html import sheet_html
from catalogue.draw.moving import moving_svg
from catalogue.draw.moving_file import moving_file
from catalogue.export import export
from catalogue.guides import codes
from catalogue.guides.codes import code_of, text_of
from catalogue.guides.codes import record as record_of
from catalogue.guides.placed import PlacedGuide
from catalogue.guides.results import Found
from catalogue.html_table import html_table
from catalogue.web import guides
from catalogue.web.application import application
from catalogue.web.desk import Thread
from tests.draw.samples import ARC, DWELL, MADE, OWN

HOSTILE = [
    "<script>alert(1)</script>",
    "</title></style></svg><script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "' onload='alert(1)",
    "]]><!--<?xml?>&lt;b&gt;&#60;",
    "javascript:alert(1)",
    "$title ${light} {{7*7}} {series} %s $\\write18{x}$",
    '=HYPERLINK("http://x","y")',
    "+1+cmd|' /C calc'!A0",
    "@SUM(1+1)*cmd|' /C calc'!A0",
    '"""\nimport os\nos.abort()\n"""',
    "'+__import__('os').abort()+'",
    "0\nEOF\n0\nSECTION",
    "\x00\x1b[2J\u202e\ufffe",
]
TEXTS = pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))


def names_of(one: Any) -> list[str]:
    """Return the fields of an answer that hold text."""
    return [f.name for f in fields(one) if isinstance(getattr(one, f.name), str)]


def hostile(one: Any, text: str) -> Any:
    """Return an answer all of whose texts are another one, as if it had come past the door."""
    return replace(one, **dict.fromkeys(names_of(one), text))


STRETCH = catalogue.guide(
    {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}
).measure(stroke=120.0)[0]
GUIDES: dict[str, Any] = {"candidate": MADE["four-bar"], "arc": ARC, "stretch": STRETCH, "own": OWN, "dwell": DWELL}


class Skeleton(HTMLParser):
    """The elements of a page with the names of their attributes; HTML as a browser reads it, never an error."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, ...]] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, *sorted(name for name, _ in attrs)))
        for name, value in attrs:
            assert not name.startswith("on")
            if name in ("href", "src", "action", "content"):
                assert not re.match(r"\s*javascript:", value or "", re.IGNORECASE)

    def handle_endtag(self, tag: str) -> None:
        self.found.append(("/", tag))

    def handle_comment(self, data: str) -> None:
        self.found.append(("!", data))


DRAWINGS: dict[str, Callable[[PlacedGuide], str]] = {
    "moving": lambda one: moving_svg(one, prefix="a-"),
    "file": lambda one: moving_file(one, code="a code"),
    "card": lambda one: re.sub(r"guide-\d+-", "", guide_html(one)),
    "cards": lambda one: re.sub(r"guide-\d+-", "", cards_html([one, one], "two of them")),
    "answers": lambda one: re.sub(r"guide-\d+-", "", Found([one])._repr_html_()),  # type: ignore[list-item]  # any guide
}


def elements(picture: str) -> list[tuple[str, ...]]:
    """Return the elements of a picture, as XML, with the names of their attributes and the texts of scripts."""
    tree = ET.fromstring(f"<div>{picture}</div>")
    return [(part.tag, *sorted(part.attrib), str(part.tag.endswith("}script") and part.text)) for part in tree.iter()]


@pytest.mark.slow
@pytest.mark.parametrize("which", ["stretch", "own", "dwell"])
@pytest.mark.parametrize("name", list(DRAWINGS))
def test_a_picture_has_the_elements_of_an_honest_one(which: str, name: str) -> None:
    one, draw = GUIDES[which], DRAWINGS[name]
    right = draw(hostile(one, "honest"))
    for text in HOSTILE:
        made = draw(hostile(one, text))
        assert elements(made) == elements(right), text
        assert Skeleton(made).found == Skeleton(right).found, text


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.text(max_size=30), st.sampled_from(["moving", "card"]))
def test_no_text_at_all_becomes_an_element(text: str, name: str) -> None:
    text = text or "x"
    one = GUIDES["candidate"]
    assert Skeleton(DRAWINGS[name](hostile(one, text))).found == Skeleton(DRAWINGS[name](hostile(one, "x"))).found


@pytest.mark.slow
@pytest.mark.parametrize("which", ["candidate", "own", "dwell"])
@TEXTS
def test_a_sheet_has_the_elements_of_an_honest_one(which: str, text: str) -> None:
    one = GUIDES[which]
    assert Skeleton(sheet_html(hostile(one, text))).found == Skeleton(sheet_html(hostile(one, "honest"))).found


@pytest.mark.slow
@pytest.mark.parametrize("which", ["candidate", "own", "dwell"])
@pytest.mark.parametrize("text", [HOSTILE[k] for k in (0, 3, 6, 12)], ids=range(4))
def test_stills_and_curves_are_whole_and_hold_no_script(which: str, text: str, tmp_path: Path) -> None:
    one = hostile(GUIDES[which], text)
    for draw, file in ((one.plot, "still.svg"), (one.plot_curves, "curves.svg")):
        draw(tmp_path / file)
        for part in ET.parse(tmp_path / file).getroot().iter():
            assert not part.tag.endswith("}script")
            assert not any(name.lower().startswith("on") for name in part.attrib)
            assert not any("javascript:" in value and "href" in name for name, value in part.attrib.items())
    one.plot(tmp_path / "still.pdf")
    assert not re.search(rb"/(JavaScript|JS|Launch|OpenAction)\b", (tmp_path / "still.pdf").read_bytes())


def statements(source: str) -> str:
    """Return a script without its texts, as Python reads it."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            node.value = ""
    return ast.dump(tree)


@pytest.mark.slow
@pytest.mark.parametrize("which", ["candidate", "own", "dwell"])
@pytest.mark.parametrize("text", [HOSTILE[k] for k in (0, 6, 7, 10, 11, 12)], ids=range(6))
def test_no_export_is_broken_out_of(which: str, text: str) -> None:
    one, honest = hostile(GUIDES[which], text), hostile(GUIDES[which], "honest")
    for kind in ("freecad", "pylinkage"):
        if kind == "pylinkage" and which not in ("candidate", "stretch"):  # it makes none of the others
            continue
        assert statements(str(export(one, format=kind))) == statements(str(export(honest, format=kind)))
    for kind in ("dxf", "solidworks", "csv", "fusion"):
        made, right = str(export(one, format=kind)), str(export(honest, format=kind))
        assert len(made.splitlines()) == len(right.splitlines())
    json.loads(str(export(one, format="json")))
    for kind in ("csv", "fusion"):
        for row in csv.reader(io.StringIO(str(export(one, format=kind)))):
            assert not any(cell[:1] in ("=", "@", "\t", "\r") or re.match(r"[+-](?!\d|$|inf)", cell) for cell in row)
    pytest.importorskip("xlsxwriter", reason="xlsxwriter is not installed")
    with zipfile.ZipFile(io.BytesIO(export(one, format="xlsx"))) as book:  # type: ignore[arg-type]  # bytes
        assert b"<f>" not in book.read("xl/worksheets/sheet1.xml")


@pytest.mark.parametrize("text", HOSTILE[7:10])
def test_no_cell_that_is_printed_begins_a_formula(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    print_csv(["name", "value"], [[text, -3.5], ["-3.5", "-12.5° → 70°"], ["-", ""]])
    rows = [*csv.reader(io.StringIO(capsys.readouterr().out))]
    assert rows[1] == ["'" + text, "-3.5"]
    assert rows[2:] == [["-3.5", "-12.5° → 70°"], ["-", ""]]


@TEXTS
def test_tables_of_a_notebook_hold_text(text: str) -> None:
    made = html_table(["a", ">b"], [[text, None]])
    assert Skeleton(made).found == Skeleton(html_table(["a", ">b"], [["x", None]])).found


@pytest.mark.slow
@TEXTS
def test_a_page_has_the_elements_of_an_honest_one(
    small_db: Path, small: catalogue.Catalogue, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: dict[str, list[Any]] = {}
    page = application(small_db, wish_form([*small.registry.series]), tokens=["t"], make=Thread)
    with TestClient(page, base_url="http://127.0.0.1") as client:
        client.get("/?token=t")
        for said in (text, "honest"):
            one = hostile(GUIDES["stretch"], said)
            monkeypatch.setattr(guides, "pick", lambda _, one=one: (one, None))
            for path in (f"/guide/{len(said)}", f"/compare?pick={len(said)}", f"/guide/{len(said)}/sheet"):
                got = client.get(path)
                assert got.status_code == 200
                found.setdefault(path.replace(str(len(said)), ""), []).append(Skeleton(got.text).found)
            asked = {"path": said, "stroke": said, "rank_by": said, "series": said, "keep_out": said, "pick": said}
            for path in ("/", "/answers", "/own", "/compare"):
                got = client.get(path, params={**asked, "linkage": said})
                found.setdefault(path, []).append([part for part in Skeleton(got.text).found if part[0] == "script"])
    for path, (one, honest) in found.items():
        assert one == honest, path


@pytest.fixture
def held(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, dict[str, Any]]:
    """Return honest records; what is kept lies in a file of its own."""
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "answers.db"))
    return {name: record_of(GUIDES[name]) for name in ("stretch", "own", "dwell")}


def saved(record: dict[str, Any], path: Path, code: str | None) -> Path:
    one = record if code is None else {"code": code, **record}
    path.write_text(json.dumps({"format": codes.FORMAT, "version": "0", "answers": [one]}))
    return path


@pytest.mark.parametrize("which", ["stretch", "own", "dwell"])
def test_a_record_without_its_digest_is_refused_in_one_line(
    held: dict[str, dict[str, Any]], which: str, tmp_path: Path
) -> None:
    right = code_of(text_of(held[which]))
    assert catalogue.load(saved(held[which], tmp_path / "a.json", right)) == [GUIDES[which]]
    for wrong in (None, "", right[0], right[:6], right[:-1] + "z", "abcdefgh", 7):
        with pytest.raises(InvalidRequest, match=r"^an answer is damaged: .*(no code|not that of its code)") as told:
            catalogue.load(saved(held[which], tmp_path / "a.json", wrong))  # type: ignore[arg-type]
        assert len(str(told.value)) < 150


@TEXTS
@pytest.mark.parametrize("which", ["stretch", "dwell"])
def test_a_hostile_record_with_a_good_digest_is_refused_by_its_names(
    held: dict[str, dict[str, Any]], which: str, text: str, tmp_path: Path
) -> None:
    for name in ("family", "series", "configuration"):
        record = held[which] | {name: text}
        path = saved(record, tmp_path / "a.json", code_of(text_of(record)))
        with pytest.raises(InvalidRequest, match=r"damaged|must be") as told:
            catalogue.load(path)
        assert str(told.value).isprintable()


def test_names_of_series_of_plugins_pass_the_door(held: dict[str, dict[str, Any]], tmp_path: Path) -> None:
    for series in ("II*.xoy", "my_x0", "A-1+b'", ""):
        record = held["dwell"] | {"series": series}
        [one] = catalogue.load(saved(record, tmp_path / "a.json", code_of(text_of(record))))
        assert one.series == series


def test_what_is_refused_is_neither_drawn_nor_kept(held: dict[str, dict[str, Any]], tmp_path: Path) -> None:
    from click.testing import CliRunner

    from catalogue.cli import app

    path = saved(held["stretch"] | {"series": HOSTILE[0]}, tmp_path / "a.json", None)
    done = CliRunner().invoke(app, ["show", str(path), "--plot", str(tmp_path / "x.svg"), "--moving"])
    assert done.exit_code != 0
    assert isinstance(done.exception, InvalidRequest)
    assert not (tmp_path / "x.svg").exists()
    assert not (tmp_path / "answers.db").exists()
