"""Random crank-rockers for the tests: built by placing the joints, so that they assemble somewhere."""

from __future__ import annotations

import numpy as np

from kernels.families import rssr

POSE_NAMES = ("psi", "dpsi", "d2psi", "d3psi", "sin_psi", "cos_psi", "discriminant", "pressure_angle")
JOINT_NAMES = ("x_b", "y_b", "z_b", "x_c", "y_c", "z_c")


def random_designs(n, seed, *, rotatable=False):
    """Return an (n, 8) design matrix; with ``rotatable`` only designs whose crank turns fully."""
    found = []
    while sum(map(len, found)) < n:
        designs = _placed(4 * n, seed)
        seed += 1
        found.append(designs[margins(designs)["rotatable"] == 1.0] if rotatable else designs)
    return np.concatenate(found)[:n]


def _placed(n, seed):
    r = np.random.default_rng(seed)
    c = r.uniform(10.0, 50.0, n)
    a = c * 10.0 ** r.uniform(-1.3, 0.1, n)
    e, f, g = (r.uniform(-60.0, 60.0, n) for _ in range(3))
    alpha, phi, psi = r.uniform(-np.pi, np.pi, n), r.uniform(0.0, 2.0 * np.pi, n), r.uniform(0.0, 2.0 * np.pi, n)
    sa, ca = np.sin(alpha), np.cos(alpha)
    pin = np.array([a * np.cos(phi), f * sa + a * ca * np.sin(phi), f * ca - a * sa * np.sin(phi)])
    ball = np.array([e + c * np.cos(psi), c * np.sin(psi), g])
    b = np.sqrt(((pin - ball) ** 2).sum(axis=0)) * r.uniform(0.9, 1.3, n)
    return np.column_stack([a, b, c, e, f, g, alpha, r.choice([-1.0, 1.0], n)])


def poses(designs, phi, *, function=rssr.poses):
    """Return all pose outputs and the status as a dictionary; phi (n, m) or (1, m), real or complex."""
    designs, phi = np.asarray(designs), np.asarray(phi)
    shape = (len(designs), phi.shape[1])
    dtype = np.result_type(designs, phi)
    out = {name: np.empty(shape, dtype) for name in (*POSE_NAMES, *JOINT_NAMES)}
    status = np.empty(shape, np.uint8)
    function(designs, np.cos(phi), np.sin(phi), status, rssr.Outputs(**out))
    return out | {"status": status}


def margins(designs, *, function=rssr.margin):
    """Return the outputs of the margin kernel as a dictionary."""
    n = len(designs)
    out = {name: np.empty(n) for name in ("margin", "rotatable", "max_pressure_angle", "phi_min", "error")}
    status = np.empty(n, np.uint8)
    function(designs, status, *out.values())
    return out | {"status": status}


def limits(designs, *, function=rssr.limits):
    """Return the outputs of the limits kernel and their errors as a dictionary."""
    n = len(designs)
    status, values, errors = np.empty(n, np.uint8), np.empty((n, 7)), np.empty((n, 7))
    function(designs, status, values, errors)
    out = dict(zip(rssr.LIMIT_NAMES, values.T, strict=True))
    return (
        out
        | {f"err_{name}": column for name, column in zip(rssr.LIMIT_NAMES, errors.T, strict=True)}
        | {"status": status}
    )


def maxima(designs, order, target=1e-8, *, function=rssr.true_maxima):
    """Return the true maximum of a transfer function of some order, its phi, both errors and the status."""
    n = len(designs)
    out = {name: np.empty((3, n)) for name in ("phi", "error", "phi_error")}
    most, status = np.empty(n), np.empty(n, np.uint8)
    wanted = [most if k == order else None for k in (1, 2, 3)]
    function(designs, rssr.sampling_tables(), target, status, *out.values(), *wanted)
    return {name: rows[order - 1] for name, rows in out.items()} | {"max": most, "status": status}


def dense(designs, order, samples):
    """Return the largest sample of a transfer function of some order on a grid, its position, and the least margin."""
    n = len(designs)
    phi = np.arange(samples) * (2.0 * np.pi / samples)
    most, least, at = np.empty(n), np.empty(n), np.empty(n, np.int64)
    wanted = [most if k == order else None for k in (1, 2, 3)]
    rssr.dense_maxima(designs, np.cos(phi), np.sin(phi), least, *wanted, at, np.empty(samples))
    return most, phi[at], least
