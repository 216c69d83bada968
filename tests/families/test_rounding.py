"""Every pose output at inputs rounded differently: it loses the digits that its inputs cost, and hardly more.

Inputs that move by some roundings move an output by its derivatives times these steps.  What it moves beyond that is
the rounding of its own computation, here in units of 2^-53 max(cond, |y|); cond is the sum of |x dy/dx| over all inputs
and the crank angle.  No formula of the project or of the sheets is used, so this finds forms that cancel although the
question is well conditioned: places seen from far away, differences of squares.
"""

from __future__ import annotations

import numpy as np
import pytest

from kernels import status as st
from sweep.families import NAMES, family
from sweep.families.base import Angles, March
from tests.search.subjects import CHAINS, random_designs, subjects
from tests.support.selection import mostly_long

SUBJECTS = subjects()
# Their poses hold a tension at a root; what is held hardly depends on the inputs, but on the rounding of the root.
ROOTED = ("backrest_tension", "backrest_closure")
ASKED = [*(n for n in NAMES if n not in ROOTED and not isinstance(family(n).domain, March)), *CHAINS]
QUICK = ("rssr", "guide", "slotted", "spherical_looper", "cylindrical_looper", "rssr+guide")
KINDS = ("ordinary", "wide", "tiny")  # tiny: the first length, mostly the crank, by 1e-1 to 1e-5 shorter
DESIGNS, ANGLES, TRIALS = 24, 4, 8
UNIT = 2.0**-53
STEP = 1e-6  # relative, of difference quotients: good to 1e-9, and what they multiply are roundings
# Two evaluations differ by twice the error of one, for which the oracle tables allow 16.
ALLOWED = 32.0
# Single poses next to a singularity of an inner loop exceed it, of the kinds above some 1 % in any output.
SHARE = 0.03


def moved(full, designs, columns, phi, value):
    """Largest move beyond first order over cond, and which poses are regular: by output, each (n, m)."""

    def poses(where, at):
        found = full.poses(np.ascontiguousarray(where), Angles.of(at), frozenset(value))
        return {name: np.asarray(found[name], np.float64) for name in value}, np.asarray(found["status"]) == st.OK

    rng = np.random.default_rng(7)
    _, regular = poses(designs, phi)
    slopes = {name: [] for name in value}
    for column in columns:
        ends = [designs.copy(), designs.copy()]
        ends[0][:, column] *= 1.0 + STEP
        ends[1][:, column] *= 1.0 - STEP
        (above, fine), (below, too) = (poses(end, phi) for end in ends)
        regular &= fine & too
        width = (ends[0] - ends[1])[:, [column]]
        for name in value:
            slopes[name].append(np.divide(above[name] - below[name], width, out=0.0 * phi, where=width != 0.0))
    (above, _), (below, _) = poses(designs, phi + STEP), poses(designs, phi - STEP)
    beyond = {name: np.zeros(phi.shape) for name in value}
    for _ in range(TRIALS):
        rounded = designs.copy()
        rounded[:, columns] *= 1.0 + rng.integers(-2, 3, (len(designs), len(columns))) * 2.0 * UNIT
        found, fine = poses(rounded, phi)
        regular &= fine
        for name in value:
            linear = sum(slope * (rounded - designs)[:, [k]] for slope, k in zip(slopes[name], columns, strict=True))
            off = np.abs(found[name] - value[name] - linear)
            beyond[name] = np.maximum(beyond[name], np.minimum(off, np.abs(off - 2.0 * np.pi)))
    for name in value:
        cond = np.abs(phi * (above[name] - below[name]) / (2.0 * STEP))
        cond += sum(np.abs(slope * designs[:, [k]]) for slope, k in zip(slopes[name], columns, strict=True))
        beyond[name] /= UNIT * np.maximum(np.maximum(cond, np.abs(value[name])), np.finfo(float).tiny)
    return beyond, regular


@pytest.mark.parametrize("name", mostly_long(ASKED, QUICK))
def test_pose_outputs_keep_the_digits_that_their_inputs_leave(name):
    subject = SUBJECTS[name]()
    full, outputs = subject.family.precise(), frozenset(subject.outputs)
    columns = [k for k, p in enumerate(full.parameters) if p.choices is None and p.unit not in ("count", "sign")]
    for kind in KINDS:
        designs = random_designs(subject, kind, DESIGNS, 5)
        if not len(designs):
            continue
        phi = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, (len(designs), ANGLES))
        if hasattr(full.domain, "ends"):
            low, high = full.domain.ends(designs)
            phi = low[:, None] + (high - low)[:, None] * (0.05 + 0.9 * phi / (2.0 * np.pi))
        with np.errstate(all="ignore"):
            found = full.poses(designs, Angles.of(phi), outputs)
            value = {output: np.asarray(found[output], np.float64) for output in outputs}
            beyond, regular = moved(full, designs, columns, phi, value)
        assert regular.sum() > 20
        for output in sorted(outputs):
            lost = regular & (beyond[output] > ALLOWED)
            assert lost.sum() <= SHARE * regular.sum(), (kind, output, float(beyond[output][regular].max()))
