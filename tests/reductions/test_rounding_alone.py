"""Curves that are rounding alone: the moment in a pin whose forces lie in one plane is zero but for its last digits."""

from __future__ import annotations

import numpy as np
import pytest

from kernels import status as st
from studies.accuracy.ordinary import designs as ordinary
from sweep.effects import extended
from sweep.effects.wanted import expanded
from sweep.evaluation.summaries import design_outputs
from sweep.families import family
from sweep.families.base import Accuracy

TARGET = 1e-9
NOTHING = 1e-9  # moments of these small machines are 0.1 to 10: below is rounding, 1e-14 to 1e-11


@pytest.mark.parametrize("name", ["cam", "inverted_slider_crank", "epicyclic_dwell", "heddle", "feed_triad"])
def test_moments_that_are_rounding_alone_end_the_search_with_an_error_of_their_own_size(name):
    """Without this every design with such a pin was NOT_CONVERGED, after 32768 samples."""
    bare = family(name)
    full = extended(bare, wanted := expanded(bare, [f"{name}_loads"]))
    found = design_outputs(full, ordinary(full, 2), wanted, Accuracy(target=TARGET))
    assert (found["status"] == st.OK).all()
    zero = {o for o in wanted if o.startswith("max_abs_moment") and (found[o] < NOTHING).all()}
    assert zero
    for output in wanted:
        size, err = np.abs(found[output]), found[f"err_{output}"]
        assert (err >= 0.1 * size).all() if output in zero else (err <= 10.0 * TARGET * size).all(), output


@pytest.mark.parametrize(
    ("name", "output"), [("cam", "force_d_x"), ("geared_dwell", "moment_d_z"), ("guided_cam", "force_d_y")]
)
def test_means_and_extremes_of_few_roundings_have_their_size_as_error(name, output):
    """Along what bears no load: all such means were NOT_CONVERGED, and extremes of 5 of 12 cams."""
    bare = family(name)
    full = extended(bare, wanted := [f"rms_{output}", f"max_abs_{output}"])
    matrix = np.repeat(ordinary(full, 1), 12, axis=0)
    own = [k for k, p in enumerate(bare.parameters) if p.unit in ("length", "ratio")]
    matrix[:, own] *= np.exp(np.random.default_rng(2).uniform(-0.05, 0.05, (12, len(own))))
    found = design_outputs(full, matrix, wanted, Accuracy(target=TARGET))
    assert (found["status"] == st.OK).all()
    for one in wanted:
        assert (found[one] < NOTHING).all() and (found[f"err_{one}"] >= 0.1 * found[one]).all()


def test_extremes_of_rounding_on_panels_have_its_size_as_error():
    """A tool that pierces cuts the turn into panels, whose halving never ends: all these were NOT_CONVERGED."""
    full = extended(family("guide"), wanted := [f"{k}_moment_d_z" for k in ("min", "max", "max_abs")])
    matrix = ordinary(full, 4)
    matrix[:, full.parameter_names.index("pierce_force")] = 20.0
    found = design_outputs(full, matrix, wanted, Accuracy(target=TARGET))
    assert (found["status"] == st.OK).all()
    for one in wanted:
        size = np.abs(found[one])
        assert (size < NOTHING).all() and (found[f"err_{one}"] >= 0.1 * size).all()
