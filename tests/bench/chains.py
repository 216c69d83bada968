"""Speed of fused chains on this machine: ``python -m tests.bench.chains``.

The needle drive [rssr, guide]: ns per (design, crank angle) of the dense loop to acceleration with deviation, next to
C with -O3 -march=native -ffast-math on the same formulas in the same run, and to the stages one after the other; us
per design of true extrema to 1e-8, whatever decides them included, and their ratio to a grid of 360 angles; the same
with the proof that no peak was missed.  Then the dense
loop to acceleration and its true maximum of a driven slider [rssr, rssp].  All variants take turns, and each counts
with its fastest round.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kernels import chains
from kernels.families import guide, rssp, rssr
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy, Angles
from tests.bench.extrema import turning
from tests.bench.kernels import FLAGS, measure
from tests.support.turn_designs import DRIVEN_SLIDER, NEEDLE, driven_sliders, needle_drives

DESIGNS, MANY, SAMPLES, ROUNDS = 2048, 16384, 360, 15
WANTED = (
    ["max_abs_d2s"], ["max_abs_dev"], ["max_abs_d2s", "max_abs_dev"], ["max_abs_d3s"], ["phi_max_abs_d2s"],
    ["stroke"], ["margin2"],
)  # fmt: skip
PROVEN = (["max_abs_ds"], ["max_abs_d2s"], ["max_abs_dev"], ["max_abs_d2s", "max_abs_dev"], ["max_abs_d3s"])
FINE, SURE = Accuracy(target=1e-8), Accuracy(target=1e-8, certify=True)

# docs/rssr.md and docs/guide.md in the algebra of the kernels: one division per stage, equation (22) of docs/chain.md.
C_SOURCE = r"""
#include <math.h>
void needle(long n, long m, const double *d, const double *cs, const double *sn, double *acc, double *dev,
            double *low) {
  for (long i = 0; i < n; i++) {
    const double *p = d + 19*i, *q = p + 8;
    double a = p[0], b = p[1], c = p[2], e = p[3], f = p[4], g = p[5], branch = p[7], sa = sin(p[6]), ca = cos(p[6]);
    double h = sin(.5*p[6]), k = cos(.5*p[6]);
    double far = ca >= 0 ? (f-g)*(f-g) + 4*f*g*h*h : (f+g)*(f+g) - 4*f*g*k*k;
    double k0 = .5*((c-b)*(c+b) + (a*a + e*e) + far)/(a*c), k1 = g*sa/c, k2 = e/c, y0 = branch*f*sa/a;
    e /= a; ca *= branch;
    double A = q[0], B = q[1], C2 = q[2], E = q[3], xi = q[4]/B, eta = q[5]/B, cl = cos(q[6]), sl = sin(q[6]);
    double sign = q[8], K0 = .5*((C2-B)*(C2+B) + (A*A + E*E))/C2, K2 = A*E/C2;
    double along = xi*cl + eta*sl, across = eta*cl - xi*sl;
    double pa = A*(cl - along), pc = -A*(sl + across), qa = C2*along, qc = C2*across, off = across*E - q[7];
    double kappa = p[17], co = cos(p[18]), so = sin(p[18]), best = 0, most = 0, least = 1e300;
    for (long j = 0; j < m; j++) {
      double u = cs[j], v = sn[j], hu = ca*u, hv = ca*v, X = e - u, Y = y0 + hv, w1 = k2*u - k1*v, W = k0 - w1;
      double R = X*X + Y*Y, D = R - W*W, T = sqrt(D > 1e-300 ? D : 1e-300), shared = 1/(R*T);
      double per_r = T*shared, per_t = R*shared, C = (X*W + Y*T)*per_r, S = (X*T - Y*W)*per_r;
      double q1 = (k1*u + k2*v - (v*C - hu*S))*per_t, z = v*S + hu*C;
      double q2 = (w1 - (u*C + hv*S) + q1*(W*q1 - (z + z)))*per_t;
      least = D < least ? D : least;
      double turn = -branch*kappa, t1 = turn*q1, t2 = turn*q2, cpsi = -C, spsi = turn*S;
      u = cpsi*co - spsi*so; v = spsi*co + cpsi*so;
      X = E - A*u; Y = A*v; W = K0 - K2*u; R = X*X + Y*Y; D = R - W*W; T = sign*sqrt(D > 1e-300 ? D : 1e-300);
      shared = 1/(R*T); per_r = T*shared; per_t = R*shared;
      C = -(X*W + Y*T)*per_r; S = (Y*W - X*T)*per_r;
      least = D < least ? D : least;
      double turning = A*(v*C - u*S), near = A*(u*C + v*S);
      q1 = -(turning + K2*v)*per_t; q2 = -(near + K2*u + q1*(W*q1 - 2*near))*per_t;
      double ba = pa*u - pc*v, bc = pa*v + pc*u, ca2 = qa*C - qc*S, cc = qa*S + qc*C;
      double x1 = -(bc + q1*cc), x2 = -(ba + q2*cc + q1*q1*ca2), y = fabs(bc + cc + off);
      double x = fabs(t2*x1 + t1*t1*x2);
      best = x > best ? x : best; most = y > most ? y : most; }
    acc[i] = best; dev[i] = most; low[i] = least; } }
"""


def compiled_rival() -> ctypes.CDLL | None:
    """The C version as a shared library, or None without gcc."""
    if shutil.which("gcc") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / "chain.c", Path(folder) / "chain.so"
        source.write_text(C_SOURCE)
        subprocess.run(["gcc", *FLAGS, str(source), "-o", str(library), "-lm"], check=True)
        return ctypes.CDLL(str(library))


def dense(designs: Any) -> dict[str, tuple[Callable[[], object], float]]:
    """The dense loop, fused, staged and in C: largest |d2s|, largest |dev| and least discriminants."""
    phi, n = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES), len(designs)
    cos, sin, least = np.cos(phi), np.sin(phi), np.empty((n, 2))
    acceleration, deviation = np.empty(n), np.empty(n)
    kernel = chains.dense_maxima(chains.chained((rssr.FORM, guide.FORM)))

    def fused() -> Any:
        kernel(designs, cos, sin, least, None, acceleration, None, deviation, None, None)
        return np.stack([acceleration, deviation])

    def staged() -> Any:
        poses = NEEDLE.poses(designs, Angles(phi[None], cos[None], sin[None]), frozenset(("d2s", "dev")))
        return np.stack([np.abs(poses[name]).max(axis=1) for name in ("d2s", "dev")])

    runs: dict[str, Callable[[], Any]] = {"dense, fused": fused, "dense, stage by stage": staged}
    library = compiled_rival()
    if library is not None:
        out = np.empty((3, n))
        pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in (designs, cos, sin, *out)]

        def in_c() -> Any:
            library.needle(ctypes.c_long(n), ctypes.c_long(SAMPLES), *pointers)
            return out[:2]

        runs["dense, C"] = in_c
    for name, run in runs.items():  # all must find the same numbers, or the race means nothing
        np.testing.assert_allclose(run(), fused(), rtol=1e-6, err_msg=name)
    return {name: (run, float(n * SAMPLES)) for name, run in runs.items()}


def dense_sliders(designs: Any) -> dict[str, tuple[Callable[[], object], float]]:
    """The dense loop of driven sliders, fused and staged: largest |d2s| and least discriminants."""
    phi, n = np.arange(SAMPLES) * (2.0 * np.pi / SAMPLES), len(designs)
    angles, least, acceleration = Angles.of(phi[None]), np.empty((n, 2)), np.empty(n)
    kernel = chains.dense_maxima(chains.chained((rssr.FORM, rssp.FORM)))

    def fused() -> Any:
        kernel(designs, angles.cos[0], angles.sin[0], least, None, acceleration, None, None, None, None)
        return acceleration

    def staged() -> Any:
        return np.abs(DRIVEN_SLIDER.poses(designs, angles, frozenset(("d2s",)))["d2s"]).max(axis=1)

    np.testing.assert_allclose(staged(), fused(), rtol=1e-6)
    count = float(n * SAMPLES)
    return {"dense slider, fused": (fused, count), "dense slider, stage by stage": (staged, count)}


def main(rounds: int = ROUNDS) -> None:
    """Print the table."""
    designs = turning(NEEDLE, needle_drives, MANY)
    runs = dense(np.ascontiguousarray(designs[:DESIGNS]))
    for names in WANTED:
        label = "true " + ", ".join(names)
        runs[label] = (partial(design_outputs, NEEDLE, designs, names, FINE), float(MANY))
    for names in PROVEN:
        label = "proven " + ", ".join(names)
        runs[label] = (partial(design_outputs, NEEDLE, designs, names, SURE), float(MANY))
    sliders = turning(DRIVEN_SLIDER, driven_sliders, MANY)
    runs |= dense_sliders(np.ascontiguousarray(sliders[:DESIGNS]))
    search = partial(design_outputs, DRIVEN_SLIDER, sliders, ["max_abs_d2s"], FINE)
    runs["true slider max_abs_d2s"] = (search, float(MANY))
    best = measure(runs, rounds)
    print(f"needle drives and driven sliders, fastest of {rounds} interleaved rounds\n")
    own = best["dense, fused"]
    for name, ns in best.items():
        if name.startswith("dense"):
            print(f"{name:36}{ns:8.2f} ns per (design, angle)   {ns / own:.2f}")
        else:
            searched = best.get(name.replace("proven", "true"))
            against = f"   {ns / searched:.1f} times the search" if name.startswith("proven") and searched else ""
            grid = f"{ns / (own * SAMPLES):.2f} of the grid of {SAMPLES}"
            print(f"{name:36}{ns / 1e3:8.2f} us per design           {grid}{against}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS)
