"""Actions on the pages of the console in a browser, and their accessibility as axe-core checks it."""

from __future__ import annotations

from importlib.resources import files

from tests.console.running import OPERATOR
from tests.teaching.browser import Browser

RECORD_ERRORS = (
    "window.troubles = []; window.onerror = (m) => window.troubles.push(String(m));"
    "console.error = (...m) => window.troubles.push(m.join(' '));"
)


def sign_in(browser: Browser, address: str, token: str = OPERATOR) -> None:
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=RECORD_ERRORS)
    browser.open(f"{address}?token={token}")


def open_run(browser: Browser, address: str, token: str = OPERATOR, name: str = "evening") -> None:
    sign_in(browser, address, token)
    browser.until("document.querySelectorAll('.runs tbody a').length == 4")
    open_from_list(browser, name)


def open_from_list(browser: Browser, name: str) -> None:
    """Open a run from the list."""
    link = f"[...document.querySelectorAll('.runs a')].find(a => a.innerText == '{name}')"
    browser.until(f"!!{link}")
    browser.value(f"{link}.click()")
    browser.until("document.querySelector('img.picture')?.naturalWidth > 0")


def open_tab(browser: Browser, name: str) -> None:
    browser.value(
        f"[...document.querySelectorAll('.q-tab')].find(t => t.innerText.trim() == '{name}').click()"
    )


def press_button(browser: Browser, text: str) -> None:
    browser.until(
        f"[...document.querySelectorAll('button')].some(b => b.innerText.trim() == '{text}')"
    )
    browser.value(
        f"[...document.querySelectorAll('button')].find(b => b.innerText.trim() == '{text}').click()"
    )


def wait_for_text(browser: Browser, text: str) -> None:
    browser.until(f"document.body?.innerText.includes({text!r})")


def toggle_checkbox(browser: Browser, name: str) -> None:
    browser.until(
        f"[...document.querySelectorAll('.q-checkbox')].some(c => c.innerText.trim() == '{name}')"
    )
    browser.value(
        f"[...document.querySelectorAll('.q-checkbox')].find(c => c.innerText.trim() == '{name}').click()"
    )


def accessibility_violations(browser: Browser) -> list[str]:
    """Serious and critical violations on the current page, from axe-core."""
    browser.until("document.getAnimations().every(a => a.playState == 'finished')")
    if not browser.value("!!window.axe"):
        program = files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8")
        browser.value(program + "; 0")
    browser.value(
        "window.found = null; axe.run({resultTypes: ['violations']})"
        ".then(r => window.found = r.violations); 0"
    )
    browser.until("window.found !== null")
    severe = "window.found.filter(v => ['serious', 'critical'].includes(v.impact))"
    return list(
        browser.value(
            f"{severe}.map(v => v.id + ': ' + v.nodes[0].html + v.nodes[0].failureSummary)"
        )
    )
