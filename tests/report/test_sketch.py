"""The sketch of the page: dimensions stand where they are, names cover no others, pictures share a scale."""

from __future__ import annotations

import re
from xml.etree import ElementTree as Xml

import numpy as np
import pytest

import sweep
from sweep.families import family
from sweep.report.sketch import LINE, dimensioned, drawn_parts, sketch

BARS = {"a": 20.0, "b": 60.0, "c": 50.0, "e": 70.0, "xi": 30.0, "eta": 12.0, "branch": 1.0}
LENGTHS = {
    "four_bar": {"a", "b", "c", "e", "xi", "eta"},
    "slider_crank": {"a", "b", "e"},
    "rssr": {"a", "b", "c", "e", "f", "g"},
    "rssp": {"a", "b", "e", "f"},
    "guide": {"a", "b", "c", "e", "xi", "eta", "h"},
}


@pytest.mark.parametrize("name", LENGTHS)
def test_every_length_is_found_where_it_is(name):
    found = family(name)
    design = {p: float(found.example.get(p, 1.0)) for p in found.parameter_names}
    ends = dimensioned(found, design, drawn_parts(found, design))
    lengths = {p for p in LENGTHS[name] if design[p] != 0.0}
    assert set(ends) >= lengths
    for p in ends:
        assert np.linalg.norm(ends[p][1] - ends[p][0]) == pytest.approx(abs(design[p]), rel=1e-6)


def test_two_dimensions_of_one_length_keep_their_own_places():
    design = BARS | {"b": 50.0}
    four_bar = family("four_bar")
    ends = dimensioned(four_bar, design, drawn_parts(four_bar, design))
    at = sweep.joints("four_bar", design, 0.0).set_index("joint")[["x", "y", "z"]]
    for name, joints in (("b", ["b", "c"]), ("c", ["c", "d"])):
        np.testing.assert_allclose(np.sort(ends[name], axis=0), np.sort(at.loc[joints], axis=0), atol=1e-12)


def labels(drawn):
    words = [e for e in Xml.fromstring(str(drawn)).iter() if e.tag.endswith("text")]
    return [(float(e.get("x")), float(e.get("y")), e.text, e.get("class")) for e in words]


def test_words_cover_no_others():
    found = family(["rssr", "guide"])
    design = {f"{k}1": v for k, v in family("rssr").example.items()}
    design |= {f"{k}2": v for k, v in family("guide").example.items()} | {"kappa2": 1.0, "offset2": 0.0}
    design = {p.name: float(design.get(p.name, p.default or 0.0)) for p in found.parameters}
    placed = drawn_parts(found, design)
    ends = dimensioned(found, design, placed)
    shown = labels(sketch(placed, "x", {f"{name} = 1 mm": at for name, at in ends.items()}))
    assert len(shown) > 8 and {kind for *_, kind in shown} == {"name", "dimension"}
    for k, (x, y, words, _) in enumerate(shown):
        for a, b, other, _ in shown[:k]:
            assert abs(y - b) > LINE or abs(x - a) > 3.0 * (len(words) + len(other)), (words, other)


def test_pictures_of_one_span_have_one_scale():
    four_bar = family("four_bar")
    texts = [
        str(sketch(drawn_parts(four_bar, BARS | more), "x", names=False, span=200.0)) for more in ({}, {"c": 55.0})
    ]
    cranks = []
    for text in texts:
        assert "<text" not in text
        (crank,) = re.findall(r'class="link link-0" points="([^"]*)"', text)
        first, second = (np.array([float(x) for x in pair.split(",")]) for pair in crank.split())
        cranks.append(np.linalg.norm(first - second))
    assert cranks[0] == pytest.approx(cranks[1], abs=0.2)  # coordinates have one decimal


def test_what_has_no_pose_is_not_drawn():
    four_bar = family("four_bar")
    assert drawn_parts(four_bar, BARS | {"e": 900.0}) == []
