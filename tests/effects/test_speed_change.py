"""A crank whose speed changes: what depends on that counts it alone too; what presumes an even crank leaves it out."""

from __future__ import annotations

import numpy as np
import pytest

import sweep
from tests.effects.test_motor_line import BODIES, LINKS

PHI = np.linspace(0.0, 6.0, 25)
EYELET = {"a": 2.0, "e": 3.0, "f": 1.0, "alpha": 0.5, "Z1": -3.0, "Z2": 4.0, "P_h": 8.0}


def test_acceleration_of_the_thread_counts_the_change_of_speed_asked_alone_too():
    row = EYELET | {"speed": 50.0, "speed_change": 1000.0}
    path = sweep.evaluate("eyelet", EYELET, ["dP", "d2P"], phi=PHI)
    expected = path.d2P * 50.0**2 + path.dP * 1000.0
    for wanted in (["thread_acceleration"], ["thread_acceleration", "drive_torque"]):
        found = sweep.evaluate("eyelet", row, wanted, phi=PHI).thread_acceleration
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("output", ["lag1", "frequency_ratio1", "lag_dynamic1"])
def test_an_elastic_coupler_presumes_an_even_crank_also_for_the_stages_behind(output):
    chain = {f"{name}{k}": value for k in "12" for name, value in (LINKS | BODIES).items()}
    chain |= {"kappa2": -1.0, "offset2": 0.3, "a2": 8.0, "driven_inertia1": 0.5, "stiffness1": 2e4, "damping1": 1.0}
    even = sweep.evaluate(["rssr", "rssr"], chain | {"speed1": 90.0}, [output], phi=PHI)
    changing = sweep.evaluate(["rssr", "rssr"], chain | {"speed1": 90.0, "speed_change1": 4000.0}, [output], phi=PHI)
    assert (even.status == 0).all()
    assert even[output].tolist() == changing[output].tolist()
