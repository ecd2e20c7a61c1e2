"""The page in Chromium: searched, dragged, compared, exported; no error in its console, no request that leaves here."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

pytestmark = pytest.mark.slow
WISH = "/?path=straight-line&stroke=150&deviation=0.5&limit=4"
REFINED = '.found[data-refined="1"]'
#: The same where nothing is being asked any more: an older answer stands there until the next one has come.
SETTLED = f'#answers[aria-busy="false"] {REFINED}'
WIDE, NARROW = {"width": 1400, "height": 900}, {"width": 390, "height": 844}


@pytest.fixture
def entered(browser: Browser, printed: str) -> Callable[..., BrowserContext]:
    """Return what makes a browser that the printed address has let in."""

    def enter(**how: Any) -> BrowserContext:
        context = browser.new_context(**how)
        assert context.request.get(printed).ok  # begins no search that nobody waits for
        return context

    return enter


@pytest.fixture
def opened(entered: Callable[..., BrowserContext], address: str) -> Callable[..., Any]:
    """Return what opens a page of the server; at its end nothing may have gone wrong, nor left this machine."""

    @contextmanager
    def open(path: str, **how: Any) -> Iterator[Page]:
        context = entered(**{"viewport": WIDE, **how})
        page = context.new_page()
        page.set_default_timeout(60_000)
        wrong: list[str] = []
        page.on("console", lambda said: wrong.append(said.text) if said.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda asked: None if asked.url.startswith((address, "data:", "blob:"))
                else wrong.append(asked.url))  # fmt: skip
        page.goto(address + path)
        yield page
        assert wrong == []
        context.close()

    return open


def place(page: Page, selector: str) -> tuple[float, float]:
    box = page.locator(selector).first.bounding_box()
    assert box is not None
    return box["x"], box["y"]


def until(page: Page, true: str, arg: object = None) -> None:
    """Wait until an expression is true; the page forbids what Playwright waits by."""
    for _ in range(300):
        if page.evaluate(true, arg):
            return
        page.wait_for_timeout(100)
    raise AssertionError(f"never {true}")


def asked(page: Page) -> dict[str, list[str]]:
    return parse_qs(urlsplit(page.url).query)


def test_the_printed_address_leads_on_to_the_page_and_hides_its_token(
    browser: Browser, address: str, printed: str
) -> None:
    context = browser.new_context()
    page = context.new_page()
    page.goto(printed)
    page.wait_for_url(address + "/")
    page.wait_for_selector("#wish", state="attached")
    assert page.evaluate("document.cookie") == ""  # no script reads it
    context.close()


def test_a_wish_is_answered_and_stands_in_the_address(opened: Callable[..., Any]) -> None:
    with opened("/") as page:
        page.wait_for_selector(REFINED)
        page.fill("#f-stroke", "120")
        page.wait_for_url("**stroke=120**")
        page.wait_for_selector(f"{SETTLED} .card")
        assert asked(page)["stroke"] == ["120"]
        count = page.locator(".card").count()
        shared = page.url
        page.goto("about:blank")
        page.goto(shared)
        page.wait_for_selector(REFINED)
        assert page.input_value("#f-stroke") == "120"
        assert page.locator(".card").count() == count


def test_a_slider_sets_its_field_and_searches(opened: Callable[..., Any]) -> None:
    with opened(WISH) as page:
        page.wait_for_selector(REFINED)
        slider = page.locator('input[type=range][data-for="f-min_transmission"]')
        slider.focus()
        page.keyboard.press("End")
        page.keyboard.press("PageDown")
        value = float(page.input_value("#f-min_transmission"))
        assert 0 < value < 85
        page.wait_for_url("**min_transmission=**")
        assert float(asked(page)["min_transmission"][0]) == value


def test_a_slider_that_is_dragged_asks_for_first_answers_only(opened: Callable[..., Any]) -> None:
    with opened(WISH) as page:
        page.wait_for_selector(REFINED)
        stages: list[str] = []
        page.on("request", lambda one: stages.append(parse_qs(urlsplit(one.url).query).get("stage", [""])[0]))
        box = page.locator('input[type=range][data-for="f-max_size"]').bounding_box()
        assert box is not None
        y = box["y"] + box["height"] / 2
        page.mouse.move(box["x"] + box["width"] - 8, y)
        page.mouse.down()
        for share in (0.9, 0.85, 0.8):
            page.mouse.move(box["x"] + share * box["width"], y)
            page.wait_for_timeout(50)
        with page.expect_response(re.compile("stage=draft")):
            pass
        page.wait_for_timeout(300)
        assert {*stages} == {"draft"}
        page.mouse.up()
        page.wait_for_selector(SETTLED)
        assert stages[-1] == "refined"


def test_where_no_stored_guide_serves_the_first_that_are_found_are_asked_for(opened: Callable[..., Any]) -> None:
    with opened(WISH) as page:
        page.wait_for_selector(SETTLED)
        stages: list[str] = []
        page.on("request", lambda one: stages.append(parse_qs(urlsplit(one.url).query).get("stage", [""])[0]))
        hard = {"deviation": "0.05", "max_size": "200", "min_transmission": "50"}
        page.goto(page.url.replace("deviation=0.5", "&".join(f"{name}={value}" for name, value in hard.items())))
        page.wait_for_selector(f"{SETTLED} .card", timeout=180_000)  # two searches, side by side
        assert [stage for stage in stages if stage] == ["early", "refined"]


def test_drawings_move_and_stand_still_when_told(opened: Callable[..., Any]) -> None:
    with opened(WISH) as page:
        page.wait_for_selector(f"{REFINED} .card")
        link = ".card .link.coupler"
        poses = []
        for time in (0.0, 1.25, 2.5):
            page.evaluate("t => { const s = document.querySelector('.card svg'); s.pauseAnimations(); "
                          "s.setCurrentTime(t) }", time)  # fmt: skip
            poses.append(place(page, ".card .point"))
        assert poses[0] != poses[1] != poses[2]
        assert abs(poses[2][0] - poses[0][0]) > 20  # the point runs along its path
        page.evaluate("document.querySelector('.card svg').unpauseAnimations()")
        before = place(page, link)
        page.wait_for_timeout(400)
        assert place(page, link) != before
        page.click("#motion")
        before = place(page, link)
        page.wait_for_timeout(400)
        assert place(page, link) == before


def test_less_motion_is_respected(opened: Callable[..., Any]) -> None:
    with opened(WISH, reduced_motion="reduce") as page:
        page.wait_for_selector(f"{REFINED} .card")
        before = place(page, ".card .point")
        page.wait_for_timeout(400)
        assert place(page, ".card .point") == before
        page.click("#motion")  # who asks for it gets it
        page.wait_for_timeout(400)
        assert place(page, ".card .point") != before


def test_a_shortlist_is_compared(opened: Callable[..., Any]) -> None:
    with opened(WISH) as page:
        page.wait_for_selector(f"{REFINED} .card")
        boxes = page.locator(".card input[name=pick]")
        codes = [str(boxes.nth(k).get_attribute("value")) for k in (0, 1)]
        for k in (0, 1):
            boxes.nth(k).check()
        page.wait_for_url(f"**pick={codes[1]}**")
        assert asked(page)["pick"] == codes
        page.fill("#f-deviation", "0.4")
        page.wait_for_url("**deviation=0.4**")
        page.wait_for_selector(SETTLED)
        assert asked(page)["pick"] == codes  # the shortlist outlives a search
        page.click("#tray button")
        page.wait_for_url("**/compare**")
        assert asked(page)["pick"] == codes
        assert page.locator(".compare thead svg.guide-drawing").count() == 2
        assert page.locator(".compare tbody tr", has_text="Deviation").first.locator("td").count() == 2


def test_a_guide_is_scrubbed_and_its_theory_shown(opened: Callable[..., Any]) -> None:
    with opened("/guide/watt") as page:
        slider = page.locator("[data-controls] input")
        places = []
        for key in ("Home", "End"):
            slider.focus()
            page.keyboard.press(key)
            places.append(place(page, ".large .point"))
        assert abs(places[1][0] - places[0][0]) > 50
        assert page.inner_text("[data-play]") == "Play"
        layer = page.locator(".large .layer.turn").first
        assert not layer.is_visible()
        page.check('[data-layer="turn"]')
        assert layer.is_visible()
        assert "IV*.l" in page.inner_text("main")


def test_an_export_is_downloaded(opened: Callable[..., Any], tmp_path: Path) -> None:
    with opened("/guide/watt", accept_downloads=True) as page:
        for name, begin in (("csv", "drive [deg]"), ("json", "{"), ("svg", "<svg")):
            with page.expect_download() as got:
                page.click(f'a[href^="/guide/watt/{name}"]')
            file = tmp_path / got.value.suggested_filename
            got.value.save_as(file)
            assert file.name == f"watt.{name}"
            assert file.read_text("utf-8").startswith(begin)
        rows = list(csv.DictReader(io.StringIO((tmp_path / "watt.csv").read_text("utf-8"))))
        assert len(rows) == 73
        assert np.ptp([float(row["guided x [mm]"]) for row in rows]) == pytest.approx(4, rel=0.01)


def test_an_own_linkage_is_dragged(opened: Callable[..., Any]) -> None:
    with opened("/own") as page:
        page.wait_for_selector("#told .drawing svg")
        way = page.get_attribute(".board .way", "d")
        deviation = page.inner_text("#told dl div:has-text('Deviation') dd")
        x, y = place(page, '[data-name="A1*"] circle:last-of-type')
        page.mouse.move(x + 4, y + 4)
        page.mouse.down()
        page.mouse.move(x + 24, y + 14, steps=4)
        until(page, "way => document.querySelector('.board .way').getAttribute('d') !== way", way)
        assert page.inner_text("#told dl div:has-text('Transmission') dd").startswith("…")  # live, not yet settled
        page.mouse.up()
        until(page, "!document.querySelector('#told').innerText.includes('…')")
        assert page.inner_text("#told dl div:has-text('Deviation') dd") != deviation
        assert "linkage" in asked(page)
        pivots = page.input_value("#o-linkage")
        page.reload()
        page.wait_for_selector("#told .drawing svg")
        assert page.input_value("#o-linkage") == pivots


def test_an_own_linkage_is_typed(opened: Callable[..., Any]) -> None:
    with opened("/own") as page:
        page.wait_for_selector("#told .drawing svg")
        page.fill(
            "#o-linkage", '{"crank": 100, "rocker": 250, "ground": 220, "coupler": 250, "along": 125, "across": 80}'
        )
        page.fill("#o-stroke", "120")
        until(page, "document.querySelector('#told').innerText.includes('0.485')")


def test_what_is_wrong_is_said_at_the_field(entered: Callable[..., BrowserContext], address: str) -> None:
    page = entered().new_page()  # whose console says that the answer was 400
    page.goto(address + WISH)
    page.wait_for_selector(REFINED, timeout=60_000)
    page.fill("#f-max_size", "wide")
    until(page, "document.querySelector('#e-max_size').textContent.includes('no length')")
    page.fill("#f-max_size", "400")
    page.wait_for_selector(f"{REFINED} .card", timeout=60_000)
    assert page.inner_text("#e-max_size") == ""
    page.close()


def test_all_of_it_is_done_by_keyboard(opened: Callable[..., Any]) -> None:
    with opened(WISH) as page:
        page.wait_for_selector(f"{REFINED} .card")

        def reach(selector: str, limit: int = 80) -> None:
            for _ in range(limit):
                page.keyboard.press("Tab")
                if page.evaluate("s => document.activeElement.matches(s)", selector):
                    return
            raise AssertionError(f"Tab does not reach {selector}")

        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.className") == "skip"
        reach("#f-stroke")
        page.keyboard.press("Control+A")
        page.keyboard.insert_text("140")
        page.wait_for_url("**stroke=140**")
        page.wait_for_selector(f"{SETTLED} .card")
        assert page.evaluate("document.activeElement.id") == "f-stroke"
        reach(".card input[name=pick]")
        page.keyboard.press("Space")
        page.wait_for_url("**pick=**")
        assert len(asked(page)["pick"]) == 1
        reach("#tray button")
        page.keyboard.press("Enter")
        page.wait_for_url("**/compare**")
        reach(".compare a")
        page.keyboard.press("Enter")
        page.wait_for_url("**/guide/**")
        reach('a[href^="/own"].button')
        page.keyboard.press("Enter")
        page.wait_for_url("**/own**")
        page.wait_for_selector("#told .drawing svg")
        reach('[data-name="P"]')
        before = page.input_value("#o-y")
        page.keyboard.press("Shift+ArrowUp")
        assert page.input_value("#o-y") != before
        assert page.evaluate("document.activeElement.dataset.name") == "P"
        until(page, "!document.querySelector('#told').innerText.includes('…')")


@pytest.mark.parametrize("path", [WISH, "/guide/watt", "/own", "/compare?pick=watt&pick=roberts&pick=evans"])
def test_a_narrow_screen_holds_it_light_and_dark(opened: Callable[..., Any], path: str) -> None:
    with opened(path, viewport=NARROW, color_scheme="light") as page:
        page.wait_for_selector(".drawing svg")
        assert page.evaluate("document.documentElement.scrollWidth") <= NARROW["width"]
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
            assert (sum(map(int, re.findall(r"\d+", paper)[:3])) > 380) == (scheme == "light")


def test_on_a_phone_answers_come_first_and_the_form_unfolds(opened: Callable[..., Any]) -> None:
    with opened(WISH, viewport=NARROW) as page:
        page.wait_for_selector(f"{REFINED} .card")
        assert not page.is_visible("#f-stroke")
        assert place(page, ".card")[1] < NARROW["height"] / 2
        page.click("label.unfold")
        assert place(page, "#f-stroke")[1] < place(page, ".card")[1]
        page.fill("#f-stroke", "140")
        page.wait_for_url("**stroke=140**")
        assert "stroke 140" in page.inner_text("#said")
        page.fill("#f-max_size", "400")
        page.wait_for_selector(f"{SETTLED} .card")
    with opened(WISH) as page:
        assert page.is_visible("#f-stroke")
        assert not page.is_visible("label.unfold")


def test_it_serves_without_a_script(entered: Callable[..., BrowserContext], address: str) -> None:
    context = entered(java_script_enabled=False)
    page = context.new_page()
    page.goto(address + "/")
    page.fill("#f-stroke", "150")
    page.fill("#f-deviation", "0.5")
    page.click("#wish button[type=submit]")
    page.wait_for_selector(f"{REFINED} .card", timeout=60_000)
    page.locator(".card input[name=pick]").first.check()
    page.click("#tray button")
    page.wait_for_selector(".compare svg")
    context.close()
