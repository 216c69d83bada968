"""The pages of the accuracy study: made of stored tables alone, the same every time, complete."""

from __future__ import annotations

import re

import pandas as pd
import pytest

from studies.accuracy import effects_page, families_page, front, pages
from studies.accuracy.__main__ import measured
from studies.accuracy.measured import Measured
from studies.accuracy.price_figures import draw_prices
from studies.accuracy.prices import CERTIFIED, GRID, PROVEN, REFINED, SAMPLES
from studies.accuracy.subjects import EDGE, ORDINARY
from tests.bench import programs


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The smoke version, as `make smoke-accuracy` measures it."""
    return measured(True, tmp_path_factory.mktemp("none"))


@pytest.mark.slow
def test_stored_tables_give_the_same_pages_and_figures_again(found, tmp_path):
    found.write(tmp_path)
    again = Measured.read(tmp_path)
    assert pages.pages(again) == pages.pages(found)
    first, second = (draw_prices(one, tmp_path / str(k)) for k, one in enumerate((found, again)))
    assert [figure.read_bytes() for figure in first] == [figure.read_bytes() for figure in second]


@pytest.mark.slow
def test_pages_lead_to_each_other_and_to_their_figures(found, tmp_path):
    written = pages.pages(found)
    figures = {figure.name for figure in draw_prices(found, tmp_path)}
    assert {f"accuracy{part}.svg" for part in ("", "-families", "-effects")} == figures
    for path in list(written)[1:]:
        assert f"]({path})" in written["accuracy.md"]
        assert "](../accuracy.md)" in written[path]
    assert len(re.findall(r"^\* ", written["accuracy.md"], re.MULTILINE)) == 5
    assert written["accuracy.md"].count("![") == 1
    assert not re.search(r"\bnan\b", "".join(written.values()))


def row(family, region, method, setting, error, ns, **more):
    given = {"family": family, "region": region, "method": method, "setting": setting, "largest_error": error}
    given |= {"reference_error": 1e-12, "ns_per_design": ns, "ns_per_design_lower": ns, "ns_per_design_upper": ns}
    return given | {"measure": "max_abs_d2psi", "designs": 7, "unanswered": 0, "unjudged": 0} | more


def table():
    rows = []
    for family, factor in (("one", 1.0), ("two", 2.0), ("three", 4.0)):
        rows += [row(family, ORDINARY, GRID, 360.0, 1e-4 * factor, 500.0)]
        rows += [row(family, ORDINARY, REFINED, 1e-3, 1e-5, 100.0), row(family, ORDINARY, REFINED, 1e-9, 1e-12, 100.0)]
        rows[-1]["ns_per_design"] *= factor
        rows += [row(family, EDGE, GRID, 360.0, 0.9, 500.0), row(family, EDGE, REFINED, 1e-9, 1e-10, 1000.0 * factor)]
    return pd.DataFrame(rows)


def test_lines_say_what_the_table_says():
    families = table()
    assert "multiplied by 2.00 (median of 3 mechanisms), at most by 4.00 (three)" in front._refined(families)
    assert "3 of 3 keep 1e-9" in front._refined(families)
    assert "by 2.0e-04 of it (median), by 4.0e-04 in the worst family (three)" in front._grid(families)
    edge = front._edge(families)
    assert "off by up to 90 %" in edge and "for 10 times the time" in edge


def test_a_broken_promise_is_counted():
    families = table()
    families.loc[(families["family"] == "two") & (families["setting"] == 1e-9), "largest_error"] = 1e-6
    assert "2 of 3 keep 1e-9" in front._refined(families)


def test_an_effect_that_misses_is_named():
    columns = {"method": REFINED, "setting": 1e-6, "reference_error": 1e-12}
    effects = pd.DataFrame(
        [
            columns | {"effect": "good", "largest_error": 1e-8, "ns_per_design": 1e3},
            columns | {"effect": "bad", "largest_error": 1e-4, "ns_per_design": 1e6},
        ]
    )
    line = front._effects(effects)
    assert "1 of 2 effects are right to 1e-6" in line and "not so bad (1.0e-04)" in line
    assert "1 us (good) to 1 ms (bad)" in line
    effects = effects.assign(exceeded=[0, 3], unsure=[2, 0])
    said = " ".join(effects_page._honest(effects))
    assert "bad (3 at 1e-6)" in said and "good 2" in said


def test_other_programs_have_their_rows():
    peer = {"what": "pylinkage 1", "family": "four_bar", "largest_error": 8e-5, "ns_per_design": 2e5}
    peers = pd.DataFrame([peer | {"setting": float(n)} for n in SAMPLES])
    loads = pd.DataFrame(
        [{"program": "MuJoCo 4", "family": "rssr", "poses": 25, "largest_difference": 2e-14, "ns_per_pose": 3e5,
          "ns_per_pose_own": 200.0}]
    )  # fmt: skip
    one = pd.DataFrame([{"what": "Pinocchio 4", "ns_per_pose": 5e5, "ratio": 1.0, "largest_difference": 3e-14}])
    lines = programs.page(peers, loads, one)
    assert "| pylinkage 1 |" + " 8.0e-05; 200 us |" * len(SAMPLES) in lines
    assert "| MuJoCo 4 | `rssr` | 25 | 2.0e-14 | 300 us | 200 ns | 1500 |" in lines
    assert "| Pinocchio 4 | 500 us | 1 |" in lines and "differ by at most 3.0e-14" in " ".join(lines)


def regional():
    """Two regions and a change point: a dear grid, `accuracy=` and the proof of it."""
    rows = []
    for region, ns in (("ordinary", 6.0), ("long coupler", 8.0), ("change point", 900.0)):
        rows += [row("rssr", region, GRID, 3600.0, 1e-4, 4.0 * ns), row("rssr", region, GRID, 90.0, 0.1, 1.0)]
        rows += [row("rssr", region, REFINED, target, 1e-2 * target, ns) for target in (1e-3, 1e-9)]
        rows += [row("rssr", region, CERTIFIED, PROVEN, 1e-12, 20.0 * ns)]
    return pd.DataFrame(rows).assign(text="as it is")


def test_advice_names_the_cheapest_way_that_keeps_the_bound_in_every_region():
    table = regional()
    coarse, fine, proof = families_page.advice(table)
    assert "use `accuracy = 1e-3`. 7 ns a design on average, 8 ns in the dearest region (long coupler)" in coarse
    assert "use `accuracy = 1e-9`." in fine and "largest error 1.0e-11, where the reference is sure to 1.0e-12." in fine
    assert "140 ns a design on average at `accuracy = 1e-8`, 20 times as long" in proof
    assert "0 of 14 proofs failed" in proof
    table.loc[table["setting"] == 3600.0, "ns_per_design"] = 5.0
    assert "use a grid of 3600. 5 ns a design on average" in families_page.advice(table)[0]
    worse = table["region"].eq("long coupler") & table["setting"].eq(1e-9)
    table.loc[worse, "largest_error"] = 1e-8
    assert "nothing measured here keeps that bound" in families_page.advice(table)[1]


def test_digits_of_a_study_are_free_or_have_a_price():
    columns = {"designs": 10, "largest_error": 1e-5, "processor_seconds": 1.0}
    settings = ("samples = 360", "target = 1e-3", "target = 1e-9")
    whole = pd.DataFrame([columns | {"setting": setting} for setting in settings])
    assert "digits cost next to nothing" in front._in_a_study(whole)
    whole.loc[2, "processor_seconds"] = 3.0
    assert "digits multiply the time by 3" in front._in_a_study(whole)
