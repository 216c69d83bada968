"""A run of planar four-bars, and a page about it."""

from __future__ import annotations

import pytest

import sweep
from sweep.study import study_from_data
from tests.support.explorer import explored

BARS = {
    "study": {"name": "bars", "title": "Four-bars"},
    "mechanism": {"family": "four_bar"},
    "scene": {"want": ["max_abs_d2psi", "max_pressure_angle", "swing"], "speed": "600 rpm"},
    "design": {"a": {"from": 8.0, "to": 12.0, "count": 20, "unit": "mm"},
               "b": {"from": 30.0, "to": 40.0, "count": 30, "unit": "mm"},
               "c": "30 mm", "e": "32 mm", "xi": "20 mm", "eta": "5 mm"},
    "limits": {"max_pressure_angle": {"max": 50.0, "unit": "deg"}, "swing": {"min": 35.0, "unit": "deg"}},
    "objective": {"minimise": "max_abs_d2psi"},
    "reference": {"design": {"a": "10 mm", "b": "35 mm", "c": "30 mm", "e": "32 mm", "xi": "20 mm", "eta": "5 mm"}},
}  # fmt: skip


@pytest.fixture(scope="session")
def study():
    return study_from_data(BARS, "study.toml")


@pytest.fixture(scope="session")
def folder(study, tmp_path_factory):
    return sweep.run(study, out=tmp_path_factory.mktemp("bars") / "designs", jobs=1)


@pytest.fixture(scope="session")
def address(folder):
    with explored(folder) as found:
        yield found
