"""Thread over the bare edge with friction: the points where it begins to slide along the edge, and its path.

The resultant of both tensions on the edge's point, T12 = T1 e1 + T2 e2, may lean by the angle of friction before the
thread slides along the edge.  Between two limit points it sticks, so where it lies depends on where it lay before: a
march in the order of phi.
"""

from __future__ import annotations

import math
from collections import namedtuple

from kernels import status as st
from kernels.curves.root_search import false_position
from kernels.families.free_cam.contact import (
    FINEST,
    Cam,
    least_distances,
    reach,
    shortest,
    straight,
    turned_cam,
)
from kernels.jit import inline, kernel
from kernels.linkage.outputs import write
from kernels.linkage.thread_path import wrap_angle
from kernels.types import Array, Status

# Distance within which limit points are searched, in units of the distance within which all extrema lie.
FAR = 64.0
HALVINGS = 60


# Ratio of the tensions T2/T1 = ratio e^(along wrap), sine of the angle of friction across the thread.
Pull = namedtuple("Pull", "ratio along sine")


@inline
def pull_of(ratio: float, along: float, across: float) -> Pull:
    """Friction numbers of one design, from tension ratio and coefficients along and across the thread."""
    return Pull(ratio, along, across / math.sqrt(1.0 + across * across))


@inline
def _usable(friction: Array) -> bool:
    """Whether tension ratio and coefficients of friction are in the range of a thread."""
    return bool(1e-6 < friction[0] < 1e6 and 0.0 <= friction[1] < 100.0 and 0.0 <= friction[2] < 1e6)


@inline
def lean(cam: Cam, pull: Pull, at: float) -> tuple[float, float]:
    """Return T12 . tangent and |T12| at a point of the edge, in units of T1; (24)."""
    # Tensions in units of T1: only their ratio turns the resultant.
    x, tx = cam.a * at * at, 2.0 * cam.a * at
    d1x, d1y, d2x, d2y = cam.x1 - x, cam.y1 - at, cam.x2 - x, cam.y2 - at
    r1 = math.sqrt(d1x * d1x + d1y * d1y + cam.z1 * cam.z1)
    r2 = math.sqrt(d2x * d2x + d2y * d2y + cam.z2 * cam.z2)
    ratio = pull.ratio
    # without friction along the thread the arctangent of the wrap is spared
    if pull.along != 0.0:
        wrap = wrap_angle((x, at, 0.0), (cam.x1, cam.y1, cam.z1), (cam.x2, cam.y2, cam.z2))
        ratio = ratio * math.exp(pull.along * wrap)
    fx, fy = d1x / r1 + ratio * d2x / r2, d1y / r1 + ratio * d2y / r2
    fz = cam.z1 / r1 + ratio * cam.z2 / r2
    return (fx * tx + fy) / math.sqrt(1.0 + tx * tx), math.sqrt(fx * fx + fy * fy + fz * fz)


@inline
def excess(at: float, cam: Cam, pull: Pull, side: float) -> float:
    """T12 . tangent - side sin(rho) |T12|: zero at the limit point of that side, falling along the edge far out."""
    along, whole = lean(cam, pull, at)
    return float(along - side * pull.sine * whole)


@inline
def steepest_excess(cam: Cam, pull: Pull, low: float, high: float) -> float:
    """Return an upper bound of the slope of :func:`excess` between two points of the edge."""
    first, second = least_distances(cam, low, high)
    tangent = math.sqrt(1.0 + 4.0 * cam.a * cam.a * max(low * low, high * high))
    # The edge's tangent turns fastest where it is nearest to y = 0, and that may be inside.
    near = max(max(low, -high), 0.0)
    turning = 2.0 * cam.a / (1.0 + 4.0 * cam.a * cam.a * near * near)
    # the wrap never exceeds pi, so this bounds the tension ratio for all points at once
    most = pull.ratio * math.exp(math.pi * pull.along)
    swing = tangent * (1.0 / first + most * (1.0 / second + pull.along * (1.0 / first + 1.0 / second)))
    return float((1.0 + pull.sine) * swing + (1.0 + most) * turning)


@inline
def next_limit(cam: Cam, pull: Pull, side: float, start: float, sense: float, most: float) -> float:
    """Find the first limit point of one side from ``start`` along the edge, within ``most``; nan if there is none."""
    end = reach(cam) + 1e-3
    at, value = start, excess(start, cam, pull, side)
    # A start on a limit point is one: the walk looks for a change of sign and would step over it.
    if value == 0.0:
        return start
    while abs(at - start) < most:
        # far out the branches' directions change with the ratio of two places, so the steps may grow with it
        span = 0.25 * max(end, abs(at))
        bound = steepest_excess(cam, pull, min(at, at + sense * span), max(at, at + sense * span))
        following = at + sense * min(span, max(abs(value) / bound, FINEST * end))
        new = excess(following, cam, pull, side)
        if (new < 0.0) != (value < 0.0):
            return false_position(excess, at, following, value, new, cam, pull, side)
        at, value = following, new
    return math.nan


@inline
def nearest_limit(cam: Cam, pull: Pull, side: float, centre: float) -> float:
    """Find the limit point of one side nearest to ``centre``; nan if there is none within FAR."""
    most = FAR * (reach(cam) + 1e-3)
    up = next_limit(cam, pull, side, centre, 1.0, most)
    # Downwards no farther than the point found upwards: a point beyond is not nearer.
    down = next_limit(cam, pull, side, centre, -1.0, abs(up - centre) if up == up else most)
    if math.isnan(down):
        return up
    return down if math.isnan(up) or abs(down - centre) < abs(up - centre) else up


@kernel
def limit_points(
    designs: Array, friction: Array, cos_phi: Array, sin_phi: Array, status: Status, plus: Array, minus: Array
) -> None:
    """Compute the points of the edge where the thread begins to slide, nearest to the frictionless contact; (25).

    Parameters
    ----------
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/free_cam.py
    friction : (n, 3), tension ratio T2/T1; coefficients of friction along the thread and across it (along the edge)
    cos_phi, sin_phi : (n, m), or (1, m) shared by all designs
    status : (n, m) out; OK, INVALID_INPUT, or NOT_CONVERGED where a limit point lies far outside (friction near 1)
    plus, minus : (n, m) out, y of the points where T12 leans by the angle of friction towards growing and falling y
    """
    for i in range(designs.shape[0]):
        pull = pull_of(friction[i, 0], friction[i, 1], friction[i, 2])
        fine = _usable(friction[i])
        row = i if cos_phi.shape[0] > 1 else 0
        for j in range(cos_phi.shape[1]):
            cam = turned_cam(designs, i, cos_phi[row, j], sin_phi[row, j])
            status[i, j] = cam.code if fine else st.INVALID_INPUT
            plus[i, j], minus[i, j] = math.nan, math.nan
            if status[i, j] == st.OK:
                centre = shortest(cam).y
                plus[i, j] = nearest_limit(cam, pull, 1.0, centre) * cam.unit
                minus[i, j] = nearest_limit(cam, pull, -1.0, centre) * cam.unit
                if not math.isfinite(plus[i, j] + minus[i, j]):
                    status[i, j] = st.NOT_CONVERGED


@inline
def slid(cam: Cam, pull: Pull, before: float) -> float:
    """Place where a thread that lay at ``before`` rests now.

    It stays there, or slides to the next limit point that holds it.
    """
    along, whole = lean(cam, pull, before)
    most = FAR * (reach(cam) + 1e-3)
    if along > pull.sine * whole:
        return next_limit(cam, pull, 1.0, before, 1.0, most)
    if along < -pull.sine * whole:
        return next_limit(cam, pull, -1.0, before, -1.0, most)
    return before


@inline
def landed(designs: Array, i: int, u0: float, v0: float, u1: float, v1: float) -> float:
    """Find the place where the thread first touches the edge, by bisection between two cam angles.

    The place at the pose before would depend on the steps of the march.
    """
    low, high, y = 0.0, 1.0, 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        u, v = u0 + middle * (u1 - u0), v0 + middle * (v1 - v0)
        # on the chord between both poses, brought back to the circle: no sine or cosine in the loop
        length = math.sqrt(u * u + v * v)
        line = straight(turned_cam(designs, i, u / length, v / length))
        y = line.y
        if line.inside:
            high = middle
        else:
            low = middle
    return y


# Pose outputs, each (n, m), or None, which is not computed.
MarchOutputs = namedtuple("MarchOutputs", "L wrap y_contact contact sticking")


@kernel
def march(
    friction: Array, turns: int, designs: Array, cos_phi: Array, sin_phi: Array, status: Status, out: MarchOutputs
) -> None:
    """Follow the thread over an edge with friction, in the order of the given angles; docs/takeup.md, section 5.

    The thread starts where it lies without friction and is led through the angles ``turns`` times; the outputs are of
    the last turn.

    Parameters
    ----------
    friction : (n, 3), tension ratio T2/T1; coefficients of friction along the thread and across it (along the edge)
    turns : number of turns
    designs : (n, 8) columns as `PARAMETERS` of sweep/families/free_cam.py
    cos_phi, sin_phi : (n, m) or (1, m), angles of one turn in their order
    status : (n, m) out; OK, INVALID_INPUT, or NOT_CONVERGED from the pose on where the thread slides off far outside
    L, wrap, y_contact : (n, m) out or None; thread length, wrap angle [rad], place along the edge's axis y [length]
    contact, sticking : (n, m) out or None; 1 or 0: whether the thread lies on the edge, and whether it sticks there
    """
    for i in range(designs.shape[0]):
        pull = pull_of(friction[i, 0], friction[i, 1], friction[i, 2])
        fine = _usable(friction[i])
        row, m = i if cos_phi.shape[0] > 1 else 0, cos_phi.shape[1]
        at, code = math.nan, st.OK if fine else st.INVALID_INPUT
        last, off = 0, False
        for count in range(turns * m):
            j = count % m
            cam = turned_cam(designs, i, cos_phi[row, j], sin_phi[row, j])
            code = cam.code if code == st.OK else code
            line, touching, stuck = straight(cam), False, False
            if code == st.OK:
                touching = line.inside
                if not touching:
                    at, last, off = line.y, j, True
                else:
                    if off:
                        at = landed(
                            designs, i, cos_phi[row, last], sin_phi[row, last], cos_phi[row, j], sin_phi[row, j]
                        )
                    # nan: the first contact of all, where the thread is laid on without friction
                    before = at if at == at else shortest(cam).y
                    at, off = slid(cam, pull, before), False
                    stuck = at == before
                    code = st.OK if at == at else st.NOT_CONVERGED
            # earlier turns only bring the thread into its cycle
            if count < (turns - 1) * m:
                continue
            status[i, j] = code
            good = 1.0 if code == st.OK else math.nan
            x = cam.a * at * at if touching else line.x
            n1, n2 = (cam.x1, cam.y1, cam.z1), (cam.x2, cam.y2, cam.z2)
            if out.L is not None:
                dx, dy, ex, ey = x - cam.x1, at - cam.y1, x - cam.x2, at - cam.y2
                over = math.sqrt(dx * dx + dy * dy + cam.z1 * cam.z1) + math.sqrt(ex * ex + ey * ey + cam.z2 * cam.z2)
                write(out.L, i, j, good * (over if touching else line.length) * cam.unit)
            write(out.wrap, i, j, good * (wrap_angle((x, at, 0.0), n1, n2) if touching else 0.0))
            write(out.y_contact, i, j, good * at * cam.unit)
            write(out.contact, i, j, good * (1.0 if touching else 0.0))
            write(out.sticking, i, j, good * (1.0 if stuck else 0.0))
