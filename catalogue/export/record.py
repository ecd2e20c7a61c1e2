"""A guide as JSON with all its data, for commands that read linkages."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..guides.kinds import has_bars

if TYPE_CHECKING:
    from ..guides.kinds import Guide
    from ..guides.own_chain import OwnChain
    from ..guides.placed import PlacedGuide
    from .formats import Options

#: Fields of an answer that state its provenance.
PROVENANCE = ("id", "series", "configuration", "order", "cognate", "drift")
#: Fields of an answer that other parts of the file hold.
OTHER_FIELDS = ("family", "pivots", "guided", "pole", "lengths", "unit")


def written_json(guide: Guide, options: Options) -> str:
    """Return the guide as JSON: pivots, lengths, limits, measures, provenance, to all digits."""
    told: dict[str, Any] = getattr(guide, "to_dict", dict)()
    record = _chain_record(guide) if has_bars(guide) else _linkage_record(guide, options, told)
    return json.dumps(record, indent=1, allow_nan=False) + "\n"


def _chain_record(guide: OwnChain) -> dict[str, Any]:
    """Return an `OwnChain` in the form that `catalogue.mechanism` reads, with its measures."""
    given = guide.given
    return {
        **{name: value for name, value in given.items() if value},
        "lengths": guide.lengths,
        "limits": {"drive_range": guide.drive_range},
        "measured": {name: value for name, value in guide.to_dict().items() if name not in given},
        "provenance": {"program": f"mechanism-catalogue {__version__}"},
    }


def _linkage_record(guide: PlacedGuide, options: Options, told: dict[str, Any]) -> dict[str, Any]:
    return {
        "unit": options.unit,
        "family": str(guide.linkage.family[0]),
        "pivots": guide.pivots,
        "guided": guide.guided,
        "pole": guide.pole,
        "lengths": {name: value for name, value in guide.lengths.items() if math.isfinite(value)},
        "limits": {
            "circuits": [asdict(one) for one in guide.circuits],
            "dead_points": guide.dead_points,
            "change_points": guide.change_points,
        },
        "measured": {name: value for name, value in told.items() if name not in (*PROVENANCE, *OTHER_FIELDS)},
        "provenance": {
            "program": f"mechanism-catalogue {__version__}",
            **{name: told[name] for name in PROVENANCE if name in told},
        },
    }
