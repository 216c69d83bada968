"""Published best crank-rockers: no design of their space is proven better, and the proof closes on them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.jobs.executors import Here
from sweep.jobs.signals import Stop
from sweep.proof.certificate import concluded
from sweep.proof.question import question_of
from sweep.proof.rounds import Cores, explored
from sweep.study import ProveSettings
from sweep.study.load import load_study

STUDY = """
[study]
name = "published"
[mechanism]
family = "rssr"
[scene]
want = ["max_pressure_angle"]
[locus]
swing = {{ value = {swing}, unit = "deg" }}
phi0 = {{ value = {phi0}, unit = "deg" }}
phi_ext = {{ from = 0, to = 360, unit = "deg" }}
[design]
sample = {{ kind = "sobol", n = 64, seed = 1 }}
alpha = {{ value = 0, unit = "deg" }}
e = {{ value = 100, unit = "mm" }}
f = {{ value = 0, unit = "mm" }}
g = {{ value = 0, unit = "mm" }}
[limits]
rotatable = true
a = {{ min = {crank}, max = 500, unit = "mm" }}
b = {{ max = 500, unit = "mm" }}
c = {{ max = 500, unit = "mm" }}
[objective]
minimise = "max_pressure_angle"
[optimise]
starts = 1
prove = {{ gap = "0.001 %", boxes = 20000 }}
"""


def transmission_of_freudenstein_and_primrose(swing: float, phi0: float) -> float:
    """Best least transmission angle [deg] of planar crank-rockers, from their cubic and plain triangles.

    Q^3 + 2 Q^2 - t^2 Q - (t^2/u^2)(1 + t^2) = 0 with t = tan(phi0/2), u = tan((phi0 - swing)/2); coupler by crank is
    abs(t)/sqrt(Q). The crank's two dead centres then fix rocker and frame.
    """
    t, u = np.tan(np.radians(phi0) / 2.0), np.tan(np.radians(phi0 - swing) / 2.0)
    roots = np.roots([1.0, 2.0, -t * t, -(t * t / u**2) * (1.0 + t * t)])
    (q,) = [float(root.real) for root in roots if abs(root.imag) < 1e-12 and root.real > 0.0]
    b = abs(t) / np.sqrt(q)
    # Crank 1: the rocker's pin lies b + 1 and b - 1 from the crank's axis, the directions 180 deg - phi0 apart.
    apart = np.radians(180.0 - phi0)
    far, near = (b + 1.0) * np.array([1.0, 0.0]), (b - 1.0) * np.array([np.cos(apart), np.sin(apart)])
    chord = far - near
    c = 0.5 * np.hypot(*chord) / np.sin(np.radians(swing) / 2.0)
    middle, across = 0.5 * (far + near), np.array([-chord[1], chord[0]]) / np.hypot(*chord)
    # On this side of the chord crank and rocker turn the same way while the crank turns phi0; on the other 360 - phi0.
    d = np.hypot(*(middle + c * np.cos(np.radians(swing) / 2.0) * across))
    angles = [np.degrees(np.arccos((b * b + c * c - x * x) / (2.0 * b * c))) for x in (d - 1.0, d + 1.0)]
    return min(angles[0], 180.0 - angles[1])


# Swing, crank angle between the limit positions [deg], least crank for 100 mm between the axes [mm], greatest pressure
# angle [deg].  Brodell and Soni's time ratio 1 has no best crank of its own: the shorter the crank, the smaller the
# angle; theirs is the best with their crank or a longer one.
PUBLISHED = [
    pytest.param(45.0, 165.0, 0.0, 90.0 - 36.13782, id="Freudenstein and Primrose"),
    pytest.param(40.0, 180.0, 30.81694119, 40.0, id="Brodell and Soni, 40 deg"),
    pytest.param(60.0, 180.0, 43.74082579, 50.0, id="Brodell and Soni, 60 deg"),
]


def bound(tmp_path: Path, swing: float, phi0: float, crank: float, target: float) -> tuple[float, int]:
    """The proven bound [deg] if boxes below ``target`` [deg] are wanted, and how many boxes stay without a proof."""
    (tmp_path / "study.toml").write_text(STUDY.format(swing=swing, phi0=phi0, crank=crank))
    question = question_of(load_study(tmp_path / "study.toml"))
    settings = ProveSettings(1e-5, 20_000)
    best, cores = np.radians(target), Cores(Here(), 1, Stop())
    found = explored(question, question.in_kernel(best), settings, tmp_path / "parts", cores, lambda *_: None)
    proof = concluded(question, found, best, settings.gap)
    return float(np.degrees(proof.bound)), proof.open + proof.exceptions


@pytest.mark.parametrize(("swing", "phi0", "crank", "published"), PUBLISHED)
def test_nothing_is_better_than_the_published_optimum_by_a_thousandth_of_a_percent(
    tmp_path: Path, swing: float, phi0: float, crank: float, published: float
) -> None:
    # The published numbers have seven digits.
    found, left = bound(tmp_path, swing, phi0, crank, published * (1.0 - 1e-5))
    assert left == 0
    assert published * (1.0 - 2e-5) < found <= published * (1.0 + 1e-6)


@pytest.mark.parametrize(("swing", "phi0", "crank", "published"), PUBLISHED)
def test_more_than_the_published_optimum_is_not_proven(
    tmp_path: Path, swing: float, phi0: float, crank: float, published: float
) -> None:
    _, left = bound(tmp_path, swing, phi0, crank, published * (1.0 + 1e-5))
    assert left > 0


def test_the_cubic_gives_the_published_transmission_angle() -> None:
    assert transmission_of_freudenstein_and_primrose(45.0, 165.0) == pytest.approx(36.13782, abs=5e-6)
