"""SVG and HTML that nothing unescaped can enter: elements are built, and whatever else is text.

`Markup` is the type of a finished piece.  Every operation of `str` on one, a format string too, returns plain text, and
`element` escapes plain text: what was put together elsewhere shows its tags, it never runs.  Only this module makes
`Markup` (`tests/test_markup.py`); templates take it by its method ``__html__``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape
from string import Template

#: Characters that no XML document may hold (XML 1.0, section 2.2): controls, halves of characters, non-characters.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ELEMENT = re.compile("[a-zA-Z][a-zA-Z0-9]*")
#: Names of attributes; one that begins with "on" holds a script.
_ATTRIBUTE = re.compile("(?!on)[a-zA-Z][a-zA-Z0-9-]*", re.IGNORECASE)
#: Attributes that hold an address.
_ADDRESSES = ("href", "src", "action")
#: Addresses that load a page or a picture: without a scheme, of the web, or with all of their data.
_HARMLESS = re.compile(r"(?![a-z][a-z0-9+.-]*:)|https?:|data:(image/png;|,)", re.IGNORECASE)
#: Characters that a browser leaves out of an address.
_IGNORED = re.compile("[\\x00-\\x20]")
#: Elements whose text HTML does not unescape.
_RAW = ("style", "script")
#: Elements that need no end where they are empty: those of HTML that may have none, and shapes of SVG.
_CLOSED = (
    *("br", "img", "input", "link", "meta"),
    *("animate", "animateTransform", "circle", "g", "line", "path", "polyline", "rect"),
)


class Markup(str):
    """A finished piece of SVG or HTML."""

    __slots__ = ()

    def __html__(self) -> str:
        """Return it as it stands: how a template asks for what is escaped already."""
        return str(self)

    def __add__(self, other: str) -> Markup:
        """Return it with another piece, or with a text, after it."""
        return join((self, other))


#: No piece.
NOTHING = Markup()


def join(parts: Iterable[str], between: str = "") -> Markup:
    """Return pieces and texts one after another, texts escaped."""
    return Markup(_safe(between).join(map(_safe, parts)))


def element(name: str, *content: str, **attributes: object) -> Markup:
    """Return an element; texts in it are escaped.

    Parameters
    ----------
    name : str
    *content : str
        Elements (`Markup`) and texts.  A ``style`` or ``script`` holds a text without ``<`` and ``&``.
    **attributes : object
        None leaves one out.  A trailing underscore of a name is dropped, others stand for hyphens.

    Raises
    ------
    ValueError
        If a name is none of an element or attribute, an attribute holds a script, or an address runs one.

    Examples
    --------
    >>> print(element("p", "1 < 2 ", element("b", "true"), class_="sum"))
    <p class="sum">1 &lt; 2 <b>true</b></p>
    """
    if not _ELEMENT.fullmatch(name):
        raise ValueError(f"{name!r} is no name of an element")
    told = "".join(
        _attribute(key.rstrip("_").replace("_", "-"), str(value))
        for key, value in attributes.items()
        if value is not None
    )
    inner = _raw("".join(content)) if name in _RAW else join(content)
    if not inner and name in _CLOSED:
        return Markup(f"<{name}{told}/>")
    return Markup(f"<{name}{told}>{inner}</{name}>")


def fill(template: str, **content: str) -> Markup:
    """Return a page: a template of ours with ``$names``, for which pieces and escaped texts are put."""
    return Markup(Template(template).substitute({name: _safe(part) for name, part in content.items()}))


def _safe(part: str) -> str:
    return part if isinstance(part, Markup) else escape(_FORBIDDEN.sub("\ufffd", part), quote=False)


def _attribute(name: str, value: str) -> str:
    if not _ATTRIBUTE.fullmatch(name):
        raise ValueError(f"{name!r} is no name of an attribute")
    if name in _ADDRESSES and not _HARMLESS.match(_IGNORED.sub("", value)):
        raise ValueError(f"{value!r} is no address of a page or picture")
    return f' {name}="{escape(_FORBIDDEN.sub(chr(0xFFFD), value))}"'


def _raw(text: str) -> str:
    if "<" in text or "&" in text:
        raise ValueError("a style or script must hold neither < nor &")
    return text
