"""What the kernels are measured against: numpy with the sheet's formulas, and C compiled with everything allowed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEVELS = ("discriminant", "position", "velocity", "acceleration", "jerk")
BLOCK = 16  # designs at a time, numpy's best case: its temporaries stay in the caches


def in_numpy(level: str, designs: Array, u: Array, v: Array) -> Array:
    """One number per design by whole-array expressions: least Delta, largest sin(psi) or largest transfer function."""
    return np.concatenate([_block(level, designs[k : k + BLOCK], u, v) for k in range(0, len(designs), BLOCK)])


def _block(level: str, designs: Array, u: Array, v: Array) -> Array:
    a, b, c, e, f, g, alpha, branch = (designs[:, k, None] for k in range(8))
    sa, ca = np.sin(alpha), np.cos(alpha)
    square = (c - b) * (c + b) + (a * a + e * e) + (f - g) ** 2 + 4.0 * f * g * np.sin(0.5 * alpha) ** 2
    k1, k2 = a * g * sa / c, a * e / c
    x, y, w = e - a * u, f * sa + (a * ca) * v, 0.5 * square / c + k1 * v - k2 * u
    rr = x * x + y * y
    delta = rr - w * w
    if level == "discriminant":
        return np.asarray(delta.min(axis=1))
    t = branch * np.sqrt(np.maximum(delta, 1e-300))
    sp = (y * w - x * t) / rr
    if level == "position":
        return np.asarray(sp.max(axis=1))
    cp = -(x * w + y * t) / rr
    xc, yc = e + c * cp, c * ca * sp - g * sa
    xi, eta = u * xc + v * yc, u * yc - v * xc
    g_ph = -(a / c) * eta
    p = -g_ph / t
    if level == "velocity":
        return np.asarray(np.abs(p).max(axis=1))
    g_phps = -a * (v * sp + u * ca * cp)
    q = -((a / c) * xi + p * (2.0 * g_phps + w * p)) / t
    if level == "acceleration":
        return np.asarray(np.abs(q).max(axis=1))
    g_phphps, g_phpsps = a * (v * ca * cp - u * sp), k1 * u + k2 * v - g_ph
    jerk = (g_ph - p * (3.0 * g_phphps + p * (3.0 * g_phpsps - t * p)) - 3.0 * q * (g_phps + w * p)) / t
    return np.asarray(np.abs(jerk).max(axis=1))


def geared_in_numpy(designs: Array, c: Array, s: Array) -> Array:
    """Largest |psi''| of geared dwell drives over half a turn, in the polynomials of the sheet's section 1.1."""
    found = []
    for start in range(0, len(designs), BLOCK):
        k, a = designs[start : start + BLOCK, 0, None], designs[start : start + BLOCK, 1, None]
        square = 4.0 + a * a + k * k + 2.0 * a * k + c * (4.0 * (a - k) - 4.0 * a * k * c)
        q = 4.0 + 6.0 * a * k - a * a - k * k + 4.0 * a * k * c * (a - k + c)
        found.append(np.abs(2.0 * (a + k) * s * q / (square * square)).max(axis=1))
    return np.concatenate(found)


C_SOURCE = r"""
#include <math.h>

#define DESIGN \
  const double *p = d + 8*i; \
  double a = p[0], b = p[1], c = p[2], e = p[3], f = p[4], g = p[5], branch = p[7]; \
  double sa = sin(p[6]), ca = cos(p[6]), h = sin(.5*p[6]), k = cos(.5*p[6]); \
  double q = ca >= 0 ? (f-g)*(f-g) + 4*f*g*h*h : (f+g)*(f+g) - 4*f*g*k*k; \
  double K = (c-b)*(c+b) + (a*a + e*e) + q;

/* The formulas of the theory sheet, section 1.3, "cheapest stable evaluation", as they stand. */
#define CLOSURE \
  double u = cs[j], v = sn[j], X = e - a*u, Y = fsa + aca*v, W = k0 + k1*v - k2*u, R = X*X + Y*Y, D = R - W*W;
#define ROOT double T = branch*sqrt(D > 1e-300 ? D : 1e-300), S = (Y*W - X*T)/R;
#define FIRST \
  double C = -(X*W + Y*T)/R, xc = e + c*C, yc = cca*S - gsa, xi = u*xc + v*yc, eta = u*yc - v*xc; \
  double Gp = -r*eta, q1 = -Gp/T;
#define SECOND double Gps = -a*(v*S + u*ca*C), q2 = -(r*xi + q1*(2*Gps + W*q1))/T;
#define THIRD \
  double Gpps = a*(v*ca*C - u*S), Gpss = k1*u + k2*v - Gp; \
  double q3 = (Gp - q1*(3*Gpps + q1*(3*Gpss - T*q1)) - 3*q2*(Gps + W*q1))/T;
#define LEVEL(NAME, START, BODY, VALUE, BETTER) \
void NAME(long n, long m, const double *d, const double *cs, const double *sn, double *out) { \
  for (long i = 0; i < n; i++) { DESIGN \
    double fsa = f*sa, aca = a*ca, cca = c*ca, gsa = g*sa, r = a/c, k0 = K/(2*c), k1 = a*g*sa/c, k2 = a*e/c; \
    double best = START; \
    for (long j = 0; j < m; j++) { CLOSURE BODY double x = VALUE; best = x BETTER best ? x : best; } \
    out[i] = best; (void)branch; (void)cca; (void)gsa; (void)r; } }
LEVEL(discriminant, 1e300, , D, <)
LEVEL(position, -1, ROOT, S, >)
LEVEL(velocity, 0, ROOT FIRST, fabs(q1), >)
LEVEL(acceleration, 0, ROOT FIRST SECOND, fabs(q2), >)
LEVEL(jerk, 0, ROOT FIRST SECOND THIRD, fabs(q3), >)

/* The algebra of kernels/families/rssr/motion.py: units of the crank, one division. */
void ours(long n, long m, const double *d, const double *cs, const double *sn, double *out) {
  for (long i = 0; i < n; i++) { DESIGN
    double k0 = .5*K/(a*c), k1 = g*sa/c, k2 = e/c, y0 = branch*f*sa/a, best = 0;
    e /= a; ca *= branch;
    for (long j = 0; j < m; j++) {
      double u = cs[j], v = sn[j], hu = ca*u, hv = ca*v, X = e - u, Y = y0 + hv, w1 = k2*u - k1*v, W = k0 - w1;
      double R = X*X + Y*Y, D = R - W*W, T = sqrt(D > 1e-300 ? D : 1e-300), shared = 1/(R*T);
      double per_r = T*shared, per_t = R*shared, C = (X*W + Y*T)*per_r, S = (X*T - Y*W)*per_r;
      double q1 = (k1*u + k2*v - (v*C - hu*S))*per_t, z = v*S + hu*C;
      double x = fabs((w1 - (u*C + hv*S) + q1*(W*q1 - (z + z)))*per_t);
      best = x > best ? x : best; }
    out[i] = best; } }

void geared(long n, long m, const double *d, const double *cs, const double *sn, double *out) {
  for (long i = 0; i < n; i++) {
    double k = d[2*i], a = d[2*i+1], best = 0;
    double q0 = 4 + 6*a*k - a*a - k*k, q1 = 4*a*k*(a-k), q2 = 4*a*k, d0 = 4 + a*a + k*k + 2*a*k, d1 = 4*(a-k);
    for (long j = 0; j < m; j++) {
      double c = cs[j], D = d0 + c*(d1 - q2*c), x = fabs(2*(a+k)*sn[j]*(q0 + c*(q1 + c*q2))/(D*D));
      best = x > best ? x : best; }
    out[i] = best; } }
"""
