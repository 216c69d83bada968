"""Events of the feed mechanism where a loop nearly locks, against its closures in 40 digits."""

from __future__ import annotations

import pytest
from mpmath import mp, mpf

import sweep
from sweep.families import family
from tests.reference import feed as naive

NEAR_LOCK = {
    "h_a": 0.33729450252934484, "h_b": 1.774432032295564, "h_c": 1.7363173932186728, "h_e": 1.9708491795417367,
    "h_f": 0.7316530217821962, "h_g": -1.0153453614753105, "h_alpha": 0.8601439735333187, "rh": 1.3103169914947945,
    "dh": -0.1579679215896972, "xE": 2.67910701178515, "yE": -0.2515988056405618, "rE": 0.2986850721433667,
    "dE": 0.27533385948272215, "q": 1.246301605649613, "fx": -1.1006308507195937, "fy": 0.8261150852935137,
    "tx": 2.1641118522774434, "ty": -1.7731674588189819, "y_plate": -2.0422983643868866, "h_sigma": 1.0,
    "bar_branch": -1.0, "tooth": 0.0, "pitch": 0.0,
}  # fmt: skip


@pytest.mark.parametrize("power", [0, -300, 400])
def test_rise_beside_a_lock_of_the_rocker_is_within_its_error(power):
    """A squared sine of 2.6e-8 of the transmission angle costs the top of the path 4 of its digits.

    The error was that of a path without a lock, 4e-14, and the rise 1.7e-12 off.  The claim may be 4 EPS of the sum of
    the lengths, 22, over the root of that square: 1.2e-10.
    """
    found = sweep.summarise("feed", NEAR_LOCK, ["rise", "phi_max_y_t"], accuracy=1e-8).iloc[0]
    with mp.workdps(40):
        exact = {name: mpf(value) for name, value in NEAR_LOCK.items()}

        def height(phi):
            return naive.tooth(exact, phi).imag

        top = mp.findroot(lambda phi: mp.diff(height, phi), mpf(found.phi_max_y_t))
        off = abs(mpf(found.rise) - (height(top) - exact["y_plate"]))
    assert off <= found.err_rise <= 1.2e-10
    lengths = [p.name for p in family("feed").parameters if p.unit == "length"]
    scaled = NEAR_LOCK | {name: NEAR_LOCK[name] * 2.0**power for name in lengths}
    other = sweep.summarise("feed", scaled, ["rise"], accuracy=1e-8).iloc[0]
    assert (other.rise, other.err_rise) == (found.rise * 2.0**power, found.err_rise * 2.0**power)
