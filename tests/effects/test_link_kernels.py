"""Kernels of loopers' loads: compiled as in plain Python, to the last bit, and friction beside its reversals.

No flag of these kernels lets the compiler contract or reorder, so both ways round alike; the length of a vector is the
one call that may not: hypot of the C library and that of Python differ by a unit in the last place.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import sweep
from kernels import status as st
from kernels.effects.link_friction import link_friction
from kernels.effects.link_loads import link_loads
from sweep.effects import link_loads as loads_effect
from sweep.families import family
from sweep.families.link_tree import LinkTree
from tests.effects.test_link_loads import DESIGNS, OMEGA, TOOL, WEIGHT, design, masses, rubbing

PHI = np.array([0.0, 0.3, 1.7, np.pi, 4.4, 6.1])
# Designs of which some poses are hard: next to a dead point, or to a crank pin in the swivel block.
HARD = {
    "five_link": {"b": 2.2, "c": 3.2},
    "slotted fork": {"e": 1.0 + 1e-9, "g": 0.0, "f": 0.0, "alpha": 0.0, "s": 1e-7},
    "slotted bar": {"e": 1.1, "g": 0.0},
    "swivel": {"e": 1.0 + 1e-7, "f": 0.0, "g": 0.0, "alpha": 0.0},
    "spherical_looper": {"b2": 5.5},
    "cylindrical_looper sliding": {"b1": 3.6},
    "cylindrical_looper held": {"b1": 3.5},
    "cylindrical_looper beside": {"d2": 1.9},
}
VALUES = 4e-13  # of the largest value: rounding of hypot through the elimination and the passes
STEEP = 1e-6  # of hard poses, whose condition is up to 1e9


def given_to(monkeypatch, module, name, run):
    """Arguments that an effect gives its kernel."""
    calls = []
    kernel = getattr(getattr(module, name), name)

    def caught(*arguments):
        calls.append(arguments)
        kernel(*arguments)

    monkeypatch.setattr(module, name, SimpleNamespace(**{**vars(getattr(module, name)), name: caught}))
    run()
    monkeypatch.undo()
    assert calls
    return calls[0]


def both(kernel, arguments, status_at, outs, fresh):
    """What the compiled kernel and its plain Python make of the same arguments."""
    found = []
    for function in (kernel, kernel.py_func):
        given = list(arguments)
        given[status_at] = np.where(arguments[status_at] == st.JAMMED, 0, arguments[status_at]).astype(np.uint8)
        given[status_at][given[status_at] == st.DEAD_POINT] = 0
        for at, shape in zip(outs, fresh, strict=True):
            given[at] = np.full(shape, 7.0)
        function(*given)
        found.append([given[status_at], *(given[at] for at in outs)])
    return found


@pytest.mark.parametrize("hard", [False, True])
@pytest.mark.parametrize("case", DESIGNS)
def test_loads_compiled_are_those_of_plain_python(monkeypatch, case, hard):
    name, d = design(case)
    table = d | (HARD[case] if hard else {}) | masses(name)[0] | TOOL | WEIGHT | {"speed": OMEGA}
    arguments = given_to(monkeypatch, loads_effect, "link_loads",
                         lambda: sweep.evaluate(name, table, ["drive_torque"], phi=PHI))  # fmt: skip
    n, m, q = *arguments[3].shape, len(family(name).find(LinkTree).joints)
    shapes = ((n, m, q, 6), (n, 3, m), (n, 3, m), (n, m), (n, m, 2), (n, m, 4))
    fast, slow = both(link_loads, arguments, 3, range(4, 10), shapes)
    np.testing.assert_array_equal(fast[0], slow[0])
    for one, two in zip(fast[1:], slow[1:], strict=True):
        scale = np.nanmax(np.abs(two), initial=0.0)
        np.testing.assert_allclose(one, two, rtol=0.0, atol=(STEEP if hard else VALUES) * scale)


@pytest.mark.parametrize("mu", [0.02, 9.0])
@pytest.mark.parametrize("hard", [False, True])
@pytest.mark.parametrize("case", DESIGNS)
def test_friction_compiled_is_that_of_plain_python(monkeypatch, case, hard, mu):
    name, d = design(case)
    table = d | (HARD[case] if hard else {}) | masses(name)[0] | TOOL | WEIGHT | {"speed": OMEGA} | rubbing(name, mu)
    phi = PHI if mu < 1.0 else PHI[:3]
    arguments = given_to(monkeypatch, loads_effect, "link_friction",
                         lambda: sweep.evaluate(name, table, ["drive_torque_friction"], phi=phi))  # fmt: skip
    n, m, q = *arguments[4].shape, len(family(name).find(LinkTree).joints)
    shapes = ((n, m, q, 6), (n, m), (n, m, q + 1), (n, m, q, 2))
    fast, slow = both(link_friction, arguments, 4, range(5, 9), shapes)
    np.testing.assert_array_equal(fast[0], slow[0])
    if mu > 1.0 and not hard:
        assert st.JAMMED in fast[0]
    for one, two in zip(fast[1:], slow[1:], strict=True):
        scale = np.nanmax(np.abs(two), initial=0.0)
        np.testing.assert_allclose(one, two, rtol=0.0, atol=(STEEP if hard else VALUES) * scale)


def test_a_pose_off_by_rounding_of_single_precision_is_seen(monkeypatch):
    """Negative control of the tolerance."""
    name, d = design("swivel")
    table = d | masses(name)[0] | TOOL | {"speed": OMEGA}
    arguments = list(given_to(monkeypatch, loads_effect, "link_loads",
                              lambda: sweep.evaluate(name, table, ["drive_torque"], phi=PHI)))  # fmt: skip
    right, wrong = np.empty((1, len(PHI))), np.empty((1, len(PHI)))
    link_loads(*arguments[:4], None, None, None, right, None, None)
    given = arguments[2]
    rounded = {name: getattr(given, name).astype(np.float32).astype(np.float64) for name in ("bodies", "tool")}
    link_loads(*arguments[:2], given._replace(**rounded), arguments[3], None, None, None, wrong, None, None)
    assert np.abs(wrong - right).max() > VALUES * np.abs(right).max()


def test_friction_beside_a_reversal_is_not_lost_in_rounding():
    """Largest loads stand beside the jump where the rod turns back in its block: they are its one-sided limits."""
    rng = np.random.default_rng(1)
    n, name, wanted = 200, "swivel", "max_abs_force_a_friction"
    table = {"a": np.ones(n), "e": rng.uniform(1.2, 3.0, n), "f": rng.uniform(-1.0, 1.0, n),
             "g": rng.uniform(-1.0, 1.0, n), "alpha": rng.uniform(0.0, 1.5, n),
             "Lw": rng.uniform(0.0, 6.0, n)}  # fmt: skip
    table |= masses(name)[0] | TOOL | WEIGHT | {"speed": OMEGA} | rubbing(name, 0.05)
    found = sweep.summarise(name, table, [wanted, f"phi_{wanted}"], accuracy=1e-9)
    assert (found["status"] == st.OK).all()
    assert (found[f"err_{wanted}"] <= 1e-9 * found[wanted]).all()
    jumps = 0
    for k in range(n):
        own = {key: x[k] if np.ndim(x) else x for key, x in table.items()}
        phi = found[f"phi_{wanted}"][k]
        # Seven decades of distance on both sides: the limit is approached in proportion to the distance.
        near = sweep.evaluate(name, own, ["force_a_friction"], phi=phi + np.concatenate([
            sign * 10.0 ** np.arange(-10.0, -3.0) for sign in (-1.0, 1.0)
        ]))["force_a_friction"].to_numpy()  # fmt: skip
        limit = max(near[0], near[7])
        jumps += abs(near[0] - near[7]) > 1e-5 * limit
        assert abs(limit - found[wanted][k]) <= 3e-9 * limit  # 1e-10 rad away at slopes of some sizes a radian
    assert jumps >= 2  # of 200
