"""Guided points, single and driven by crank-rockers, for the tests of their proofs."""

from __future__ import annotations

import numpy as np
from mpmath import mp

from kernels import status as st
from kernels.families import guide
from kernels.families.rssr.certify import InSeries, certify_maxima
from sweep.families import family
from sweep.families.guide import as_crank_rocker
from sweep.quantities.kinds import Request
from sweep.reductions.extrema import true_extrema
from tests.reference.chain import rocker_angle, series
from tests.reference.guide import coupler_point
from tests.support.turn_designs import GUIDE, NEEDLE, guided_four_bars, needle_drives

DOUBLE = family(["rssr", "rssr", "guide"])

CURVES = {"ds": (0, 1), "d2s": (0, 2), "d3s": (0, 3), "dev": (1, 0), "ddev": (1, 1), "d2dev": (1, 2)}


def double_drives(n, seed):
    first, r = needle_drives(n, seed), np.random.default_rng(seed + 5)
    coupling = np.column_stack([r.choice([-1.0, 1.0], n), r.uniform(-3.0, 3.0, n)])
    return np.column_stack([needle_drives(n, seed + 50)[:, :8], first[:, :8], coupling, first[:, 8:], np.zeros((n, 2))])


# Family, designs, first columns of crank-rockers and of couplings, column of the guide.
MAKERS = {
    "guide": (GUIDE, guided_four_bars, (), (), 0),
    "rssr+guide": (NEEDLE, needle_drives, (0,), (17,), 8),
    "rssr+rssr+guide": (DOUBLE, double_drives, (0, 8), (16, 27), 18),
}


def parts(designs, rockers, couplings, last):
    """Return the arguments of the kernel from a design matrix."""
    driven_by = np.ascontiguousarray(designs[:, last : last + 9])
    stages = np.stack([*(designs[:, k : k + 8] for k in rockers), as_crank_rocker(driven_by)])
    joined = np.reshape([designs[:, k : k + 2] for k in couplings], (len(couplings), len(designs), 2))
    shares = np.empty((len(designs), 8))
    guide.point_shares(driven_by, shares)
    return InSeries(stages, joined, shares)


def rotating(name, n, seed, curves=("d2s",)):
    """Return designs that turn fully, with the searched maxima of some curves: (m, n) each."""
    mechanism, make, *_ = MAKERS[name]
    designs = make(n, seed)
    requests = [Request(curve, 0) for curve in curves]
    found, status = true_extrema(mechanism, designs, requests, 1e-8, locate=True)
    good = status == st.OK
    columns = [[getattr(found[r], field)[good] for r in requests] for field in ("value", "phi", "err")]
    return designs[good], *map(np.array, columns)


def certify(name, designs, curves, value, phi, target=1e-8, most=1000, function=certify_maxima):
    """Return maxima, places, errors, status and number of enclosures, from claimed maxima."""
    _, _, rockers, couplings, last = MAKERS[name]
    which = np.array([CURVES[curve] for curve in curves], np.int64)
    out = {"status": np.zeros(np.shape(value), np.uint8), "max": np.array(value, float), "phi": np.array(phi, float)}
    out |= {"error": np.full(np.shape(value), np.nan), "cells": np.empty(len(designs))}
    function(parts(designs, rockers, couplings, last), which, target, most, *out.values())
    return out


def exact_point(design, rockers, couplings, last):
    """Return functions of phi for travel and deviation in 50 digits."""
    numbers = [mp.mpf(float(x)) for x in design]
    turns = [lambda phi, k=k: rocker_angle(tuple(numbers[k : k + 8]), phi) for k in rockers]
    coupled = [(numbers[k], numbers[k + 1]) for k in couplings]
    ends = [lambda phi, j=j: coupler_point(tuple(numbers[last : last + 9]), phi)[j] for j in (0, 1)]
    return [series([*turns, end], coupled) for end in ends]
