"""The report of needle208 in a browser: what moves agrees with the kernels, and every reader gets a page."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import sweep
from sweep.cli import main
from sweep.report.dataset import chosen
from sweep.report.page import write_report
from tests.support.browser import DRAWS, FLAT, launcher, opened, pixels

pytestmark = pytest.mark.browser
STUDY = Path(__file__).parents[2] / "studies" / "needle208"
SET = """(share) => {
    const slider = document.querySelector('.drive input');
    slider.value = share;
    slider.dispatchEvent(new Event('input'));
}"""
BALLS = """() => {
    const found = {};
    document.getElementById('live').view.scene.traverse((o) => { if (o.name) found[o.name] = o.position.toArray(); });
    return found;
}"""
NAMES = """() => [...document.querySelectorAll('.labels span')].map((e) => e.getBoundingClientRect())
    .filter((box) => box.width > 0).map((box) => [box.left, box.top, box.right, box.bottom])"""
ENDS = """() => {
    const data = JSON.parse(document.getElementById('lines-data').textContent), count = data.axes.length;
    const marks = data.designs.map((design) => numbersOf(design.values)[0]);
    const all = [...numbersOf(data.values).filter((_, k) => k % count === 0), ...marks];
    return [Math.min(...all), Math.max(...all)];
}"""
OUTSIDE = """() => [...document.querySelectorAll('main *')]
    .filter((e) => !e.closest('.scroll, .table, .labels') && e.getBoundingClientRect().right > innerWidth + 1)
    .map((e) => e.outerHTML.slice(0, 80))"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return sweep.run(STUDY, out=tmp_path_factory.mktemp("needle208") / "designs", smoke=True)


@pytest.fixture(scope="module")
def address(folder):
    return write_report(folder).as_uri()


@pytest.fixture(scope="module")
def launch():
    with launcher() as found:
        yield found


@pytest.fixture(scope="module")
def browser(launch):
    found = launch(*DRAWS)
    yield found
    found.close()


def lowest(folder, role, poses=240):
    """A design, and the crank angle of its lowest position on the page's grid."""
    design = chosen(folder, role).design
    phi = np.arange(poses) * (2.0 * math.pi / poses)
    s = sweep.evaluate(["rssr", "guide"], design, ["s"], phi=phi)["s"].to_numpy()
    return design, phi[int(np.argmin(s))]


def joints_at(design, phi):
    table = sweep.joints(["rssr", "guide"], design, [phi])
    names = [j.upper() if len(j) < 3 else j for j in table["joint"]]
    return {f"{n}{s}": row for n, s, row in zip(names, table["stage"], table[["x", "y", "z"]].to_numpy(), strict=True)}


@pytest.mark.parametrize("role", ["optimum", "reference"])
def test_slider_moves_the_mechanism_and_all_cursors_to_the_computed_pose(folder, address, browser, role):
    design, start = lowest(folder, role)
    with opened(browser, address) as page:
        page.get_by_role("radio", name=role, exact=True).check(force=True)
        for share in (0.0, 0.25, 0.6):
            page.evaluate(SET, share)
            shown, expected = page.evaluate(BALLS), joints_at(design, start + share * 2.0 * math.pi)
            assert set(shown) == set(expected)
            for name, at in expected.items():
                np.testing.assert_allclose(shown[name], at, atol=1e-3)  # float32, and a pose of the grid
            poses = sweep.evaluate(["rssr", "guide"], design, ["ds", "d2s", "pressure_angle2"],
                                   phi=[start + share * 2.0 * math.pi])  # fmt: skip
            said = page.locator(".panel output").all_inner_texts()
            for k, name, factor in ((1, "ds", 1.0), (2, "d2s", 1.0), (6, "pressure_angle2", math.degrees(1.0))):
                value = float(re.split("[ °]", said[k].replace("−", "-"))[0])
                assert value == pytest.approx(factor * poses[name][0], rel=1e-3, abs=1e-6), name
            cursors = page.locator(".cursor").evaluate_all("(all) => all.map((c) => Number(c.getAttribute('x1')))")
            assert len(cursors) == 7
            assert cursors == pytest.approx([46 + share * (340 - 46 - 14)] * 7)
            assert page.locator(".angle").inner_text().startswith(f"{360 * share:.1f}°")


def test_picture_is_not_empty_and_changes_with_the_angle_the_design_and_the_view(address, browser):
    with opened(browser, address) as page:
        view = page.locator(".view")
        seen = [pixels(view)]
        assert (np.ptp(seen[0], axis=2) > 0.2).mean() > 0.005  # the coloured links
        for act in (
            lambda: page.evaluate(SET, 0.4),
            lambda: page.get_by_role("radio", name="reference", exact=True).check(force=True),
            lambda: page.get_by_role("button", name="front").click(),
        ):
            act()
            seen.append(pixels(view))
            assert (np.abs(seen[-1] - seen[-2]).max(axis=2) > 0.1).mean() > 0.005


def test_mechanism_turns_by_itself_until_it_is_stopped(address, browser):
    with opened(browser, address, reduced_motion="no-preference") as page:
        angle = page.locator(".angle")
        page.locator(".stage").scroll_into_view_if_needed()
        page.wait_for_function("() => Number(document.querySelector('.drive input').value) > 0.02")
        page.get_by_role("button", name="pause").click()
        rest = angle.inner_text()
        page.wait_for_timeout(200)
        assert angle.inner_text() == rest
        page.get_by_role("button", name="turn").click()
        page.wait_for_function("(rest) => document.querySelector('.angle').textContent !== rest", arg=rest)


@pytest.mark.parametrize("width", [1400, 390])
def test_names_in_the_picture_cover_no_others(address, browser, width):
    with opened(browser, address, width) as page:
        for share in (0.0, 0.3, 0.7):
            page.evaluate(SET, share)
            boxes = page.evaluate(NAMES)
            assert len(boxes) >= 8
            for k, (left, top, right, low) in enumerate(boxes):
                for a, b, c, d in boxes[:k]:
                    assert right <= a or c <= left or low <= b or d <= top


def test_drawing_in_a_curve_moves_the_cursor(address, browser):
    with opened(browser, address) as page:
        panel = page.locator(".panel svg").nth(2)
        panel.scroll_into_view_if_needed()
        box = panel.bounding_box()
        page.mouse.click(box["x"] + box["width"] * (46 + 0.5 * 280) / 340, box["y"] + 0.5 * box["height"])
        assert float(page.locator(".drive input").input_value()) == pytest.approx(0.5, abs=2e-3)


def test_brushing_keeps_the_designs_of_a_range_and_lists_their_numbers(folder, address, browser):
    rows = sweep.load(folder)
    with opened(browser, address) as page:
        hit = page.locator('.hit[data-axis="a1"]')
        hit.scroll_into_view_if_needed()
        box = hit.bounding_box()
        x, middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, middle)
        page.mouse.down()
        page.mouse.move(x, box["y"] + box["height"], steps=4)
        page.mouse.up()
        low, high = page.evaluate(ENDS)
        within = rows["a1"] <= 0.5 * (low + high)
        kept = page.locator("#lines path:not(.mark):not(.out)").count()
        assert 0 < kept < len(rows)
        assert kept == pytest.approx(within.sum(), abs=1)  # the middle is met within a pixel
        listed = [int(text) for text in page.locator(".listed tbody tr td:first-child").all_inner_texts()]
        assert listed == rows[within].nsmallest(5, "max_abs_d2s")["design"].tolist()
        page.mouse.click(x, middle)
        assert page.locator("#lines path.out").count() == 0


@pytest.mark.parametrize("width", [390, 1400])
def test_nothing_overflows(address, browser, width):
    with opened(browser, address, width) as page:
        for summary in page.locator("summary").all():
            summary.click()
        assert page.evaluate("document.documentElement.scrollWidth") == width
        assert page.evaluate(OUTSIDE) == []
        assert pixels(page).std() > 0.05


def test_first_tables_fit_a_telephone(address, browser):
    with opened(browser, address, 390) as page:
        for name in ("result", "limits", "robustness"):
            assert page.locator(f"#{name} .table").first.evaluate("(t) => t.scrollWidth - t.clientWidth") == 0


def test_what_is_moved_sideways_on_a_telephone_says_so(address, browser):
    hint = (
        "[...document.querySelectorAll('.scroll > img')].map((x) => getComputedStyle(x.closest('figure')"
        ".querySelector('figcaption'), '::before').content.includes('ideways') == x.parentElement.scrollWidth > "
        "x.parentElement.clientWidth)"
    )
    shade = "getComputedStyle(document.querySelector('.table')).backgroundImage"
    for width, shaded in ((390, True), (1400, False)):
        with opened(browser, address, width) as page:
            found = page.evaluate(hint)
            assert found and all(found)
            assert ("gradient" in page.evaluate(shade)) == shaded


def test_dark_mode_is_dark_and_paper_is_white(address, browser):
    with opened(browser, address, color_scheme="dark") as page:
        assert pixels(page, full_page=True).mean() < 0.2
        page.emulate_media(media="print")
        assert pixels(page, full_page=True).mean() > 0.8
    with opened(browser, address) as page:
        assert pixels(page, full_page=True).mean() > 0.8


def test_paper_has_still_curves_and_nothing_folded(address, browser):
    with opened(browser, address) as page:
        page.emulate_media(media="print")
        assert page.locator("#live .drive").is_hidden() and page.locator("#live .stage").is_hidden()
        assert page.locator("#answer .sketch").is_visible()
        assert all(panel.is_visible() for panel in page.locator(".panel svg").all())
        page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
        assert page.locator("#provenance table").is_visible()
        assert page.pdf()[:5] == b"%PDF-"
        page.evaluate("window.dispatchEvent(new Event('afterprint'))")
        page.emulate_media(media="screen")
        assert page.locator("#live .drive").is_visible()
        assert page.locator("#provenance table").is_hidden()


def test_without_webgl_the_curves_move_below_a_still_picture(address, launch):
    with launch(*FLAT) as flat, opened(flat, address) as page:
        assert page.locator(".view").is_hidden()
        assert page.locator("#answer .sketch").is_visible()
        before = page.locator(".cursor").first.get_attribute("x1")
        page.evaluate(SET, 0.3)
        assert page.locator(".cursor").first.get_attribute("x1") != before


@pytest.mark.parametrize(("study", "spatial"), [("feed208", True), ("backrest", True), ("crank-rocker-atlas", False)])
def test_reports_of_a_march_of_an_interval_and_without_curves_open(study, spatial, browser, tmp_path):
    folder = sweep.run(STUDY.parent / study, out=tmp_path / "designs", smoke=True)
    with opened(browser, write_report(folder).as_uri(), 390) as page:
        assert page.locator(".view canvas").count() == spatial
        assert page.locator("#lines path").count() > 2
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        if spatial:
            first = page.evaluate(BALLS)
            page.evaluate(SET, 0.5)
            assert page.evaluate(BALLS) != first


def test_cyclogram_of_a_machine_is_whole_on_a_telephone(browser, tmp_path):
    """Its last 20 degrees were cut off."""
    members = ("--member", "needle=slider_crank", "--member", "looper=four_bar")
    assert CliRunner().invoke(main, ["init", "seam", *members, "--into", str(tmp_path)]).exit_code == 0
    folder = sweep.run(tmp_path / "seam", out=tmp_path / "designs", smoke=True)
    with opened(browser, write_report(folder).as_uri(), 390) as page:
        assert page.locator("#cyclogram .turn").count() == 3  # two members and the scale
        assert page.locator("#cyclogram .table").evaluate("part => part.scrollWidth <= part.clientWidth")


@pytest.mark.parametrize(("section", "table"), [("robustness", "named"), ("limits", "")])
def test_narrow_tables_leave_out_columns_but_no_rows(browser, tmp_path, section, table):
    """The third of five rows was hidden with the third of five columns: of a slider-crank made, its stroke."""
    rows = "".join(f"<tr>{f'<td>{row}</td>' * 5}</tr>" for row in range(5))
    style = (Path(sweep.__file__).parent / "templates" / "report.css").read_text(encoding="utf-8")
    page = f'<style>{style}</style><section id="{section}"><table class="{table}">{rows}</table></section>'
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    with opened(browser, (tmp_path / "page.html").as_uri(), 390) as narrow:
        assert [row.is_visible() for row in narrow.locator("tr").all()] == [True] * 5
        assert sum(cell.is_visible() for cell in narrow.locator("tr").first.locator("td").all()) == 4


def test_without_scripts_the_answer_is_whole(address, browser):
    with opened(browser, address, java_script_enabled=False) as page:
        assert page.locator("#live").is_hidden()
        assert page.locator("#answer .sketch").is_visible() and page.locator("#answer .dimensions").is_visible()
        assert page.locator("#answer .lead").is_visible() and page.locator("#result table").first.is_visible()
        assert all(image.is_visible() for image in page.locator("#map img, #trade-off img").all())


def test_designs_offered_are_the_optimum_one_of_each_other_basin_and_the_reference(folder, address, browser):
    optima = pd.read_parquet(folder.parent / "_optimum.parquet")
    best = optima[optima["role"] == "optimum"].iloc[0]
    others = optima[(optima["role"] == "start") & (optima["status"] == 0) & (optima["basin"] != best["basin"])]
    names = [f"another optimum, {k + 1}" for k in range(others["basin"].nunique())]
    with opened(browser, address) as page:
        assert page.locator("#live .designs label").all_inner_texts() == ["optimum", *names, "reference"]
