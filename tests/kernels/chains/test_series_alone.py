"""The fused search of a guide whose crank is the main shaft: extrema, places, what does not turn, change points."""

from __future__ import annotations

import numpy as np
import pytest

from kernels import status as st
from sweep.evaluation.summaries import design_outputs
from sweep.families.base import Accuracy
from sweep.quantities.kinds import Request
from sweep.reductions import extrema, fused
from tests.support.climbing import assert_fused_extrema_lie_within_their_errors, climbed
from tests.support.selection import mostly_long
from tests.support.turn_designs import GUIDE, guided_four_bars

EPS = 2.0**-53


def turning(n, seed, shorten=None):
    """Guides that turn, and the inverse of their least margins; ``shorten`` brings them near a change point."""
    designs = guided_four_bars(40 * n, seed)
    if shorten is not None:
        # b is shortened until coupler and rocker just reach the crank's far position, e + a.
        designs[:, 1] = designs[:, 0] + np.abs(designs[:, 3]) - designs[:, 2] + shorten
        designs = designs[designs[:, 1] > 0.1]
    found = design_outputs(GUIDE, designs, ["margin"], Accuracy(target=1e-8))
    good = found["status"] == st.OK
    return np.ascontiguousarray(designs[good][:n]), 1.0 + 1.0 / found["margin"][good][:n]


REQUESTS = (
    Request("d2s", 0), Request("dev", 0), Request("dev", -1), Request("ds", 1), Request("s", 1), Request("x_m", -1),
    Request("d3s", 0), Request("d2dev", 0),
)  # fmt: skip


@pytest.mark.parametrize("request_", mostly_long(REQUESTS, REQUESTS[:3]), ids=str)
def test_extrema_lie_within_their_errors_of_precise_poses_climbed_from_the_search_on_poses(request_):
    designs, _ = turning(400, 3)
    assert_fused_extrema_lie_within_their_errors(GUIDE, designs, request_)


def test_places_are_those_of_the_search_on_poses():
    designs, _ = turning(300, 5)
    request = Request("d2s", 0, place=True)
    found, _ = extrema.true_extrema(GUIDE, designs, [request], 1e-8)
    slow, _ = extrema.true_extrema(GUIDE, designs, [request], 1e-8, locate=True)
    off = np.abs(np.angle(np.exp(1j * (found[request].phi - slow[request].phi))))
    assert (off <= found[request].err_phi + slow[request].err_phi).all()
    assert np.median(found[request].err_phi) < 1e-12


@pytest.mark.parametrize("shorten", [1e-3, 1e-6])
def test_near_change_points_no_error_exceeds_its_estimate(shorten):
    designs, amplified = turning(60, 7, shorten)
    assert len(designs) > 20
    request = Request("d2s", 0)
    found, status = extrema.true_extrema(GUIDE, designs, [request], 1e-8)
    slow, other = extrema.true_extrema(GUIDE, designs, [request], 1e-10, locate=True)
    good = (status == st.OK) & (other == st.OK)
    assert good.mean() > 0.5
    assert set(np.unique(status)) <= {st.OK, st.NOT_CONVERGED, st.UNDECIDABLE}
    exact = climbed(GUIDE, designs[good], request.pose, request.mode, slow[request].phi[good])
    off = np.abs(found[request].value[good] - exact)
    assert (off <= found[request].err[good] + 8.0 * EPS * amplified[good] * np.abs(exact)).all()


def test_statuses_are_those_of_the_search_on_poses():
    designs = guided_four_bars(300, 11)
    designs[0, 1], designs[1, 8], designs[2, 4], designs[3, 6] = -1.0, 0.5, np.nan, 1e6
    request = Request("d2s", 0)
    found, status = extrema.true_extrema(GUIDE, designs, [request], 1e-8)
    slow, other = extrema.true_extrema(GUIDE, designs, [request], 1e-8, locate=True)
    np.testing.assert_array_equal(status, other)
    np.testing.assert_array_equal(np.isnan(found[request].value), np.isnan(slow[request].value))
    assert (status == st.OK).sum() > 50 and (status == st.NOT_ROTATABLE).sum() > 50
    assert (status[:4] == st.INVALID_INPUT).all()


def test_no_bit_depends_on_the_designs_beside_it():
    designs, _ = turning(64, 13)
    together = fused.extrema((fused.curve_of(GUIDE, Request("d2s", 0), False),), designs, 1e-8)[0][0]
    for i in (0, 17, 63):
        alone = fused.extrema((fused.curve_of(GUIDE, Request("d2s", 0), False),), designs[[i]], 1e-8)[0][0]
        assert alone.value[0] == together.value[i] and alone.err[0] == together.err[i]


def test_the_curve_of_another_line_would_be_noticed():
    """Negative control: maxima of a line turned by a millionth are not these."""
    designs, _ = turning(100, 17)
    other = designs.copy()
    other[:, 6] += 1e-6
    found, turned = (
        extrema.true_extrema(GUIDE, d, [Request("d2s", 0)], 1e-8)[0][Request("d2s", 0)] for d in (designs, other)
    )
    assert (np.abs(found.value - turned.value) > found.err + turned.err).mean() > 0.9
