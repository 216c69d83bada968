"""Mechanisms as models of Pinocchio, whose own algorithms close the loops and compute the forces.

This project supplies the coordinates of joints in one reference pose, the directions of axes, the bodies and the
crank's speed.  Other poses follow by Newton's method on Pinocchio's positions, rates and accelerations from its
Jacobians, forces from its recursive Newton-Euler with the multipliers of the closures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]
Freedom: TypeAlias = tuple[str, ArrayLike]
Applied: TypeAlias = tuple[int, Array, Array]  # joint, place from its origin at the reference pose, force

EYE = np.eye(3)


class Multibody:
    """Bodies by joints, world axes at the reference pose; closures; driving joints.

    ``hang`` adds a body on a parent by a list of one-freedom joints at a place; ``close`` lets two bodies share a
    point, ``couple`` gives a linear equation between joint coordinates.
    """

    def __init__(self) -> None:
        import pinocchio

        self.pin: Any = pinocchio
        self.model: Any = pinocchio.Model()
        self.model.gravity.linear = np.zeros(3)
        self.ids: dict[str | None, int] = {None: 0}
        self.origin: dict[int, Array] = {0: np.zeros(3)}
        self.weights: list[Applied] = []
        self.balls: list[list[tuple[int, Array]]] = []
        self.rows: list[tuple[list[tuple[int, float]], float]] = []
        self.cranks: list[int] = []
        self.coordinate: dict[tuple[str, int], int] = {}
        self.couples = np.zeros(0)

    def hang(
        self,
        name: str,
        parent: str | None,
        place: ArrayLike,
        freedoms: Sequence[Freedom],
        mass: float = 0.0,
        centre: ArrayLike | None = None,
        tensor: ArrayLike | None = None,
        gravity: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        """Add a body: kinds and axes of freedoms from the parent on, all in world axes at the reference pose."""
        pin, place = self.pin, np.asarray(place, np.float64)
        at = self.ids[parent]
        for k, (kind, axis) in enumerate(freedoms):
            axis = np.asarray(axis, np.float64) / np.linalg.norm(np.asarray(axis, np.float64))
            joint = pin.JointModelRevoluteUnaligned(axis) if kind == "turn" else pin.JointModelPrismaticUnaligned(axis)
            shift = pin.SE3(EYE, place - self.origin[at])
            at = self.model.addJoint(at, joint, shift, f"{name} {k}")
            self.origin[at] = place
            self.coordinate[name, k] = self.model.joints[at].idx_v
        self.ids[name] = at
        if centre is not None:
            body = pin.Inertia(mass, np.asarray(centre, np.float64) - place, np.asarray(tensor, np.float64))
            self.model.appendBodyToJoint(at, body, pin.SE3.Identity())
            self.weights.append((at, np.asarray(centre, np.float64) - place, mass * np.asarray(gravity, np.float64)))

    def load(self, body: str, point: ArrayLike, force: ArrayLike) -> None:
        """Add a constant force in fixed axes at a point of a body, given at the reference pose."""
        at = self.ids[body]
        place = np.asarray(point, np.float64) - self.origin[at]
        self.weights.append((at, place, np.asarray(force, np.float64)))

    def close(self, one: str, other: str, point: ArrayLike) -> int:
        """Let two bodies share a point, and return the number of the closure, whose force on the first is a result."""
        at = np.asarray(point, np.float64)
        self.balls.append([(self.ids[b], at - self.origin[self.ids[b]]) for b in (one, other)])
        return len(self.balls) - 1

    def couple(self, terms: list[tuple[int, float]], constant: float = 0.0) -> int:
        """Let the sum of factor times joint coordinate stay constant, and return the number of the equation."""
        self.rows.append((terms, constant))
        return len(self.rows) - 1

    def drive(self, name: str) -> None:
        """Let a joint turn with the shaft."""
        self.cranks.append(self.coordinate[name, 0])

    def finish(self) -> Multibody:
        """Allocate the data of the algorithms; nothing can be added afterwards."""
        self.data: Any = self.model.createData()
        self.q = np.zeros(self.model.nq)
        return self

    def point(self, ball: int, side: int) -> Array:
        """Return the position of one side of a ball."""
        joint, local = self.balls[ball][side]
        place = self.data.oMi[joint]
        return np.asarray(place.translation + place.rotation @ local)

    def _jacobian(self, joint: int, local: Array) -> Array:
        six = self.pin.getJointJacobian(self.model, self.data, joint, self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        arm = self.data.oMi[joint].rotation @ local
        return np.asarray(six[:3] - self.pin.skew(arm) @ six[3:])

    def acceleration(self, joint: int, local: Array) -> Array:
        """Return the acceleration of the point of a body that is ``local`` from its joint at the reference pose."""
        frame = self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        linear = self.pin.getClassicalAcceleration(self.model, self.data, joint, frame).linear
        a = self.pin.getAcceleration(self.model, self.data, joint, frame)
        w = self.pin.getVelocity(self.model, self.data, joint, frame).angular
        arm = self.data.oMi[joint].rotation @ local
        return np.asarray(linear + np.cross(a.angular, arm) + np.cross(w, np.cross(w, arm)))

    def closure(self, q: Array) -> tuple[Array, Array]:
        """Return residuals and Jacobian of all closures."""
        self.pin.computeJointJacobians(self.model, self.data, q)
        gap = [self.point(k, 0) - self.point(k, 1) for k in range(len(self.balls))]
        rows = [self._jacobian(*ball[0]) - self._jacobian(*ball[1]) for ball in self.balls]
        for terms, constant in self.rows:
            row = np.zeros(self.model.nv)
            for joint, factor in terms:
                row[joint] = factor
            gap.append(np.array([row @ q - constant]))
            rows.append(row[None])
        return np.concatenate(gap), np.concatenate(rows)

    def at(
        self,
        turned: float,
        speed: float,
        change: float,
        extra: Callable[[Multibody], list[Applied]] | None = None,
    ) -> tuple[list[Array], float, float]:
        """Return the forces after the cranks have turned by an angle from the reference pose, in small Newton steps."""
        model, data, pin = self.model, self.data, self.pin
        free = [k for k in range(model.nv) if k not in self.cranks]
        start = self.q[self.cranks[0]]
        steps = max(1, int(np.ceil(abs(turned - start) / 0.05)))
        for angle in np.linspace(start, turned, steps + 1)[1:]:
            self.q[self.cranks] = angle
            for _ in range(30):
                gap, rows = self.closure(self.q)
                move = np.linalg.lstsq(rows[:, free], -gap, rcond=None)[0]
                self.q[free] += move
                if np.abs(move).max() < 1e-14:
                    break
        _, rows = self.closure(self.q)
        v, a = np.zeros(model.nv), np.zeros(model.nv)
        v[self.cranks], a[self.cranks] = speed, change
        v[free] = np.linalg.lstsq(rows[:, free], -rows[:, self.cranks].sum(axis=1) * speed, rcond=None)[0]
        pin.forwardKinematics(model, data, self.q, v, 0.0 * a)
        each = [self.acceleration(*ball[0]) - self.acceleration(*ball[1]) for ball in self.balls]
        apart = np.concatenate([*each, np.zeros(len(self.rows))])
        a[free] = np.linalg.lstsq(rows[:, free], -apart - rows[:, self.cranks].sum(axis=1) * change, rcond=None)[0]
        pin.forwardKinematics(model, data, self.q, v, a)
        outside = [*self.weights, *(extra(self) if extra else ())]
        tau = pin.rnea(model, data, self.q, v, a, self._external(outside))
        drives = np.eye(model.nv)[self.cranks]
        unknown = np.column_stack([rows.T, *drives])
        found = np.linalg.lstsq(unknown, tau, rcond=None)[0]
        rest = np.abs(unknown @ found - tau).max()
        balls = [found[3 * k : 3 * k + 3] for k in range(len(self.balls))]
        self.couples = found[3 * len(self.balls) : 3 * len(self.balls) + len(self.rows)]
        for force, ball in zip(balls, self.balls, strict=True):
            outside += [(ball[0][0], ball[0][1], force), (ball[1][0], ball[1][1], -force)]
        pin.rnea(model, data, self.q, v, a, self._external(outside))
        return balls, float(found[rows.shape[0] :].sum()), float(rest)

    def _external(self, forces: Sequence[Applied]) -> Any:
        found = self.pin.StdVec_Force()
        found.extend([self.pin.Force.Zero() for _ in range(self.model.njoints)])
        for joint, local, force in forces:
            own = self.data.oMi[joint].rotation.T @ force
            found[joint] += self.pin.Force(own, np.cross(local, own))
        return found

    def held(self, body: str, place: Array | None = None) -> tuple[Array, Array]:
        """Return force and moment, about the joint or a place, of a body's parent on it, in fixed axes."""
        joint = self.ids[body]
        wrench, frame = self.data.f[joint], self.data.oMi[joint]
        force, moment = frame.rotation @ wrench.linear, frame.rotation @ wrench.angular
        if place is not None:
            moment = moment + np.cross(frame.translation - place, force)
        return force, moment
