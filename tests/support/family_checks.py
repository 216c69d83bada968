"""Measurements common to the tests of families: condition numbers, error factors, compiled against plain."""

from __future__ import annotations

import sys

import numpy as np
from mpmath import mp

from sweep.families import family
from sweep.families.base import Angles

EPS = mp.mpf(2) ** -53
STEP = 1e-100


def conditions(name, design, phi, outputs):
    """Return the sum of |x dy/dx| over all lengths, angles and the crank angle, by the complex step."""
    mechanism = family(name)
    everything = frozenset(mechanism.pose_names)  # one compiled kernel serves all tests
    base = np.array([design], dtype=complex)
    total = dict.fromkeys(outputs, 0.0)
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.choices is None:
            changed = base.copy()
            changed[0, k] += 1j * STEP
            columns = mechanism.poses(changed, Angles.of(np.array([[phi]])), everything)
            for output in outputs:
                total[output] += abs(design[k] * columns[output][0, 0].imag / STEP)
    columns = mechanism.poses(base, Angles.of(np.array([[phi + 1j * STEP]])), everything)
    for output in outputs:
        total[output] += abs(phi * columns[output][0, 0].imag / STEP)
    return total


def ladder(mechanism, name):
    """Return an output and its derivatives by the crank angle, lowest first."""
    names = [name]
    while names[-1] in mechanism.derivative_of:
        names.append(mechanism.derivative_of[names[-1]])
    return names


def factors(name, design, phi, expected, got, positions=True):
    """Return errors of the outputs in units of 2^-53 max(cond, |y|), maximised over the lower orders too.

    Without ``positions`` a derivative is measured by derivatives alone, not by the position it belongs to.
    """
    mechanism = family(name)
    cond = conditions(name, design, phi, list(expected))
    found = {}
    for output in (o for o in expected if o not in mechanism.derivative_of.values()):
        size = mp.mpf(1) if mechanism.pose_output[output].unit == "rad" else mp.mpf(0)
        for order, one in enumerate(ladder(mechanism, output)):
            if order == 1 and not positions:
                size = mp.mpf(0)
            size = max(size, mp.mpf(cond[one]), abs(expected[one]))
            error = abs(mp.mpf(float(got[one])) - expected[one])
            found[one] = float(error / (EPS * size)) if error else 0.0
    return found


def of_kernel(function, designs, phi, shapes, dtype):
    """Return status and outputs of a kernel of poses; ``shapes`` are those of its outputs before (n, m)."""
    shape = (len(designs), phi.shape[1])
    status = np.empty(shape, np.uint8)
    rooms = [np.empty((*front, *shape), dtype) for front in shapes]
    outputs = sys.modules[getattr(function, "py_func", function).__module__].Outputs
    function(designs.astype(dtype), np.cos(phi), np.sin(phi), status, outputs(*rooms))
    return [status, *rooms]


def assert_compiled_equals_plain(kernel, designs, phi, shapes):
    """Assert that the compiled kernel has the bits of the plain one; complex division may differ by a few roundings."""
    for dtype, tolerance in ((np.float64, 0.0), (np.complex128, 2.0**-44)):
        fast, slow = (of_kernel(f, designs, phi, shapes, dtype) for f in (kernel, kernel.py_func))
        for one, other in zip(fast, slow, strict=True):
            np.testing.assert_allclose(one, other, rtol=tolerance, atol=tolerance)


def assert_gradients_are_those_of_the_reference(name, design, phi, reference, outputs, step=10.0**-12):
    """Assert that the complex step equals a central difference of the 100-digit reference in every length and angle."""
    mechanism = family(name)
    for k, parameter in enumerate(mechanism.parameters):
        if parameter.choices is not None:
            continue
        changed = np.array([design], dtype=complex)
        changed[0, k] += 1j * STEP
        columns = mechanism.poses(changed, Angles.of(np.array([[phi]])), frozenset(mechanism.pose_names))
        with mp.workdps(100):
            ends = []
            for sign in (-1, 1):
                numbers = [mp.mpf(float(x)) for x in design]
                numbers[k] += sign * mp.mpf(step)
                ends.append(reference(numbers, mp.mpf(float(phi))))
            for output in outputs:
                slope = float((ends[1][output] - ends[0][output]) / (2 * mp.mpf(step)))
                got = columns[output][0, 0].imag / STEP
                assert abs(got - slope) <= 1e-11 * max(1.0, abs(slope)), (parameter.name, output)
