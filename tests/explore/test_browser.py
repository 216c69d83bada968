"""The page of `sweep explore` in a browser: sliders, pins, undo, search, cells; by keyboard, narrow, dark."""

from __future__ import annotations

import re
import time

import pytest

import sweep
from sweep.report.quantities import quantity
from tests.support.browser import DRAWS, launcher, pixels
from tests.support.explorer import ROOT, explored

pytestmark = pytest.mark.browser
MOVE = """([name, value]) => {
    const slider = rows[name].slider;
    slider.value = value;
    slider.dispatchEvent(new Event('input'));
    slider.dispatchEvent(new Event('change'));
}"""
OUTSIDE = """() => [...document.querySelectorAll('main *')]
    .filter((e) => !e.closest('.table, .view, .panels') && e.getBoundingClientRect().right > innerWidth + 1)
    .map((e) => e.outerHTML.slice(0, 80))"""
STUDIES = ROOT / "studies"
PATIENCE = 60  # seconds, on a busy machine


@pytest.fixture(scope="module")
def browser():
    with launcher() as launch:
        found = launch(*DRAWS)
        yield found
        found.close()


@pytest.fixture
def opened(browser, address):
    """A page that has shown its first answer; at the end it must have loaded nothing from elsewhere."""
    contexts = []

    def opening(width=1400, **options):
        context = browser.new_context(viewport={"width": width, "height": 900}, reduced_motion="reduce", **options)
        page = context.new_page()
        contexts.append((context, said := [], loaded := []))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: loaded.append(request.url))
        page.goto(address)
        until(lambda: answers(page) >= 1)
        return page

    yield opening
    for context, said, loaded in contexts:
        context.close()
        assert said == [] and all(url.startswith((address, "blob:")) for url in loaded)


def answers(page):
    return int(page.evaluate("document.body.dataset.answers ?? 0"))


def until(true):
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


def moved(page, name, value):
    before = answers(page)
    page.evaluate(MOVE, [name, value])
    until(lambda: answers(page) > before and not page.evaluate("asking"))


def shown(page, name):
    return page.locator(f"td[data-output={name}]").evaluate("e => e.firstChild.textContent")


def true(design, name, unit):
    found = sweep.summarise("four_bar", {n: [x] for n, x in design.items()}, [name], accuracy=1e-6)
    return quantity(name, unit).show(float(found[name].iloc[0]))


def test_slider_moves_and_the_number_is_that_of_summarise_to_the_last_digit(opened):
    page = opened()
    for value in (8.125, 9.75, 11.5):
        moved(page, "a", value)
        own = page.evaluate("design")
        design = {name: own[name] for name in ("a", "b", "c", "e", "xi", "eta")}
        assert design["a"] == value
        assert shown(page, "max_abs_d2psi") == true(design, "max_abs_d2psi", "1")
        assert shown(page, "max_pressure_angle") == true(design, "max_pressure_angle", "rad")


def test_mechanism_and_curves_follow(opened):
    page = opened()
    stage, panel = page.locator(".stage"), page.locator(".panel").first
    before = pixels(stage), pixels(panel)
    moved(page, "a", 8.0)
    moved(page, "c", 20.0)
    assert (pixels(stage) != before[0]).any() and (pixels(panel) != before[1]).any()


def test_limits_say_by_how_much_they_are_missed(opened):
    page = opened()
    moved(page, "a", 8.0)
    moved(page, "c", 40.0)
    row = page.locator("#limits tr", has=page.locator("td[title=swing]"))
    assert re.search(r"by [\d.]+°", row.inner_text())
    assert row.locator(".state.missed").count() >= 1


@pytest.mark.parametrize("width", [390, 1400])
def test_line_below_the_heading_of_the_outputs_runs_over_all_columns(opened, width):
    """A narrow report leaves out columns without a heading; on this page only their heading went."""
    page = opened(width=width)
    page.click("[aria-label='remove reference']")
    until(lambda: page.locator("#outputs th").all_text_contents() == ["output", ""])
    right = "rows => rows.map((row) => row.lastElementChild.getBoundingClientRect().right)"
    heading, *values = page.locator("#outputs tr").evaluate_all(right)
    assert values and all(abs(heading - value) < 1.0 for value in values)  # px; a column is some 100 wide


def test_pins_stand_beside_and_undo_goes_back(opened):
    page = opened()
    first = shown(page, "max_abs_d2psi")
    page.click("#pin")
    moved(page, "a", 11.9)
    assert page.locator("#outputs th").all_inner_texts() == ["output", "in hand", "reference", "A"]
    align = "all => all.map((e) => getComputedStyle(e).textAlign)"
    assert page.locator("#outputs th").evaluate_all(align) == ["left", "right", "right", "right"]
    assert page.locator("#outputs tr:has(td[data-output=max_abs_d2psi]) td").nth(3).inner_text().split("\n")[0] == first
    page.keyboard.press("Control+z")
    until(lambda: shown(page, "max_abs_d2psi") == first)


def test_improves_from_here_and_can_be_stopped(opened):
    page = opened()
    moved(page, "a", 12.0)
    objective = "parseFloat(found.outputs[0].values[0])"
    before = page.evaluate(objective)
    page.click("#improve")
    until(lambda: "converged" in page.inner_text("#said"))
    assert page.evaluate(objective) < before
    page.click("#improve")
    page.click("#improve")
    until(lambda: page.inner_text("#improve") == "improve from here")


def test_keyboard_alone(opened):
    page = opened()
    page.focus("[type=range][aria-label^='a ']")
    before, value = answers(page), page.evaluate("design.a")
    page.keyboard.press("ArrowLeft")
    until(lambda: answers(page) > before)
    assert page.evaluate("design.a") < value or value == 8.0
    page.fill("#d-b", "37.5")
    page.keyboard.press("Enter")
    until(lambda: page.evaluate("design.b") == 37.5)
    page.focus("#cells")
    for key in ("ArrowRight", "ArrowUp", "Enter"):
        page.keyboard.press(key)
    until(lambda: "in hand" in page.inner_text("#said") or page.evaluate("past.length") >= 3)


def test_a_refused_value_is_told_in_the_words_of_the_page_and_widens_no_slider(opened):
    page = opened()
    ends = page.evaluate("[rows.a.slider.min, rows.a.slider.max].map(Number)")
    page.fill("#d-a", "-5")
    page.keyboard.press("Enter")
    said = "explore: a = -5.0; allowed: a positive length; shown is the design before"
    until(lambda: page.inner_text("#said") == said)
    assert page.evaluate("[rows.a.slider.min, rows.a.slider.max].map(Number)") == ends
    page.fill("#d-a", "1e9")
    page.keyboard.press("Enter")
    until(lambda: page.evaluate("Number(rows.a.slider.max)") == 1e9 and not page.evaluate("asking"))
    for _ in range(2):
        page.click("#undo")
    until(lambda: page.inner_text("#said") == "" and not page.evaluate("asking"))
    assert page.evaluate("[rows.a.slider.min, rows.a.slider.max].map(Number)") == ends


def test_click_on_a_cell_takes_its_best_design_in_hand(opened, folder):
    page = opened()
    until(lambda: page.locator("#cells rect").count() > 0)
    rect = page.locator("#cells rect").nth(3)
    number = int(rect.get_attribute("data-design"))
    rect.click()
    row = sweep.load(folder).query(f"design == {number}").iloc[0]
    until(lambda: page.evaluate("design.a") == row["a"] and page.evaluate("design.b") == row["b"])
    until(lambda: not page.evaluate("asking"))
    assert page.inner_text("#said") == f"design {number} in hand"  # also when its numbers are there
    moved(page, "a", 9.5)
    assert page.inner_text("#said") == ""


def test_saves_a_study(opened):
    page = opened()
    with page.expect_download() as found:
        page.select_option("#save", "study")
    assert found.value.suggested_filename == "study.toml"


@pytest.mark.parametrize("options", [{"width": 390}, {"width": 390, "color_scheme": "dark"}, {"color_scheme": "dark"}])
def test_narrow_and_dark(opened, options):
    page = opened(**options)
    assert page.evaluate(OUTSIDE) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= options.get("width", 1400)
    ground = pixels(page)[2, 2].mean()
    assert ground < 0.2 if options.get("color_scheme") == "dark" else ground > 0.9


def test_two_users_do_not_disturb_each_other(opened):
    one, other = opened(), opened()
    moved(one, "a", 8.5)
    moved(other, "a", 11.5)
    assert (one.evaluate("design.a"), other.evaluate("design.a")) == (8.5, 11.5)
    assert shown(one, "max_abs_d2psi") != shown(other, "max_abs_d2psi")


def test_page_of_somebody_else_gets_nothing(browser, address, tmp_path):
    hostile = tmp_path / "hostile.html"
    hostile.write_text("<p>hostile</p>")
    page = browser.new_page()
    page.goto(hostile.as_uri())
    tries = page.evaluate(
        """async (address) => {
            const get = (options) => fetch(address + 'answer', options).then((r) => r.text(), () => 'nothing');
            const question = { method: 'POST', body: '{}' };
            return [await get(question), await get({ ...question, mode: 'no-cors' })];
        }""",
        address,
    )
    assert tries == ["nothing", "nothing"]
    page.close()


def test_range_on_an_axis_narrows_both_pictures_by_mouse_and_by_keys(opened, folder):
    page = opened()
    until(lambda: page.locator("#rails .hit").count() > 2)
    every = page.inner_text("#count")
    hit = page.locator("#rails .hit[data-axis=a]")
    hit.scroll_into_view_if_needed()
    box = hit.bounding_box()
    x = box["x"] + box["width"] / 2
    page.mouse.move(x, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(x, box["y"] + box["height"], steps=4)
    page.mouse.up()
    until(lambda: " of " in page.inner_text("#count") and not page.evaluate("picture.asking"))
    rows = sweep.load(folder).query("status == 0")
    low, high = page.evaluate("picture.ranges.a")
    assert int(page.inner_text("#count").split()[0]) == rows["a"].between(low, high).sum() < len(rows)
    numbers = page.locator("#cells rect").evaluate_all("all => all.map((e) => Number(e.dataset.design))")
    assert set(numbers) <= set(rows[rows["a"].between(low, high)]["design"])
    page.keyboard.press("Delete")
    until(lambda: page.inner_text("#count") == every)
    page.keyboard.press("ArrowUp")
    until(lambda: " of " in page.inner_text("#count"))


def test_click_on_a_band_takes_its_best_design_in_hand(opened, folder):
    page = opened()
    until(lambda: page.locator("#rails path").count() > 0)
    page.locator("#rails").scroll_into_view_if_needed()
    box = page.locator("#rails").bounding_box()
    page.mouse.click(box["x"] + 0.35 * box["width"], box["y"] + 0.5 * box["height"])
    until(lambda: "in hand" in page.inner_text("#said") or page.evaluate("past.length") >= 1)
    own = page.evaluate("design")
    rows = sweep.load(folder).query("status == 0")
    assert ((rows["a"] == own["a"]) & (rows["b"] == own["b"])).any()


def test_a_drive_that_turns_fully_ends_its_turn_and_has_no_table_of_no_limits(browser):
    with explored("geared_dwell") as address:
        page = browser.new_page()
        page.goto(address)
        until(lambda: answers(page) >= 1)
        ends = page.evaluate(
            "[0, 0.998, 1].map((at) => { moving.panels[0].pose(at); return moving.panels[0].value.data; })"
        )
        assert [float(text.removesuffix("°").replace("−", "-")) for text in ends] == pytest.approx(
            [0, 360, 360], abs=1.0
        )
        assert page.evaluate("[withUnit(short(NaN), 'mm'), withUnit(short(45), '°')]") == ["–", "45°"]
        assert page.locator("#limits").is_hidden() and page.locator("#outputs").is_visible()
        page.close()


def test_many_dimensions_stand_in_groups_in_a_column_of_their_own(browser):
    with explored(STUDIES / "head208") as address:
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.goto(address)
        until(lambda: answers(page) >= 1)
        groups = page.locator("#dimensions details")
        heads = [text.rsplit(maxsplit=1) for text in groups.locator("summary").all_inner_texts()]
        assert [head for head, _ in heads[:2]] == ["needle", "needle, masses and loads"]
        assert [int(count) for _, count in heads] == [
            groups.nth(k).locator(".dimension").count() for k in range(len(heads))
        ]
        # what the study sweeps is in sight, the rest is a click away
        swept = page.evaluate("[...new Set(page.ranges.filter((r) => r.swept).map((r) => r.group))]")
        assert [head for k, (head, _) in enumerate(heads) if groups.nth(k).get_attribute("open") is not None] == swept
        column = page.locator("#dimensions")
        page.evaluate("scrollTo(0, 1e5)")
        page.wait_for_timeout(100)
        box = column.bounding_box()
        assert box["y"] >= 0.0 and box["y"] + box["height"] <= 900.0  # however far the page is scrolled
        assert page.locator("#drags").is_hidden()  # a spatial mechanism
        page.close()


def test_dragged_joint_changes_the_dimensions(opened):
    page = opened()
    assert page.locator("#drags").is_visible()
    before = page.evaluate("design")
    place = """() => {
        const view = moving.view, point = view.points.find((p) => p.label.textContent === 'C');
        const at = point.at(view.share).clone().applyMatrix4(point.group.matrixWorld).project(view.camera);
        const box = view.renderer.domElement.getBoundingClientRect();
        return [box.left + ((at.x + 1) * box.width) / 2, box.top + ((1 - at.y) * box.height) / 2];
    }"""
    page.locator(".stage").scroll_into_view_if_needed()
    page.get_by_role("button", name="front").click()
    x, y = page.evaluate(place)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 12.0, y - 9.0, steps=3)
    page.mouse.up()
    until(lambda: not page.evaluate("pulling || asking") and page.evaluate("design.c") != before["c"])
    assert page.evaluate(place) == pytest.approx([x + 12.0, y - 9.0], abs=2.5)  # pixels
    page.click("#undo")
    until(lambda: page.evaluate("design") == before)
