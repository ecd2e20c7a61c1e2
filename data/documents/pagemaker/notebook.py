"""A page of Markdown as a notebook: its code in cells to run."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

_BLOCK = re.compile(r"^```(sh|python|text|toml)(?: title=\"([^\"]+)\")?\n(.*?)^```\n?", re.M | re.S)
#: Links and directives lead to other pages, which a notebook has not beside it.
_LINK = re.compile(r"\{download\}`[^`]*`|<a href=[^>]+>|</a>")


def notebook(page: str) -> str:
    """Return a page as JSON of a notebook.

    Shell commands run by ``!``, files are written by ``%%writefile``; what the page shows as output
    is left out, for the notebook prints it.
    """
    head = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    cells = [{"id": f"cell-{k}", **cell} for k, cell in enumerate(_cells(page))]
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": head, "cells": cells}, indent=1) + "\n"


def _cells(page: str) -> Iterator[dict[str, Any]]:
    end = 0
    for found in _BLOCK.finditer(page):
        yield from _prose(page[end : found.start()])
        end = found.end()
        language, title, text = found.groups()
        if title:
            yield _code(f"%%writefile {title}\n{text}")
        elif language == "sh":
            yield _code("".join(f"!{line}\n" for line in text.replace("\\\n", " ").splitlines()))
        elif language == "python":
            yield _code(text)
    yield from _prose(page[end:])


def _prose(text: str) -> Iterator[dict[str, Any]]:
    told = _LINK.sub("", text).strip()
    if told:
        yield {"cell_type": "markdown", "metadata": {}, "source": told}


def _code(text: str) -> dict[str, Any]:
    return {"cell_type": "code", "metadata": {}, "source": text.strip(), "execution_count": None, "outputs": []}
