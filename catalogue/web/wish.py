"""The request form: options of `find` as fields, and addresses parsed like command lines."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from inspect import signature
from typing import TYPE_CHECKING, Any, NamedTuple

import click
import numpy as np

from ..api import Catalogue
from ..errors import CatalogueError, InvalidRequest, quoted, shortened
from ..find.names import SINGULAR
from ..guides.codes import is_code
from ..problem.constraints import PRESCRIBED, REGIONS, Constraints
from ..problem.problem import Request
from ..quantities import DRIVE, LENGTHS, TRANSMISSIONS
from ..units import ASSUMED, MILLIMETRES

if TYPE_CHECKING:
    from ..find.explain import Relaxation

#: Function that converts the name and options of a command to a request and the codes of its
#: starts.
Read = Callable[[str, dict[str, Any]], tuple[Request, tuple[str, ...]]]
#: Options of the path.
PATH = ("stroke", "deviation", "radius", "angle", "from", "to", "along")
#: Options of the ranking that are not keywords of `Catalogue.find`.
RANKING = ("pareto",)
#: Keywords set by the page itself: it shows stored guides first, then refined ones.
PAGE_KEYWORDS = ("refine",)
#: Names in an address that are not fields: kind of path, unit of length, shortlist, stage of the
#: search.
OTHER_NAMES = ("path", "unit", "pick", "stage")
#: Fields by group; all other fields are in the last group.
GROUPS = {
    "Path": PATH,
    "Kind": ("family", "series", "configuration", "order", "pins_only", "slots", "returns"),
    "Place": (*REGIONS, "keep_out", *PRESCRIBED, "within"),
    "Size": LENGTHS,
    "Drive": (*(row.name for row in TRANSMISSIONS), "full_rotation", *DRIVE),
    "Choice": (),
}
#: Fields before the groups: the most frequent ones.
FREQUENT_FIELDS = ("min_transmission", "max_size", "fixed_pivots_in", "pins_only")
#: Upper bounds of fields that lengthen a search: with both a search takes about 15 s.
MOST = {"effort": 4, "limit": 48}


class FormLimits(NamedTuple):
    """Limits of the values of a form."""

    #: Longest value of a field [characters]: `max_corners` corners of 25 characters, and some
    #: reserve.
    longest: int = 2000
    #: Largest number of keep-out zones: a search tests each link against each side in every pose.
    max_zones: int = 12
    max_corners: int = 60  #: largest number of corners of all zones, which bounds the time of these tests
    max_values: int = 40  #: largest number of values of a field that may be repeated: more than there are series


FORM = FormLimits()


class WishError(InvalidRequest):
    """An invalid request of the form, with the name of its faulty field, if any."""

    def __init__(self, text: str, field: str = "") -> None:
        super().__init__(text)
        self.field = field


@dataclass(frozen=True)
class Field:
    """A field of the form, derived from an option of the command."""

    name: str
    flag: str
    help: str
    kind: str  #: switch, choice, choices, lines, numbers, number or text
    unit: str  #: length, °, or none
    metavar: str
    default: str
    choices: tuple[str, ...]
    slider: str  #: range of the slider: length (in strokes), acute, turn, share; empty for none

    @property
    def label(self) -> str:
        """The flag in words."""
        return self.flag.removeprefix("--").replace("-", " ").capitalize()

    @classmethod
    def of(cls, option: click.Option, choices: Mapping[str, Sequence[str]]) -> Field:
        name, metavar = str(option.name), option.metavar or ""
        unit = "°" if metavar == "DEG" else ""
        if metavar in ("L", "R") or name == "deviation":
            unit = "length"
        known = tuple(choices.get(name, ()))
        if option.is_flag:
            kind = "switch"
        elif option.multiple:
            kind = "choices" if known else "lines"
        elif option.nargs > 1:
            kind = "numbers"
        else:
            kind = "number" if unit or metavar == "X" else "choice" if known else "text"
        slider = ""
        if kind == "number" and name not in ("within", "play", "round_to", "along", "radius", "angle"):
            acute = "transmission" in name
            slider = {"length": "length", "°": "acute" if acute else "turn"}.get(unit, "share")
        given = option.show_default if isinstance(option.show_default, str) else option.default
        default = "" if option.multiple or not isinstance(given, str | int | float) or not given else str(given)
        return cls(
            name,
            max(option.opts, key=len),
            option.help or "",
            kind,
            unit,
            metavar,
            default,
            known,
            "deviation" if name == "deviation" else slider,
        )


@dataclass(frozen=True)
class Wish:
    """A valid request of the form, for `Catalogue.find`."""

    command: str
    request: Request
    starts: tuple[str, ...]  #: codes of answers
    arguments: tuple[str, ...]

    @property
    def line(self) -> str:
        """The equivalent command line."""
        return shlex.join(["catalogue", "find", self.command, *self.arguments])


def unit_shown(unit: str) -> str:
    """Return the unit in an address, or `ASSUMED` for a missing or unknown one."""
    return unit if unit in MILLIMETRES else ASSUMED


def _check_zones(regions: Sequence[Any]) -> None:
    """Refuse more zones or corners than the page permits."""
    corners = sum(np.size(region) // 2 for region in regions)
    if len(regions) > FORM.max_zones or corners > FORM.max_corners:
        what = f"at most {FORM.max_zones} zones with {FORM.max_corners} corners in all"
        raise WishError(f"{what} on this page; the command takes more", "keep_out")


class Form:
    """The form: fields derived from the options of commands; parses addresses.

    Parameters
    ----------
    commands : mapping of str to click.Command
        Commands by the name of the path.
    read : callable
        See `Read`.
    choices : mapping of str to sequence of str
        Permitted values by the name of an option.
    """

    def __init__(self, commands: Mapping[str, click.Command], read: Read, choices: Mapping[str, Sequence[str]]) -> None:
        self.commands, self._read = dict(commands), read
        find = [name for name, one in signature(Catalogue.find).parameters.items() if one.kind is one.KEYWORD_ONLY]
        known = {SINGULAR.get(one.name, one.name) for one in fields(Constraints)}
        known |= {*find, *PATH, *RANKING} - {*PAGE_KEYWORDS}
        options = [
            one
            for command in commands.values()
            for one in command.params
            if one.name in known and isinstance(one, click.Option)
        ]
        self.fields = {str(one.name): Field.of(one, choices) for one in options}

    @property
    def groups(self) -> dict[str, list[Field]]:
        """Fields by group, without those of `FREQUENT_FIELDS`."""
        group = {name: title for title, names in GROUPS.items() for name in names}
        found: dict[str, list[Field]] = {title: [] for title in GROUPS}
        for field in self.fields.values():
            if field.name not in FREQUENT_FIELDS:
                found[group.get(field.name, "Choice")].append(field)
        return found

    def wish(self, given: Iterable[tuple[str, str]]) -> Wish:
        """Parse the query of an address.

        Raises
        ------
        WishError
            If a field is invalid.
        """
        said: dict[str, list[str]] = {}
        for name, value in given:
            said.setdefault(name, []).append(value.strip())
        name = said.get("path", ["straight-line"])[-1]
        if name not in self.commands:
            raise WishError(f"there is no path {quoted(name)}: {' or '.join(self.commands)}", "path")
        command = self.commands[name]
        arguments = [part for field in self.fields.values() for part in self._arguments(field, command, said)]
        arguments += ["--unit", unit_shown(said.get("unit", [ASSUMED])[-1])]
        if unknown := [one for one in said if one not in self.fields and one not in OTHER_NAMES]:
            raise WishError(f"there is no field {quoted(unknown[0])}")
        try:
            context = command.make_context(name, list(arguments))
            options = {k: v for k, v in context.params.items() if k in self.fields}
            for bounded, most in MOST.items():
                if (options.get(bounded) or 0) > most:
                    raise WishError(f"{bounded} is at most {most} on this page; the command takes more", bounded)
            _check_zones(options.get("keep_out") or ())
            if wrong := [code for code in options.get("starts") or () if not is_code(code)]:
                raise WishError(f"{quoted(wrong[0])} is no code of an answer", "starts")
            with context.scope(cleanup=False):  # the context holds the unit
                request, starts = self._read(name, options)
        except click.UsageError as error:
            option = getattr(error, "param", None)
            text = re.sub(r"^Invalid value for .*?: ", "", shortened(error.format_message(), 300))
            text = text.replace("is not a valid float", "is no number").replace("a valid integer", "a whole number")
            raise WishError(text, str(option.name) if option is not None else self.field_of(text)) from None
        except WishError:
            raise
        except CatalogueError as error:
            raise WishError(str(error), self.field_of(str(error))) from None
        return Wish(name, request, starts, tuple(arguments))

    def _arguments(self, field: Field, command: click.Command, said: Mapping[str, list[str]]) -> list[str]:
        """Return the command-line arguments of a field."""
        values = [value for value in said.get(field.name, []) if value]
        if not values:
            return []
        if any(len(value) > FORM.longest for value in values):
            raise WishError(f"this is longer than {FORM.longest} letters", field.name)
        option = next((one for one in command.params if one.name == field.name), None)
        if option is None:
            raise WishError(f"a {command.name} has no {field.label.lower()}: leave it empty", field.name)
        if field.kind == "switch":
            return [field.flag]
        if field.kind == "numbers":
            parts = values[-1].replace(",", " ").split()
            if len(parts) != option.nargs:
                raise WishError(f"{option.nargs} numbers are wanted, {field.metavar}, not {len(parts)}", field.name)
            return [field.flag, *parts]
        if field.kind == "lines":
            values = [line.strip() for value in values for line in value.splitlines() if line.strip()]
        if field.kind in ("lines", "choices") and len(values) > FORM.max_values:
            raise WishError(f"these are more than {FORM.max_values}; the command takes more", field.name)
        if field.kind not in ("lines", "choices"):
            values = values[-1:]
        return [part for value in values for part in (field.flag, value)]

    def field_of(self, text: str) -> str:
        """Return the name of the first field mentioned in a message, or an empty text."""
        plural = {one: many for many, one in SINGULAR.items()}
        found = {}
        for name, field in self.fields.items():
            words = {name, field.flag, plural.get(name, name)}
            if at := re.search(rf"(?<![\w-])({'|'.join(map(re.escape, sorted(words)))})(?![\w-])", text):
                found[name] = (at.start(), -len(name))
        return min(found, key=lambda name: found[name], default="")

    def relaxed(self, given: Iterable[tuple[str, str]], relaxations: Iterable[Relaxation]) -> list[tuple[str, str]]:
        """Apply relaxations to the query of an address."""
        flags = {field.flag: field for field in self.fields.values()}
        said = list(given)
        for one in relaxations:
            name = flags[one.option].name
            said = [pair for pair in said if pair[0] != name]
            if one.value:
                said.append((name, one.value))
        return said
