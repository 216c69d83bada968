"""Thread tension, wrap and take-ups against the 25-digit table, through the functions of `sweep.thread`.

Tolerance 16 x 2^-53 of the size of the quantity, the factor of the other families.  The size is |y| and what one
rounding of the inputs changes: of a derivative the lengths it is made of, of a place on a cam the place itself.
"""

from __future__ import annotations

import pandas as pd
import pytest
from mpmath import mp

import sweep
from tests.support.oracle_rows import factor, rows

FACTOR = 16.0
GUIDES = ("X1", "Y1", "Z1", "X2", "Y2", "Z2")


def table(kind):
    """The inputs of one kind of row with points as columns of coordinates, and what is expected."""
    found = rows("thread", kind=kind)
    given = []
    for row in found:
        i = dict(row["inputs"])
        for name, columns in (("N1", GUIDES[:3]), ("N2", GUIDES[3:]), ("E", ("X_E", "Y_E", "Z_E"))):
            if name in i:
                i |= dict(zip(columns, i.pop(name), strict=True))
        given.append({name: float(x) for name, x in i.items()})
    return pd.DataFrame(given), [row["expected"] for row in found]


def worst(got, name, expected, sizes=None, key=None):
    sizes = [0.0] * len(got) if sizes is None else sizes
    with mp.workdps(40):
        return max(
            factor(value, e[key or name], size)
            for value, e, size in zip(got[name], expected, sizes, strict=True)
            if (key or name) in e
        )


@pytest.mark.parametrize("name", ["T2", "capstan", "bending", "adhesion", "r_thread"])
def test_contour_tension_matches_oracle_on_every_row(name):
    given, expected = table("tension_radius")
    got = sweep.thread.contour(given)
    assert len(got) == 20
    assert (got.status == 0).all()
    assert worst(got, name, expected) <= FACTOR


def test_speed_ratio_matches_oracle_on_every_row():
    given, expected = table("tension_speed")
    got = sweep.thread.speed(given)
    assert len(got) == 8
    assert (got.status == 0).all()
    assert worst(got, "ratio_to_ref", expected) <= FACTOR


@pytest.mark.parametrize("name", ["L", "wrap", "x", "y", "half_distance_c"])
def test_wrap_angle_matches_oracle_on_every_row(name):
    given, expected = table("wrap_angle")
    got = sweep.thread.wrap(given)
    assert len(got) == 14
    assert (got.status == 0).all()
    # y is a sum of coordinates and may vanish; the differences to the guides are of the thread's length.
    sizes = got["L"] if name == "y" else None
    assert worst(got, name, expected, sizes) <= FACTOR


@pytest.mark.parametrize(
    "name", ["L", "wrap", "dq", "length_error", "weight", "dL_dphi", "d2L_dphi2", "X_E", "Y_E", "Z_E"]
)
def test_eyelet_matches_oracle_on_every_row(name):
    given, expected = table("eyelet")
    for e in expected:
        e |= dict(zip(("X_E", "Y_E", "Z_E"), e["E"], strict=True))
    got = sweep.thread.eyelet(given)
    assert len(got) == 14
    assert (got.status == 0).all()
    # One rounding of phi moves the eyelet by a 2^-53, hence L by as much and dq by the weight; phi itself reaches 2 pi.
    turned = (1.0 + given.phi.abs() + given.phi_h.abs()) * given.a
    size = {"dq": turned * 2.0 * got.weight.abs() / 1.0, "weight": got.weight.abs()}.get(name, turned + got.L)
    size = None if name == "wrap" else size
    assert worst(got, name, expected, size) <= FACTOR


@pytest.mark.parametrize("name", ["S", "dS", "d2S", "theta_jam", "tan_half_theta_jam"])
def test_guided_cam_matches_oracle_on_every_row(name):
    given, expected = table("cam_guided")
    got = sweep.thread.follower(given)
    assert len(got) == 10
    assert (got.status == 0).all()
    assert worst(got, name, expected) <= FACTOR


@pytest.mark.parametrize("name", ["y_contact", "X", "Y", "L", "wrap", "n_minima", "y_limit_plus", "y_limit_minus"])
def test_free_cam_matches_oracle_on_every_row(name):
    given, expected = table("cam_free")
    got = sweep.thread.free_cam(given)
    assert len(got) == 18
    assert (got.status == 0).all()
    assert (got.contact == 1.0).all()
    # X and Y are the place y turned: each may vanish beside the other.
    sizes = got.y_contact.abs() + got.X.abs() if name in ("X", "Y") else None
    assert worst(got, name, expected, sizes) <= FACTOR


def test_wrong_half_of_the_limits_of_the_bare_cam_is_refused_by_the_table():
    # Negative control: exchanged limit points, or those of mu for sin(rho), do not pass.
    given, expected = table("cam_free")
    got = sweep.thread.free_cam(given)
    assert worst(got.rename(columns={"y_limit_plus": "y_limit_minus", "y_limit_minus": "y_limit_plus"}),
                 "y_limit_plus", expected) > 1e10  # fmt: skip
    steeper = given.assign(mu=given.mu / (1.0 - given.mu**2) ** 0.5)
    assert worst(sweep.thread.free_cam(steeper), "y_limit_plus", expected) > 1e10


def test_radians_for_degrees_are_refused_by_the_table():
    # Negative control: beta per degree with the wrap in radians gives hardly any friction at all.
    given, expected = table("tension_radius")
    assert worst(sweep.thread.contour(given.assign(theta_deg=given.theta_deg * 3.14159 / 180.0)), "T2", expected) > 1e12
