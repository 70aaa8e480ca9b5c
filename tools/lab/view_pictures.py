#!/usr/bin/env python3
"""The page of `itn view` in headless Chromium: checks what a user would do, and takes pictures to look at.

view_pictures.py [--itn PATH] [--output FOLDER]

Needs Chromium (Debian's package `chromium`) and Playwright (`pip install playwright`); where they are missing it says so and
ends with 77. Exit code 1 where a check fails.
"""
import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from view_client import View

ROOT = Path(__file__).resolve().parents[2]
WAX = ROOT / "docs/tutorials/wax.xml"
failures = []


def check(what, holds):
    print(f"{'passed' if holds else 'FAILED'}: {what}", flush=True)
    if not holds:
        failures.append(what)


def wait_for(page, condition, seconds=60):
    """Playwright's own wait_for_function evaluates text in the page, which the page forbids."""
    deadline = time.perf_counter() + seconds
    while not page.evaluate(condition):
        if time.perf_counter() > deadline:
            raise TimeoutError(condition)
        page.wait_for_timeout(20)


def refined(page, samples):
    wait_for(page, f"Number(document.getElementById('image').dataset.spp) >= {samples}")


def slide(page, name, place):
    """Moves a parameter's slider as a user does; returns the milliseconds to the first picture with the new value."""
    return page.evaluate("""async ([name, place]) => {
        const row = rows.find((r) => r.parameter.name === name);
        const before = Number(element('image').dataset.revision);
        const start = performance.now();
        row.slider.focus();
        row.slider.value = place;
        row.slider.dispatchEvent(new Event('input'));
        while (Number(element('image').dataset.revision) === before) await new Promise((r) => setTimeout(r, 1));
        return performance.now() - start;
    }""", [name, place])


def shoot(page, folder, name, **options):
    page.screenshot(path=str(folder / f"{name}.png"), **options)


def run(browser, itn, folder):
    photo = folder / "photo.exr"
    size = "128x128"
    subprocess.run([itn, "render", WAX, "--size", size, "-D", "sigma_t=35", "-D", "g=0.3", "--spp", "256", "--seed", "1",
                    "-o", photo, "--quiet"], check=True)
    with View(itn, [str(WAX), "--size", size]) as view:  # fills the driver's cache
        view.first_picture()

    with View(itn, [str(WAX), "--size", size]) as view:
        problems = []
        page = browser.new_page(viewport={"width": 1280, "height": 800}, color_scheme="light")
        page.on("console", lambda message: problems.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("request", lambda request: None if request.url.startswith((view.address, "data:", "blob:")) else
                problems.append(request.url))
        start = time.perf_counter()
        page.goto(view.address)
        refined(page, 1)
        print(f"the browser's first picture: {time.perf_counter() - start:.2f} s after the address was opened")
        refined(page, 64)
        shoot(page, folder, "light")
        times = sorted(slide(page, "wax.sigma_t", 0.3 + 0.01 * k) for k in range(30))
        print(f"30 moves of a slider in the browser: {times[15]:.0f} ms (median), {times[-1]:.0f} ms (longest)")
        check("every move is answered within 150 ms", times[-1] <= 150)
        slide(page, "wax.sigma_t", 0.5)
        page.get_by_label("Derivative by").check()
        wait_for(page, "document.getElementById('derivative').textContent.includes('red')", 60)
        refined(page, 256)
        shoot(page, folder, "derivative")
        page.get_by_label("sunsky0.turbidity", exact=True).fill("99")
        page.get_by_label("sunsky0.turbidity", exact=True).press("Enter")
        page.wait_for_selector("#message:not([hidden])")
        check("a value out of range is told", "turbidity" in page.inner_text("#message"))
        page.wait_for_timeout(500)
        check("and the field shows the old one again", page.get_by_label("sunsky0.turbidity", exact=True).input_value() == "3")
        shoot(page, folder, "refused")
        for label, ending in (("Save scene", ".xml"), ("Save EXR", ".exr"), ("Save PNG", ".png")):
            with page.expect_download() as download:
                page.get_by_role("button", name=label).click()
            check(f"{label} saves {ending}", download.value.suggested_filename == f"wax-view{ending}")
            download.value.save_as(folder / download.value.suggested_filename)

        second = browser.new_page(viewport={"width": 420, "height": 820}, color_scheme="dark")
        second.goto(view.address)
        refined(second, 64)
        value = second.evaluate("rows.find((r) => r.parameter.name === 'wax.sigma_t').field.value")
        check("a second tab shows the values of the first", abs(float(value) - 20) < 0.1)
        slide(second, "phase.g", 0.9)
        wait_for(page, "Math.abs(Number(rows.find((r) => r.parameter.name === 'phase.g').field.value) - 0.8) < 0.02")
        check("and the first follows what is moved in the second", True)
        shoot(second, folder, "narrow-dark")
        check("nothing is wider than a narrow window",
              second.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth"))
        page.close()
        slide(second, "phase.g", 0.6)
        check("a closed tab does not disturb the other", True)

        # By keyboard alone.
        second.evaluate("rows[0].slider.focus()")
        before = float(second.evaluate("rows[0].field.value"))
        second.keyboard.press("ArrowRight")
        check("arrow keys move a slider", float(second.evaluate("rows[0].field.value")) > before)
        unnamed = second.evaluate("""[...document.querySelectorAll('input, button, canvas')].filter((e) => e.offsetParent
            && !(e.labels && e.labels.length) && !e.getAttribute('aria-label') && !e.textContent.trim()).length""")
        check("every control has a name", unnamed == 0)

        wrong = browser.new_page()
        answer = wrong.goto(view.address[:-3] + "00/")
        check("a wrong token shows what to do", answer.status == 403 and "address" in wrong.inner_text("body"))
        wrong.close()
        view.process.kill()
        second.wait_for_selector("#message:not([hidden])", timeout=20000)
        check("a killed process is told", "No connection" in second.inner_text("#message"))
        shoot(second, folder, "killed")
        second.close()
        check("no error, and nothing from elsewhere" + "".join(f"; {p}" for p in problems),
              [p for p in problems if "400 (Bad Request)" not in p] == [])

    with View(itn, [str(WAX), "--size", size, "--target", str(photo)]) as view:
        for scheme in ("light", "dark"):
            page = browser.new_page(viewport={"width": 1440, "height": 900}, color_scheme=scheme)
            page.goto(view.address)
            page.wait_for_selector("#step:enabled", timeout=120000)
            refined(page, 128)
            shoot(page, folder, f"target-{scheme}")
            if scheme == "light":
                page.get_by_label("Keep stepping").check()
                wait_for(page, "document.getElementById('step-note').textContent.includes('best values')", 120)
                refined(page, 128)
                found = float(page.evaluate("rows.find((r) => r.parameter.name === 'wax.sigma_t').field.value"))
                check(f"Gauss-Newton finds sigma_t: {found:.3g} beside 35", abs(found - 35) < 10)
                shoot(page, folder, "fitted")
                page.get_by_label("Keep stepping").uncheck()
            page.close()
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    with View(itn, [str(ROOT / "scenes/gallery/materials.xml"), "--size", "480x360"]) as view:
        page.goto(view.address)
        refined(page, 16)
        shoot(page, folder, "materials", full_page=True)
    page.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--itn", default=str(ROOT / "build/bin/itn"))
    parser.add_argument("--output", help="folder for the pictures; default: one that is removed")
    options = parser.parse_args()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        print("needs Playwright: pip install playwright")
        sys.exit(77)
    chromium = shutil.which("chromium")
    if not chromium:
        print("needs Chromium: apt-get install chromium")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as own, sync_playwright() as playwright:
        folder = Path(options.output or own)
        folder.mkdir(parents=True, exist_ok=True)
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"] if os.getuid() == 0 else [])
        run(browser, options.itn, folder)
        browser.close()
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
