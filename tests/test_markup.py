"""The one door of SVG and HTML: what is no finished piece is text, wherever it stands."""

from __future__ import annotations

import ast
import pickle
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import catalogue
from catalogue.markup import Markup, element, fill, join

ROOT = Path(catalogue.__file__).parent
TAG = re.compile(
    r"</?(html|head|body|title|meta|script|style|div|p|pre|b|i|a|br|img|span|section|details|summary|table|t[rdh]|h[1-6]"
    r"|svg|g|path|rect|circle|line|polyline|text|tspan|animate\w*)[ />]"
)
MODULES = [path for path in ROOT.rglob("*.py") if path != ROOT / "markup.py"]


@given(st.text(), st.text())
def test_text_in_an_element_or_attribute_is_read_back(words: str, value: str) -> None:
    root = ET.fromstring(element("p", words, element("b", words), title=value))
    allowed = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
    read = allowed.sub("\ufffd", words).replace("\r\n", "\n").replace("\r", "\n")  # as XML reads the ends of lines
    assert [one.tag for one in root.iter()] == ["p", "b"]
    assert (root.text or "", root[0].text or "") == (read, read)
    shown = re.sub("\r\n|[\t\n\r]", " ", allowed.sub("\ufffd", value))
    assert root.attrib == {"title": shown}


@pytest.mark.parametrize("mixed", [
    f"{element('b', 'x')}<script>", "<i>" + element("b", "x"), "".join([element("b", "x"), "<script>"]),
    element("b", "x").replace("b", "script"), element("b", "x").strip(),
])  # fmt: skip
def test_what_strings_make_of_a_piece_is_text_again(mixed: str) -> None:
    assert "<" not in element("p", mixed)[3:-4]


def test_pieces_stay_pieces_when_joined_and_sent_between_processes() -> None:
    piece = element("b", "1 < 2")
    assert piece + piece == "<b>1 &lt; 2</b><b>1 &lt; 2</b>"
    assert isinstance(piece + "<", Markup)
    assert piece + "<" == "<b>1 &lt; 2</b>&lt;"
    assert join((piece, "<"), "&") == "<b>1 &lt; 2</b>&amp;&lt;"
    assert element("p", pickle.loads(pickle.dumps(piece))) == "<p><b>1 &lt; 2</b></p>"
    assert fill("<p>$one $other</p>", one=piece, other="<i>") == "<p><b>1 &lt; 2</b> &lt;i&gt;</p>"


@pytest.mark.parametrize(
    ("name", "content", "attributes"),
    [
        ("p", "", {"onclick": "alert(1)"}),
        ("p", "", {"ONLOAD": "alert(1)"}),
        ("p", "", {'x="y" z': "1"}),
        ("p><script", "", {}),
        ("a", "", {"href": "javascript:alert(1)"}),
        ("a", "", {"href": " JavaScript:alert(1)"}),
        ("a", "", {"href": "java\nscript:alert(1)"}),
        ("img", "", {"src": "data:text/html,<script>alert(1)</script>"}),
        ("style", "a{}</style><script>", {}),
        ("script", "1 && 2", {}),
    ],
)
def test_what_would_run_is_refused(name: str, content: str, attributes: dict[str, str]) -> None:
    with pytest.raises(ValueError, match=r"no name of|no address|neither"):
        element(name, content, **attributes)


def strings(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the texts of a module that are no docstrings, with the identity of their node."""
    documents = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and node.body and isinstance(node.body[0], ast.Expr)
    }  # fmt: skip
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documents:
            yield id(node), node.value


def test_no_module_writes_tags_or_makes_markup_itself() -> None:
    found = []
    for path in MODULES:
        source = path.read_text("utf-8")
        if not TAG.search(source) and "Markup(" not in source:
            continue
        tree = ast.parse(source)
        pages = {
            id(node.value)
            for node in tree.body
            if isinstance(node, ast.Assign) and re.search(rf"fill\(\s*{ast.unparse(node.targets[0])}\b", source)
        }
        found += [(path, text) for node, text in strings(tree) if node not in pages and TAG.search(text)]
        found += [
            (path, str(node.lineno))
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Markup"
        ]
    assert found == []


def test_no_template_calls_a_text_safe() -> None:
    templates = [*(ROOT / "web" / "templates").iterdir()]
    assert templates
    for path in templates:
        assert not re.search(r"\|\s*safe|autoescape|Markup", path.read_text("utf-8")), path.name
