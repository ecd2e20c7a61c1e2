"""Names of criteria and defaults of the ranking, importable without NumPy."""

from __future__ import annotations

from ..quantities import RANKED

_MEASURED = [row.criterion for row in RANKED if not row.scores_only]
#: Criteria of the ranking, each minimised as a cost.  The score is the joint desirability; the
#: balance is size / stroke - transmission angle / 90 degrees.
CRITERIA = ("score", "balance", _MEASURED[0], "deviation", *_MEASURED[1:])
#: Default number of answers: a screen of a table.
ANSWERS = 12
#: Default minimum distance between answers as designs: a pivot moved by a fiftieth of the stroke.
#: Closer answers come from starts whose refinement led to the same optimum.
DISTINCT = 0.02
