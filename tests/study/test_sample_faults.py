"""Faults of the sample of a study's designs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.study.test_faults import A_AXIS, RIGHT, faults_of

SAMPLED = RIGHT.replace(", count = 5", "").replace(", count = 4", "")


@pytest.mark.parametrize(
    ("sample", "pieces"),
    [
        ('{ kind = "halton", n = 8 }', ["design.sample.kind = 'halton'", '"sobol"']),
        ('{ kind = "sobol" }', ["design.sample.n is missing", "whole number"]),
        ('{ kind = "sobol", n = 0 }', ["design.sample.n = 0", "1 to 2^40"]),
        ('{ kind = "sobol", n = 8, sed = 1 }', ["design.sample.sed: unknown key", "did you mean 'seed'?"]),
        ("8", ["design.sample = 8", "a table with the keys kind, n, seed"]),
    ],
)
def test_faults_of_a_sample(sample: str, pieces: list[str], tmp_path: Path) -> None:
    (message,) = faults_of(SAMPLED.replace("[design]", f"[design]\nsample = {sample}"), tmp_path)
    assert all(piece in message for piece in pieces)


def test_a_sampled_axis_has_no_count(tmp_path: Path) -> None:
    text = SAMPLED.replace("[design]", '[design]\nsample = { kind = "sobol", n = 8 }').replace(
        "= 40, unit", "= 40, count = 5, unit"
    )
    (message,) = faults_of(text, tmp_path)
    assert "design.c.count = 5; allowed: no count beside design.sample" in message


def test_a_sample_needs_an_axis(tmp_path: Path) -> None:
    text = RIGHT.replace(A_AXIS, 'c = "30 mm"').replace('{ values = [35.0, 40.0], unit = "mm" }', '"40 mm"')
    text = text.replace('alpha = { from = 0, to = 90, count = 4, unit = "deg" }', 'alpha = "90 deg"')
    text = text.replace("branch = { values = [-1, 1] }", 'sample = { kind = "sobol", n = 8 }')
    (message,) = faults_of(text, tmp_path)
    assert "design.sample = '0 swept parameters'" in message
