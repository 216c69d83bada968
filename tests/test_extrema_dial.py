"""The accuracy dial: a smaller target gives a smaller error, and ``err_`` bounds it in at least 99.9 % of all cases.

The reference is the same search with four times as many samples to begin with and a target of 1e-13; that it is right
is shown by tests/test_extrema_reference.py.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kernels import status as st
from sweep.families.base import Accuracy
from sweep.reductions import extrema
from sweep.reductions.extrema import Request, true_extrema
from sweep.summaries import design_outputs
from tests.turn_designs import NEEDLE, RSSR, crank_rockers, needle_drives

TARGETS = (1e-2, 1e-4, 1e-6, 1e-8)
REQUESTS = {"rssr": (Request("d2psi", 0), Request("d3psi", 0)), "rssr+guide": (Request("d2s", 0), Request("s", 1))}


@pytest.fixture(scope="module", params=["rssr", "rssr+guide"])
def case(request):
    family, make, n = (RSSR, crank_rockers, 4000) if request.param == "rssr" else (NEEDLE, needle_drives, 2000)
    family = replace(family, steps=())
    designs = make(8 * n, 21)
    margin = design_outputs(family, designs, ["margin"], Accuracy(target=1e-8))
    designs = designs[(margin["status"] == st.OK) & (margin["margin"] > 1e-5)][:n]
    requests = REQUESTS[request.param]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(extrema, "START", 128)
        patch.setattr(extrema, "ROUGH", 0.05)
        reference, status = true_extrema(family, designs, requests, 1e-13)
    assert (status == st.OK).all()
    return family, designs, requests, reference


def test_errors_fall_with_the_target_and_stay_below_it(case):
    family, designs, requests, reference = case
    worst = []
    for target in TARGETS:
        found, status = true_extrema(family, designs, requests, target)
        assert (status == st.OK).all()
        relative = np.abs(found[requests[0]].value - reference[requests[0]].value) / reference[requests[0]].value
        assert np.quantile(relative, 0.999) <= target
        assert relative.max() <= 10.0 * target
        worst.append(np.quantile(relative, 0.999))
    assert worst[0] > 10.0 * worst[1] > 100.0 * worst[2] > 1000.0 * worst[3]


@pytest.mark.parametrize("target", TARGETS)
def test_error_estimates_bound_the_error(case, target):
    family, designs, requests, reference = case
    found, _ = true_extrema(family, designs, requests, target)
    for request in requests:
        error = np.abs(found[request].value - reference[request].value)
        claimed = found[request].err + reference[request].err
        assert (error <= claimed).mean() >= 0.999
        # An estimate that is always huge would bound everything and say nothing.
        assert np.median(found[request].err / np.abs(reference[request].value)) <= target
