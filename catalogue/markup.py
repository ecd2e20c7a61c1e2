"""Build SVG and HTML with all text escaped.

`Markup` is the type of a finished piece.  Every operation of `str` on one, formatting too, returns
plain text, and `element` escapes plain text: tags concatenated elsewhere are shown, never run.
Only this module makes `Markup` (`tests/test_markup.py`); templates read it by its method
``__html__``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape
from string import Template

#: Characters forbidden in XML (XML 1.0, section 2.2): controls, lone surrogates, non-characters.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_ELEMENT = re.compile("[a-zA-Z][a-zA-Z0-9]*")
#: Permitted attribute names; names that begin with "on" would hold a script.
_ATTRIBUTE = re.compile("(?!on)[a-zA-Z][a-zA-Z0-9-]*", re.IGNORECASE)
#: Attributes that hold an address.
_ADDRESSES = ("href", "src", "action")
#: Permitted addresses: relative, of the web, or inline pictures and empty data.
_HARMLESS = re.compile(r"(?![a-z][a-z0-9+.-]*:)|https?:|data:(image/png;|,)", re.IGNORECASE)
#: Characters that browsers ignore in an address.
_IGNORED = re.compile("[\\x00-\\x20]")
#: Elements with raw text: HTML does not unescape it.
_RAW = ("style", "script")
#: Elements that close themselves when empty: void elements of HTML, and shapes of SVG.
_CLOSED = (
    *("br", "img", "input", "link", "meta"),
    *("animate", "animateTransform", "circle", "g", "line", "path", "polyline", "rect"),
)


class Markup(str):
    """A finished piece of SVG or HTML."""

    __slots__ = ()

    def __html__(self) -> str:
        """Return the markup itself: templates call this for text that needs no escaping."""
        return str(self)

    def __add__(self, other: str) -> Markup:
        """Concatenate with another piece, or with a text to escape."""
        return join((self, other))


#: Empty piece.
NOTHING = Markup()


def join(parts: Iterable[str], between: str = "") -> Markup:
    """Concatenate pieces and texts; escape the texts."""
    return Markup(_safe(between).join(map(_safe, parts)))


def element(name: str, *content: str, **attributes: object) -> Markup:
    """Build an element; escape texts in it.

    Parameters
    ----------
    name : str
    *content : str
        Elements (`Markup`) and texts.  A ``style`` or ``script`` holds a text without ``<`` and
        ``&``.
    **attributes : object
        None omits an attribute. A trailing underscore of a name is dropped, others stand for
        hyphens.

    Raises
    ------
    ValueError
        If a name is not valid for an element or attribute, an attribute holds a script, or an
        address runs one.

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
    inner = _check_raw("".join(content)) if name in _RAW else join(content)
    if not inner and name in _CLOSED:
        return Markup(f"<{name}{told}/>")
    return Markup(f"<{name}{told}>{inner}</{name}>")


def fill(template: str, **content: str) -> Markup:
    """Substitute pieces and escaped texts for the ``$names`` of a template."""
    return Markup(Template(template).substitute({name: _safe(part) for name, part in content.items()}))


def _safe(part: str) -> str:
    return part if isinstance(part, Markup) else escape(_FORBIDDEN.sub("\ufffd", part), quote=False)


def _attribute(name: str, value: str) -> str:
    if not _ATTRIBUTE.fullmatch(name):
        raise ValueError(f"{name!r} is no name of an attribute")
    if name in _ADDRESSES and not _HARMLESS.match(_IGNORED.sub("", value)):
        raise ValueError(f"{value!r} is no address of a page or picture")
    return f' {name}="{escape(_FORBIDDEN.sub(chr(0xFFFD), value))}"'


def _check_raw(text: str) -> str:
    if "<" in text or "&" in text:
        raise ValueError("a style or script must hold neither < nor &")
    return text
