"""Check names of families, series and configurations in a request."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..errors import InvalidRequest, quoted, shortened
from ..guidance.kinds import POINTS, RETURNS, SLOTS
from ..kinematics.linkage import FAMILIES, PR, RP, RR, SLIDING
from ..problem.constraints import Constraints
from ..quantities import BOUNDS
from ..store import Database

SINGULAR = {"families": "family", "series": "series", "configurations": "configuration"}

#: Message for a database without guides.
EMPTY_DATABASE = "the database holds no guides: `catalogue build` fills it, or name another with --db"
#: Longest quoted name [characters].
MAX_QUOTED = 60
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
                if name == "families":
                    _refuse_of_collection(database, code)
                names = set(database.plain(column, "FROM mechanism")[singular])
                held = sorted(shortened(known, MAX_QUOTED) for known in names)
                if not held:
                    raise InvalidRequest(EMPTY_DATABASE)
                raise InvalidRequest(
                    f"the database holds no {singular} {quoted(code)}; it holds {', '.join(held)}. "
                    f"`catalogue build --series CODE` adds a series{_most_similar(code, held)}"
                )


def _refuse_of_collection(database: Database, family: str) -> None:
    """Refuse a family of mechanisms of another kind, with the way to search it."""
    found = database.plain({"collection": str}, "FROM specimens WHERE family = ? LIMIT 1", [family])["collection"]
    if len(found):
        raise InvalidRequest(
            f"{quoted(family)} is a family of the collection {found[0]}: search it with --collection {found[0]}"
        )


def contradiction(wanted: Constraints) -> tuple[str, str] | None:
    """Return a constraint that the requested families cannot meet, and the reason, or None."""
    dyads = [FAMILIES[name] for name in wanted.families if name in FAMILIES]
    if len(dyads) < max(len(wanted.families), 1):
        return None
    lacking = {"two dyads of pins": ["pins_only"] if all(pair != (RR, RR) for pair in dyads) else []}
    lacking["two fixed pivots at finite distance"] = ["fixed_pivots"] if all(PR in pair for pair in dyads) else []
    lacking["two moving pivots at finite distance"] = ["moving_pivots"] if all(RP in pair for pair in dyads) else []
    bounds = [row.name for row in BOUNDS.values() if row.needs_crank or row.needs_turn]
    lacking["a crank"] = [] if any(RR in pair for pair in dyads) else ["crank", *bounds, "full_rotation"]
    found = ((name, what) for what, names in lacking.items() for name in names if getattr(wanted, name))
    return next(found, None)


def check_kinds(kinds: Iterable[str]) -> None:
    """Refuse unknown kinds of guides."""
    for kind in kinds:
        if kind not in KINDS:
            raise InvalidRequest(f"there is no kind {kind!r}; there are {', '.join(KINDS)}{_most_similar(kind, KINDS)}")


def _most_similar(name: str, names: Sequence[str]) -> str:
    """Suggest the most similar name, if any."""
    from difflib import get_close_matches

    plain = {known.casefold(): known for known in names}
    near = get_close_matches(name.casefold(), plain, n=1)
    return f"; did you mean {plain[near[0]]!r}?" if near else ""


def eligible_series(database: Database, constraints: Constraints) -> list[str]:
    """List the permitted series in the database, in ascending number of guides."""
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
