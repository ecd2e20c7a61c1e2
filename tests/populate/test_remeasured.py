"""Every stored reach re-measures: what the file says of a guide is what `catalogue show` measures of it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue
from catalogue.candidates.stored import as_stored
from catalogue.guidance.kinds import STRAIGHT
from catalogue.kinematics.batch import take
from catalogue.kinematics.types import Array, Mask
from catalogue.populate.rows import PROBLEMS
from catalogue.store import COLUMNS, Database, Guide, Reach, joined

#: Reaches that are measured together: their arrays stay below 200 MB.
PART = 4000
#: Part of a measure that the coarsest grid may leave open, which may be another grid than in the build.
SAME = 5e-4
#: Deviations are sure to this part of the stroke in double precision.
ROUNDING = 1e-13
#: Series of which every linkage is at a change point in its design position: all pivots lie on the pole normal.
SERIES_AT_CHANGE_POINTS = ("I.yy", "II.yy", "II*.yy")


def remeasured(database: Database) -> tuple[dict[str, Array], Mask]:
    """Return all stored reaches, and which of them measure otherwise when they are laid along a path as they stand."""
    rows = database.read(joined(*COLUMNS, Guide.curvature).order_by(Guide.id, Reach.level))
    curved = ~np.isin(rows["kind"], STRAIGHT)
    off = np.zeros(len(curved), bool)
    for circle in (False, True):
        every = np.flatnonzero(curved == circle)
        for part in np.array_split(every, -(-len(every) // PART)):
            told = take(rows, part)
            found = as_stored(PROBLEMS[circle], told)
            for name, value in (("deviation", found.deviation), ("size", found.measures.size)):
                off[part] |= ~(np.abs(value - told[name]) <= SAME * told[name] + ROUNDING)
    return rows, off


@pytest.mark.slow
def test_every_reach_of_a_small_file_measures_as_it_is_stored(small: Catalogue) -> None:
    rows, off = remeasured(small.database)
    assert len(off) > 1000
    assert not off.any(), rows["id"][off]


@pytest.mark.slow
def test_every_reach_of_the_default_file_measures_as_it_is_stored(tmp_path: Path) -> None:
    """All 12,000 guides, all their reaches; of some every reach is shown one by one.

    The file is built here, unless whoever runs the tests has built one and names it.
    """
    built = os.environ.get("CATALOGUE_TEST_DEFAULT")
    with catalogue.open(built or tmp_path / "default.db", quiet=True) as opened:
        rows, off = remeasured(opened.database)
        assert len(np.unique(rows["id"])) >= 12_000
        assert not off.any(), rows["id"][off]
        held = rows["id"][np.isin(rows["series"], SERIES_AT_CHANGE_POINTS)]
        for some in (held, rows["id"]):
            for number in np.random.default_rng(5).choice(np.unique(some), 30, replace=False).tolist():
                guide = opened.guide(number)
                for level, row in guide.rows.items():
                    shown = guide.at(1.0, level)
                    assert shown.deviation == pytest.approx(row["deviation"][0], rel=SAME, abs=ROUNDING)
                    assert shown.size == pytest.approx(row["size"][0], rel=SAME)
