"""Errors at loose targets: places among tops as high as each other or nearly so, kinks, means near two dips."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from kernels import status as st
from sweep.families import family
from sweep.reductions.rounding import PLACES, shaken

LOOSE = (1e-2, 1e-3, 1e-4, 1e-6)
# The least speeds of the planet's lobes differ by 2e-2 of the range and less: the first within the error was taken.
DWELLS = {"k": 1.4245630592176546, "a": 0.22036669890354088, "n": 8.0, "mesh": 1.0}
MIRRORED = {
    "r": 1.2519606709300977, "l": 4.372750039443259, "h": 2.747313031150216, "a": 0.45207440385170483,
    "b": 1.4799122434978336, "omega1": 0.8926870103285196, "branch": -1.0,
}  # fmt: skip
# Rises and falls with the same largest acceleration.
LEVER = {
    "lift": 0.3715295958583479, "rise": 1.4956692306959556, "dwell": 1.4560974445609043, "fall": 1.6602861848042223,
    "start": 0.12381126582399567, "law": 1.0, "r0": 3.077496164932092, "c": 4.513610200637452, "e": 5.499912284606206,
    "branch": -1.0,
}  # fmt: skip
# Its dips, at 0 and near pi, have singularities 0.047 and 0.066 rad away.
TWO_DIPS = {
    "a": 1.9268763933866573, "b": 1.9857303646167122, "c": 1.9656301965846326, "e": 2.0223296798439447,
    "xi": -6.839046665790202, "eta": -0.7811563079233323, "lam": 0.8397451300468926, "h": 0.29401784723936425,
    "branch": -1.0,
}  # fmt: skip
TURNS_BACK = {
    "P_h": 62.80629427109646, "X1": 3.0482696155355464, "Z1": 11.524173229991803, "e": 5.2750498327862525,
    "R0": 30.16817055396681, "mu1": 0.11016494344405917, "mu2": 0.10264688952140946, "A1": 8.69808430784796,
    "B2": 2.7075944577682103,
}  # fmt: skip


def brute(name, design, output, middle=np.pi, width=np.pi, sign=1.0):
    """Place of the highest of ever closer poses."""
    for _ in range(6):
        phi = middle + width * np.linspace(-1.0, 1.0, 4001)
        values = sign * sweep.evaluate(name, design, [output], phi=phi)[output].to_numpy()
        middle, width = phi[values.argmax()], width / 500.0
    return middle


@pytest.mark.parametrize("target", LOOSE)
def test_the_place_is_that_of_the_highest_of_tops_that_differ_by_less_than_the_target(target):
    found = sweep.summarise("epicyclic_dwell", DWELLS, ["phi_min_dpsi"], accuracy=target).iloc[0]
    off = abs(found["phi_min_dpsi"] - brute("epicyclic_dwell", DWELLS, "dpsi", sign=-1.0))
    assert found["status"] == st.OK
    # Poses of a flat top are the same within a root of their rounding.
    assert off <= found["err_phi_min_dpsi"] + 1e-7


@pytest.mark.parametrize("target", [*LOOSE, 1e-8, 1e-10, 1e-12])
@pytest.mark.parametrize(
    ("name", "design", "output", "place"),
    [
        ("kim_dison", MIRRORED, "phi_min_discriminant", 0.978488918),
        ("kim_dison", MIRRORED, "phi_max_abs_omega3", 0.925016147),
        ("cam_lever", LEVER, "phi_max_abs_d2psi", 0.439883365),
    ],
)
def test_of_tops_as_high_as_each_other_the_first_counts_at_every_target(name, design, output, place, target):
    """Their heights differ by the rounding of poses, of which the errors of narrow tops knew nothing."""
    found = sweep.summarise(name, design, [output], accuracy=target).iloc[0]
    assert found["status"] == st.OK and found[output] == pytest.approx(place, abs=1e-8)


@pytest.mark.parametrize("target", LOOSE)
def test_the_place_of_a_pressure_angle_of_zero_is_within_its_error(target):
    """There its magnitude turns back: a quartic misplaces the tip by up to a quarter of a step."""
    found = sweep.summarise("guided_cam", TURNS_BACK, ["phi_min_pressure_angle"], accuracy=target).iloc[0]
    place = found["phi_min_pressure_angle"]
    exact = brute("guided_cam", TURNS_BACK, "pressure_angle", place, 0.01, -1.0)
    assert found["status"] == st.OK
    assert abs(place - exact) <= found["err_phi_min_pressure_angle"] + 1e-10


@pytest.mark.parametrize("target", [1e-1, 1e-2, 1e-3])
@pytest.mark.parametrize("output", ["ds", "d2s", "d3s", "d2dev"])
def test_means_near_two_dips_are_within_their_errors(output, target):
    """Amplitudes of orders n/8 and n/4 grow and fall by turns there."""
    phi = np.arange(4096) * (2.0 * np.pi / 4096)  # 30 samples per distance of the nearest singularity
    exact = np.sqrt(np.square(sweep.evaluate("guide", TWO_DIPS, [output], phi=phi)[output]).mean())
    found = sweep.summarise("guide", TWO_DIPS, [f"rms_{output}"], accuracy=target).iloc[0]
    assert found["status"] == st.OK
    assert abs(found[f"rms_{output}"] - exact) <= min(found[f"err_rms_{output}"], target * exact) + 1e-11 * exact


@pytest.mark.parametrize("name", ["rssr", "guided_cam"])
def test_rounding_at_several_poses_is_the_largest_of_each(name):
    mechanism = family(name)
    design = np.array([[mechanism.example.get(p.name, p.default) for p in mechanism.parameters]])
    phi, output = np.arange(PLACES)[None] * (2.0 * np.pi / PLACES), mechanism.position
    alone = [shaken(mechanism, design, one, output)[0] for one in phi.T]
    assert shaken(mechanism, design, phi, output)[0] == max(alone) > 0.0
