"""Check names of families, series and configurations in a request."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..errors import InvalidRequest, quoted, shortened
from ..guidance.kinds import POINTS, RETURNS, SLOTS
from ..kinematics.linkage import SLIDING
from ..problem.constraints import Constraints
from ..store import Database

SINGULAR = {"families": "family", "series": "series", "configurations": "configuration"}

#: Message for a database without guides.
EMPTY = "the database holds no guides: `catalogue build` fills it, or name another with --db"
#: Longest quoted name [characters].
LONGEST = 60
#: All kinds of guides.
KINDS = (*POINTS.values(), *SLOTS.values(), *RETURNS.values())


def option(name: str) -> str:
    """Return the command-line option of a constraint."""
    return "--" + SINGULAR.get(name, name).replace("_", "-") if " " not in name else name


def check_names(database: Database, constraints: Constraints) -> None:
    """Refuse families, series and configurations missing in the database."""
    for name, singular in SINGULAR.items():
        column = {singular: str}
        for code in getattr(constraints, name):
            if not len(database.plain(column, f"FROM mechanism WHERE {singular} = ? LIMIT 1", [code])[singular]):
                names = set(database.plain(column, "FROM mechanism")[singular])
                held = sorted(shortened(known, LONGEST) for known in names)
                if not held:
                    raise InvalidRequest(EMPTY)
                raise InvalidRequest(
                    f"the database holds no {singular} {quoted(code)}; it holds {', '.join(held)}. "
                    f"`catalogue build --series CODE` adds a series{_nearest(code, held)}"
                )


def check_kinds(kinds: Iterable[str]) -> None:
    """Refuse unknown kinds of guides."""
    for kind in kinds:
        if kind not in KINDS:
            raise InvalidRequest(f"there is no kind {kind!r}; there are {', '.join(KINDS)}{_nearest(kind, KINDS)}")


def _nearest(name: str, names: Sequence[str]) -> str:
    """Suggest the most similar name, if any."""
    from difflib import get_close_matches

    plain = {known.casefold(): known for known in names}
    near = get_close_matches(name.casefold(), plain, n=1)
    return f"; did you mean {plain[near[0]]!r}?" if near else ""


def eligible_series(database: Database, constraints: Constraints) -> list[str]:
    """List the permitted series in the database, those with few guides first."""
    from sqlalchemy import func, select

    from ..store import Batch

    number = func.sum(func.sum(Batch.guides)).over(partition_by=Batch.series).label("number")
    members = select(Batch.series.label("code"), Batch.member, number).group_by(Batch.series, Batch.member)
    rows = database.read(members.order_by("number", Batch.series))
    codes = []
    for code, member in zip(rows["code"], rows["member"], strict=True):
        family = member.split()[0]  # the name of a member begins with its family
        fits = (not constraints.families or family in constraints.families) and not (
            constraints.pins_only and family in SLIDING
        )
        if fits and (not constraints.series or code in constraints.series):
            codes.append(str(code))
    return list(dict.fromkeys(codes))
