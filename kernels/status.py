"""Numbers of the statuses and their meaning.  Every kernel returns a status; it explains every nan among the results.

The numbers are part of the public contract: they are stored in every dataset.  Of several causes the one that made
the result unusable first is reported.
"""

from __future__ import annotations

OK = 0
NOT_ASSEMBLED = 1
DEAD_POINT = 2
NOT_ROTATABLE = 3
UNDECIDABLE = 4
LIMIT_EXCEEDED = 5
NOT_CONVERGED = 6
INVALID_INPUT = 7
SINGULAR = 8
NOT_OSCILLATING = 9
JAMMED = 10
NOT_LINEAR = 11
NO_DWELL = 12
NOT_ADMISSIBLE = 13
NO_ROOT = 14
NO_EVENT = 15
NEVER = 16
TWICE = 17
TANGENT = 18
WRONG_SIDE = 19
WRONG_WAY = 20
NO_FRAME = 21
NO_TRIANGLE = 22
NO_WINDOW = 23

MEANING: dict[int, str] = {
    OK: "ok",
    NOT_ASSEMBLED: "the links do not reach at this pose (discriminant below zero)",
    DEAD_POINT: "dead point: the discriminant is zero within float64, derivatives are unbounded",
    NOT_ROTATABLE: "the crank does not turn fully (margin below zero)",
    UNDECIDABLE: "whether the crank turns fully cannot be decided in float64 (margin zero within rounding)",
    LIMIT_EXCEEDED: "a limit of the study is exceeded",
    NOT_CONVERGED: "the accuracy asked for was not reached, by an iteration or because rounding is all there is",
    INVALID_INPUT: "a parameter is not finite, a length is not positive, an angle is beyond 1e5 rad, their scale is "
    "beyond float64, or they exclude each other (supports at one place, a collar no larger than its journal, nothing "
    "that has inertia, the life of a bearing that carries nothing)",
    SINGULAR: "the position is not defined (a joint lies on the axis it turns about)",
    NOT_OSCILLATING: "the follower turns fully: it has no limit positions",
    NOT_LINEAR: "the deflection is too large for the linearised equation; the number given solves that equation only",
    JAMMED: "friction blocks the motion, or its iteration does not contract; the crank all but stops within the turn",
    NO_DWELL: "the output does not make one turn per turn of the input: no dwell is defined",
    NO_ROOT: "the equation that fixes the position has no root in its interval, or fewer than asked for",
    NO_EVENT: "the event does not happen within the turn, or within the interval",
    NOT_ADMISSIBLE: "the point of the locus gives no mechanism that meets the requirement",
    NEVER: "the tip never passes where it is to take the loop",
    TWICE: "the tip passes where it is to take the loop more than once in the stated sense",
    TANGENT: "the tip touches what it is to pass within rounding: whether it passes cannot be decided",
    WRONG_SIDE: "the looper's tip passes the needle on the side away from the scarf, or outside the thread's triangle",
    WRONG_WAY: "the tip passes against the stated sense only",
    NO_FRAME: "the needle has no frame: its scarf points along it",
    NO_TRIANGLE: "blade, thread and seam lie in one line: they span no triangle",
    NO_WINDOW: "the fields of work leave the needle's rise no window in common",
}
