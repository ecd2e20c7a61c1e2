"""What answers can be ranked by, and how many there are: names only, which the command lists without numpy."""

from __future__ import annotations

#: What candidates can be ranked by; of each less is better as a cost.  The score is that of the desirabilities, the
#: balance the size over the stroke less the transmission angle over 90 degrees.
CRITERIA = (
    "score", "balance", "size", "deviation", "transmission", "allowance", "max_link", "min_link", "max_ground",
    "max_arm", "uniformity",
)  # fmt: skip
#: How many answers are given unless asked otherwise.
ANSWERS = 12
#: How far from each other answers are as designs unless asked otherwise: refinement leads neighbours to one.
DISTINCT = 0.02
