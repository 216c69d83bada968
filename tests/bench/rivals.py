"""What the kernels are measured against: numpy with the same formulas, and C compiled with everything allowed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def numpy_maxima(designs: Array, cos: Array, sin: Array) -> tuple[Array, Array, Array]:
    """Least Delta/b^2 and largest |psi'|, |psi''| by whole-array expressions of the same formulas."""
    a, b, c, e, f, g, alpha, branch = (designs[:, k, None] for k in range(8))
    sa, ca = np.sin(alpha), branch * np.cos(alpha)
    q = (f - g) ** 2 + 4.0 * f * g * np.sin(0.5 * alpha) ** 2
    k0 = 0.5 * ((c - b) * (c + b) + a * a + e * e + q) / (a * c)
    k1, k2, e, y0 = g * sa / c, e / c, e / a, branch * f * sa / a
    u, v = cos[None], sin[None]
    hu, hv = ca * u, ca * v
    x, y, w1 = e - u, y0 + hv, k2 * u - k1 * v
    w = k0 - w1
    r = x * x + y * y
    delta = r - w * w
    t = np.sqrt(np.maximum(delta, 1e-300))
    per_r, per_t = 1.0 / r, 1.0 / t
    cn, s = (x * w + y * t) * per_r, (x * t - y * w) * per_r
    p = (k1 * u + k2 * v - (v * cn - hu * s)) * per_t
    acceleration = (w1 - (u * cn + hv * s) + p * (w * p - 2.0 * (v * s + hu * cn))) * per_t
    return (delta.min(axis=1) * (a / b)[:, 0] ** 2, np.abs(p).max(axis=1), np.abs(acceleration).max(axis=1))


C_SOURCE = r"""
#include <math.h>

static double big(double a, double b) { return a > b ? a : b; }
static double small(double a, double b) { return a < b ? a : b; }

/* The algebra of kernels/families/rssr/dense.py. */
void ours(long n, long m, const double *d, const double *cosp, const double *sinp,
          double *least, double *m1, double *m2)
{
    for (long i = 0; i < n; i++, d += 8) {
        double a = d[0], b = d[1], c = d[2], f = d[4], g = d[5], branch = d[7];
        double sa = sin(d[6]), c0 = cos(d[6]), h = sin(0.5 * d[6]), k = cos(0.5 * d[6]);
        double q = c0 >= 0 ? (f - g) * (f - g) + 4 * f * g * h * h : (f + g) * (f + g) - 4 * f * g * k * k;
        double k0 = 0.5 * ((c - b) * (c + b) + a * a + d[3] * d[3] + q) / (a * c);
        double k1 = g * sa / c, k2 = d[3] / c, e = d[3] / a, y0 = branch * f * sa / a, ca = branch * c0;
        double lo = 1e300, v1 = 0, v2 = 0;
        for (long j = 0; j < m; j++) {
            double u = cosp[j], v = sinp[j], hu = ca * u, hv = ca * v;
            double x = e - u, y = y0 + hv, w1 = k2 * u - k1 * v, w = k0 - w1;
            double rr = x * x + y * y, delta = rr - w * w;
            lo = small(lo, delta);
            double t = sqrt(big(delta, 1e-300)), shared = 1 / (rr * t);
            double per_r = t * shared, per_t = rr * shared;
            double cn = (x * w + y * t) * per_r, s = (x * t - y * w) * per_r;
            double p = (k1 * u + k2 * v - (v * cn - hu * s)) * per_t;
            double gs = v * s + hu * cn;
            double acc = (w1 - (u * cn + hv * s) + p * (w * p - (gs + gs))) * per_t;
            v1 = big(v1, fabs(p));
            v2 = big(v2, fabs(acc));
        }
        least[i] = lo * a * a / (b * b); m1[i] = v1; m2[i] = v2;
    }
}

/* The formulas of the theory sheet, section 1.3, "cheapest stable evaluation", as they stand. */
void sheet(long n, long m, const double *d, const double *cosp, const double *sinp,
           double *least, double *m1, double *m2)
{
    for (long i = 0; i < n; i++, d += 8) {
        double a = d[0], b = d[1], c = d[2], e = d[3], f = d[4], g = d[5], branch = d[7];
        double sa = sin(d[6]), ca = cos(d[6]), h = sin(0.5 * d[6]), k = cos(0.5 * d[6]);
        double q = ca >= 0 ? (f - g) * (f - g) + 4 * f * g * h * h : (f + g) * (f + g) - 4 * f * g * k * k;
        double K = (c - b) * (c + b) + a * a + e * e + q;
        double k0 = K / (2 * c), k1 = a * g * sa / c, k2 = a * e / c, r = a / c;
        double lo = 1e300, v1 = 0, v2 = 0;
        for (long j = 0; j < m; j++) {
            double u = cosp[j], v = sinp[j];
            double X = e - a * u, Y = f * sa + a * ca * v, W = k0 + k1 * v - k2 * u;
            double R = X * X + Y * Y, delta = R - W * W;
            lo = small(lo, delta);
            double T = branch * sqrt(big(delta, 1e-300));
            double C = -(X * W + Y * T) / R, S = (Y * W - X * T) / R;
            double xc = e + c * C, yc = c * ca * S - g * sa, xi = u * xc + v * yc, eta = u * yc - v * xc;
            double p = r * eta / T;
            double Gps = -a * (v * S + u * ca * C);
            double acc = -(r * xi + p * (2 * Gps + W * p)) / T;
            v1 = big(v1, fabs(p));
            v2 = big(v2, fabs(acc));
        }
        least[i] = lo / (b * b); m1[i] = v1; m2[i] = v2;
    }
}
"""
