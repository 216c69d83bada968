"""Pages of families have their picture and all their joints; the equivalences that docs/frames.md states hold."""

from __future__ import annotations

import math
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.exchange.scene import is_spatial, over, projection
from sweep.families import NAMES, family
from sweep.plot.drawing import draw_frame
from sweep.report.figures import new_figure

DOCS = Path(__file__).parents[2] / "docs"
PHI = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)
PLANAR = {
    "guide", "four_bar", "slider_crank", "inverted_slider_crank", "geared_dwell", "epicyclic_dwell", "cam", "cam_lever",
    "feed", "feed_triad", "foot", "feed_foot", "heddle", "backrest", "backrest_tension", "backrest_closure",
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_page_of_every_family_has_its_picture_and_all_joints(name):
    pages = [text for text in map(Path.read_text, DOCS.glob("*.md")) if f"/frame-{name}.svg)" in text]
    assert len(pages) == 1, f"{len(pages)} pages of docs show figures/frame-{name}.svg: the page of {name} has to"
    (page,) = pages
    section = page.split(f"/frame-{name}.svg)")[1].split("\n#")[0]
    assert "\n| joint |" in section, f"under the picture of {name} its page has no table of joints"
    rows = section.split("\n| joint |")[1].split("\n\n")[0].split("\n", 2)[2]
    (part,) = over(name, dict(family(name).example), 0.0, 12)
    named = {word for row in re.findall(r"^\| ([^|]+) \|", rows, flags=re.MULTILINE) for word in row.split(", ")}
    assert {j.upper() if len(j) < 3 else j for j in part.joints} == named


def test_program_that_draws_the_pictures_finds_all_that_it_imports():
    assert callable(runpy.run_path(str(DOCS / "frames.py"))["main"])


def test_pages_of_families_show_their_pictures_and_no_figure_is_large():
    assert all(f"figures/frame-{path.stem}.svg" in path.read_text() for path in DOCS.glob("*.md") if path.stem in NAMES)
    sizes = {path.name: path.stat().st_size for path in (DOCS / "figures").iterdir()}
    small = [name for name in NAMES if sizes.get(f"frame-{name}.svg", 0) <= 4000]
    assert not small, f"docs/figures lacks the pictures of {small}: make frames draws them"
    assert max(sizes.values()) <= 100_000, sizes


@pytest.mark.parametrize("name", NAMES)
def test_picture_has_a_line_for_each_link_and_a_label_for_each_joint(name):
    found = over(name, dict(family(name).example), 0.9, 12)
    assert is_spatial(found) == (name not in PLANAR)
    axes = new_figure(4.0, 4.0).subplots()
    draw_frame(axes, found, projection("space" if is_spatial(found) else "xy"))
    labels = {
        name for text in axes.texts for name in text.get_text().lower().split(", ")
    }  # names that meet share a text
    assert set(found[0].joints) <= labels
    drawn = {line.get_label() for line in axes.lines}
    assert {link.name for link in found[0].links if len(link.joints) > 1} <= drawn


def moved(name, design, phi, rotation):
    table = sweep.joints(name, design, phi)
    return {joint: rows[["x", "y", "z"]].to_numpy() @ rotation for joint, rows in table.groupby("joint")}


@pytest.mark.parametrize(
    ("name", "alpha", "turn"),
    [
        ("rssr", 0.0, (-1, -1, 1)),
        ("slotted", 0.0, (-1, -1, 1)),
        ("five_link", 0.0, (-1, -1, 1)),
        ("rssp", math.pi, (-1, 1, -1)),
    ],
)
def test_reversed_common_perpendicular_is_the_same_mechanism(name, alpha, turn):
    design = dict(family(name).example)
    other = design | {"e": -design["e"], "alpha": alpha - design["alpha"]}
    first = moved(name, design, PHI, np.eye(3))
    second = moved(name, other, PHI + math.pi, np.diag(turn))
    for joint, path in first.items():
        np.testing.assert_allclose(second[joint], path, atol=1e-13)


def test_parallel_axes_know_only_the_difference_of_the_offsets():
    design = dict(family("rssr").example) | {"alpha": 0.0, "f": 0.3, "g": 0.1}
    psi = [sweep.evaluate("rssr", design | x, "psi", phi=PHI)["psi"] for x in ({}, {"f": 1.3, "g": 1.1})]
    np.testing.assert_allclose(psi[0], psi[1], atol=1e-14)
