"""Take-up for the thread demand of a stitch: the smoothest law within the slack, and the edge of a cam that gives it.

The equation numbers are those of docs/takeup.md, section 9.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from kernels.types import Array
from sweep.errors import InputError
from sweep.evaluation.tables import numbers

DIRECTIONS = 720  # directions around the straight thread in which the edge is sought
ROUNDS = 20  # rounds of Newton's method for the edge
TIGHT = 1e-9  # share of the slack below which an excess is rounding
LEAST = 1e-3  # smallest slack relative to the range of the demand, for the unit of length


@dataclass(frozen=True)
class ThreadLaw:
    """Law of a take-up, P = sum of cos[k - 1] cos(k phi) + sin[k - 1] sin(k phi), and the stock of thread.

    ``largest`` is the largest magnitude of P''; ``spare`` the smallest distance of the surplus from its two bounds.
    """

    cos: Array
    sin: Array
    stock: float
    largest: float
    spare: float

    def __call__(self, phi: ArrayLike, order: int = 0) -> Array:
        """Return P or its derivative of the given order."""
        values: Array = _waves(np.asarray(phi, np.float64), len(self.cos), order) @ np.concatenate([self.cos, self.sin])
        return values

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients as parameters of the family `guided_cam`."""
        pairs = (("A", self.cos), ("B", self.sin))
        return {f"{letter}{k}": float(x) for letter, values in pairs for k, x in enumerate(values, start=1)}


def smoothest_law(phi: ArrayLike, demand: ArrayLike, allowed: ArrayLike, harmonics: int = 6) -> ThreadLaw:
    """Find the law with the least acceleration whose surplus stays between 0 and ``allowed``, by a linear program.

    Parameters
    ----------
    phi : (n,) angles of the main shaft [rad]; two beside each jump of the demand, just before and just behind
    demand : (n,) thread that the stitch demands at these angles
    allowed : largest surplus, (n,) or one number
    harmonics : number of harmonics of the law

    Returns
    -------
    ThreadLaw
        given = stock - P lies between demand and demand + allowed at every angle

    Raises
    ------
    InputError
        if no law with this number of harmonics satisfies the bounds: it gives the lacking slack.
    """
    from scipy.optimize import linprog

    angles, need = numbers(phi, "phi", "phi").ravel(), numbers(demand, "demand", "demand").ravel()
    slack = numbers(allowed, "allowed", "allowed").ravel()
    for name, values in (("phi", angles), ("demand", need), ("allowed", slack)):
        if values.size != angles.size and (name, values.size) != ("allowed", 1):
            raise InputError(name, f"{values.size} values", f"as many as phi, {angles.size}", "thread law")
        if not np.isfinite(values).all() or not values.size:
            raise InputError(name, values.tolist()[:3], "finite numbers", "thread law")
    if harmonics < 1:
        raise InputError("harmonics", harmonics, "a whole number above 0", "thread law")
    # The tolerances of the linear program suit numbers of about 1.
    unit, least = max(float(np.abs(slack).max()), LEAST * float(np.ptp(need))) or 1.0, float(slack.min())
    need, slack = need / unit, np.broadcast_to(slack / unit, need.shape)
    waves, curving = _waves(angles, harmonics, 0), _waves(angles, harmonics, 2)
    one, none = np.ones((angles.size, 1)), np.zeros((angles.size, 1))
    # unknowns: the coefficients, the stock, the largest |P''|, and the excess over the slack
    rows = np.block(
        [
            [waves, -one, none, none],
            [-waves, one, none, -one],
            [curving, none, -one, none],
            [-curving, none, -one, none],
        ]
    )
    right = np.concatenate([-need, need + slack, np.zeros(2 * angles.size)])
    free = 2 * harmonics + 1
    for goal, most in ((free + 1, None), (free, 0.0)):
        cost = np.zeros(free + 2)
        cost[goal] = 1.0
        program: Any = linprog(cost, rows, right, bounds=[(None, None)] * free + [(0.0, None), (0.0, most)])
        if most is None and program.x[-1] > TIGHT:
            words = f"{unit * program.x[-1]:.4g} more, or more than {harmonics} harmonics"
            raise InputError("allowed", least, words, "thread law")
    surplus = program.x[free - 1] - waves @ program.x[: free - 1] - need
    spare = unit * float(np.minimum(surplus, slack - surplus).min())
    x = unit * program.x
    return ThreadLaw(x[:harmonics], x[harmonics : 2 * harmonics], float(x[free - 1]), float(x[free]), spare)


def cam_edge(law: ThreadLaw, guides: ArrayLike, P_h: float, count: int = 360) -> pd.DataFrame:
    """Find the edge of a cam on the main shaft over which a thread between two guides follows a law.

    The edge is the envelope of the ovals on which the thread has the required length, (30): it touches each oval at the
    place of the thread.

    Parameters
    ----------
    law : law to be followed
    guides : (2, 3), on either side of the plane z = 0 of the cam, whose axis is z [length]
    P_h : length of the thread at P = 0
    count : number of points, at even angles of the cam

    Returns
    -------
    DataFrame
        ``phi``, ``x``, ``y`` of the edge in the axes of the cam, its outward normal ``nx``, ``ny``, ``curvature``
        (positive if convex), and ``clear``: smallest increase of the thread's length over any other point of the edge
        that is at least a hundredth of a turn away.  ``attrs["units"]`` names the units

    Raises
    ------
    InputError
        if the thread is too short, no edge gives the law, or the edge would cut into itself, with the angle.
    """
    ends = numbers(guides, "guides", "guides").reshape(2, 3)
    if not ends[0, 2] * ends[1, 2] < 0.0:
        raise InputError("guides", ends[:, 2].tolist(), "one on either side of the plane z = 0 of the cam", "cam edge")
    phi: Array = np.arange(count) * np.float64(2.0 * np.pi / count)
    length, rate, bend = P_h + law(phi), law(phi, 1), law(phi, 2)
    q = _touched(ends, length, rate, phi)
    _, g, h = _way(ends, q)
    swept = np.stack([-q[:, 1], q[:, 0]], axis=1)  # velocity of a point of the cam
    across = np.einsum("nij,nj->ni", h, swept) + np.stack([g[:, 1], -g[:, 0]], axis=1)
    moves = np.linalg.solve(np.stack([g, across], axis=1), np.stack([rate, bend], axis=1)[..., None])[..., 0]
    size = np.hypot(g[:, 0], g[:, 1])
    normal = g / size[:, None]
    along = normal[:, 0] * (moves - swept)[:, 1] - normal[:, 1] * (moves - swept)[:, 0]
    turning = np.einsum("ni,nij,nj->n", np.stack([-g[:, 1], g[:, 0]], axis=1), h, moves) / size**2 - 1.0
    _refuse(along >= 0.0, phi, "a law, guides or P_h for which the edge does not cut into itself")
    cos, sin = np.cos(phi), np.sin(phi)
    x, y = q[:, 0] * cos + q[:, 1] * sin, q[:, 1] * cos - q[:, 0] * sin
    nx, ny = normal[:, 0] * cos + normal[:, 1] * sin, normal[:, 1] * cos - normal[:, 0] * sin
    # over each point of the edge at each angle; a hundredth of a turn aside the thread must be longer
    placed = np.stack([np.outer(cos, x) - np.outer(sin, y), np.outer(sin, x) + np.outer(cos, y)], axis=2)
    longer = _way(ends, placed.reshape(-1, 2))[0].reshape(count, count) - length[:, None]
    separation = np.abs((np.arange(count) - np.arange(count)[:, None] + count // 2) % count - count // 2)
    clear = np.where(separation * 100 >= count, longer, np.inf).min(axis=1)
    _refuse(clear < 0.0, phi, "an edge that touches the thread at one place alone")
    edge = pd.DataFrame({"phi": phi, "x": x, "y": y, "nx": nx, "ny": ny, "curvature": turning / along, "clear": clear})
    edge.attrs["units"] = {"phi": "rad", "nx": "1", "ny": "1", "curvature": "1/length"} | dict.fromkeys(
        ("x", "y", "clear"), "length"
    )
    return edge


def _waves(phi: Array, harmonics: int, order: int) -> Array:
    """Return cos(k phi), then sin(k phi), or their derivatives, (..., 2 harmonics)."""
    k = np.arange(1, harmonics + 1)
    angle = phi[..., None] * k + 0.5 * np.pi * order
    return np.concatenate([np.cos(angle), np.sin(angle)], axis=-1) * np.tile(k.astype(np.float64), 2) ** order


def _way(ends: Array, q: Array) -> tuple[Array, Array, Array]:
    """Return the length over points (n, 2) of the cam's plane, its gradient (n, 2) and second derivatives (n, 2, 2)."""
    length, g, h = np.zeros(len(q)), np.zeros((len(q), 2)), np.zeros((len(q), 2, 2))
    for end in ends:
        d = q - end[:2]
        r = np.sqrt((d**2).sum(axis=1) + end[2] ** 2)
        u = d / r[:, None]
        length, g = length + r, g + u
        h += (np.eye(2) - u[:, :, None] * u[:, None, :]) / r[:, None, None]
    return length, g, h


def _touched(ends: Array, length: Array, rate: Array, phi: Array) -> Array:
    """Return the point at which the edge touches each oval, (n, 2); of several the farthest from the cam's axis.

    A first guess is looked for around where the straight thread passes the plane, then closed by Newton's method.
    """
    share = ends[0, 2] / (ends[0, 2] - ends[1, 2])
    centre = ends[0] + share * (ends[1] - ends[0])
    _refuse(
        length <= np.linalg.norm(ends[1] - ends[0]), phi, "a P_h for which the thread is longer than a straight one"
    )
    t = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    e = np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1)
    # on the ray from the centre c: |p - n1|^2 = ((L^2 + |p - n1|^2 - |p - n2|^2)/(2 L))^2, a quadratic equation
    off = centre - ends[0]
    squares = (ends[1] @ ends[1] - ends[0] @ ends[0]) * -0.5 + centre @ (ends[1] - ends[0])
    base = (length**2 + 2.0 * squares) / (2.0 * length)
    slope = (e @ (ends[1] - ends[0]))[None] / length[:, None]
    a, b = 1.0 - slope**2, e @ off - base[:, None] * slope
    reach = (np.sqrt(b * b - a * (off @ off - base**2)[:, None]) - b) / a
    q = centre[:2] + reach[..., None] * e[:, :2]
    g = _way(ends, q.reshape(-1, 2))[1].reshape(q.shape)
    left = g[..., 1] * q[..., 0] - g[..., 0] * q[..., 1] - rate[:, None]
    changes = left * np.roll(left, -1, axis=1) <= 0.0
    _refuse(~changes.any(axis=1), phi, "a law that an edge can give: P changes too fast for these guides")
    far = np.where(changes, np.hypot(q[..., 0], q[..., 1]), -np.inf).argmax(axis=1)
    point: Array = q[np.arange(len(q)), far]
    for _ in range(ROUNDS):
        total, g, h = _way(ends, point)
        swept = np.stack([-point[:, 1], point[:, 0]], axis=1)
        across = np.einsum("nij,nj->ni", h, swept) + np.stack([g[:, 1], -g[:, 0]], axis=1)
        errors = np.stack([total - length, (g * swept).sum(axis=1) - rate], axis=1)
        point = point - np.linalg.solve(np.stack([g, across], axis=1), errors[..., None])[..., 0]
    return point


def _refuse(where: NDArray[np.bool_], phi: Array, allowed: str) -> None:
    if where.any():
        raise InputError("phi", float(phi[where.argmax()]), allowed, "cam edge")
