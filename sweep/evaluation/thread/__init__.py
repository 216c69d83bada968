"""Thread tension and take-ups as plain functions of tables: one row in, one row out.

Every function takes a DataFrame or a dict of columns (numbers are repeated) and returns a DataFrame with the index
of the table.  Columns have the symbols of docs/thread.md and docs/takeup.md; a column with a default may be missing.
Angles are in rad except ``theta_deg``; a header such as ``wrap [deg]`` overrides that.  ``attrs["units"]`` of a result
names the units of its columns.  ``status`` is 0 where the row has a result (docs/nomenclature.md has the other
numbers).  A missing or misspelt column, a value that is no number, or a sign that is not allowed raises
:class:`sweep.InputError`, which names column and row.
"""

from sweep.errors import MeasuredRangeWarning
from sweep.evaluation.thread.diagram import diagram
from sweep.evaluation.thread.geometry import eyelet, feed, follower, free_cam, wrap
from sweep.evaluation.thread.tension import capstan, contour, least_tension_radius, path, speed

__all__ = [
    "MeasuredRangeWarning", "capstan", "contour", "diagram", "eyelet", "feed", "follower", "free_cam",
    "least_tension_radius", "path", "speed", "wrap",
]  # fmt: skip
