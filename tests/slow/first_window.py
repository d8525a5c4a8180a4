"""The explorer's first window after a warm start, in headless Chromium: `python -m tests.slow.first_window`.

Prints when the first motions are there, when previews of all tiles, and when all of them are verified, in seconds since
the address was opened; how long after steps of a slider the motions of another machine are there; and which processor
time the tiles took. Exits with 1 if one of them is late. On a machine
slower than the reference of `tools.pace` the limits are longer in proportion, which is said first. Nothing else
should run on the machine.
"""

from __future__ import annotations

import sys
import time
from datetime import datetime
from statistics import median
from typing import Any

from playwright.sync_api import Browser, expect, sync_playwright

from tests.support.running_stack import RunningStack
from tests.support.watched_page import FLAGS
from tools.pace import pace

MOST_SECONDS = {"first motions": 1.0, "previews": 6.0, "verified": 15.0, "slider": 1.5}
STEPS = (0.7, 0.6, 0.75)  # restitutions that its slider takes
ROUNDS = 3
IDLE_SHARE, IDLE_SECONDS = 0.05, 2.0
LONGEST = 120_000  # milliseconds
MOTIONS, VERIFIED = "#legend li", "#progress.done"
_NOTING = f"""
window.seen = {{}};
new MutationObserver(() => {{
  for (const selector of {[MOTIONS, VERIFIED]})
    if (document.querySelector(selector)) seen[selector] ??= Date.now();
}}).observe(document, {{ attributes: true, childList: true, subtree: true }});
"""
# Moves a slider; the seconds until motions are in the legend that was emptied for another machine.
_MOVED = f"""(value) => new Promise((resolve) => {{
  const began = performance.now();
  let isOther = false;
  new MutationObserver((_, observer) => {{
    const motions = document.querySelector("{MOTIONS}");
    isOther ||= !motions;
    if (!isOther || !motions) return;
    observer.disconnect();
    resolve((performance.now() - began) / 1000);
  }}).observe(document.getElementById("legend"), {{ childList: true }});
  const slider = document.querySelector("#sliders [name=restitution]");
  slider.value = value * slider.max;
  slider.dispatchEvent(new Event("input", {{ bubbles: true }}));
}})"""


def rest(stack: RunningStack) -> None:
    """Wait until the processes of a stack do nothing: its workers have loaded their kernels."""

    def used() -> float:
        processes = [stack.process, *stack.process.children(recursive=True)]
        return sum(sum(process.cpu_times()[:2]) for process in processes if process.is_running())

    before = -1.0
    while used() - before > IDLE_SHARE * IDLE_SECONDS:
        before = used()
        time.sleep(IDLE_SECONDS)


def one_round(browser: Browser) -> dict[str, float]:
    """Open the page of a new stack; return the seconds of the stages, and the processor time of the first tiles."""
    stack = RunningStack("--die-with-parent")
    try:
        rest(stack)
        page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
        page.add_init_script(_NOTING)
        began = time.time()
        page.goto(stack.url)
        expect(page.locator(VERIFIED)).to_be_attached(timeout=LONGEST)
        # of the page's own clock: playwright looks again after up to a second
        first, verified = (page.evaluate("seen")[selector] / 1e3 - began for selector in (MOTIONS, VERIFIED))
        jobs: list[dict[str, Any]] = stack.request("/v1/jobs?process=unfolding-maps&limit=500")["jobs"]
        moved = [page.evaluate(_MOVED, value) for value in STEPS]
        page.context.close()
    finally:
        stack.popen.terminate()
        stack.popen.wait(20)
    previews = [
        datetime.fromisoformat(job["finished"]).timestamp() - began for job in jobs if "preview" in job["request"]
    ]
    return {
        "first motions": first,
        "previews": max(previews),
        "verified": verified,
        "slider": max(moved),
        "processor": sum(job["cpu_seconds"] for job in jobs),
    }


def main() -> int:
    """Print the figures of some rounds; return whether a median is late."""
    times = pace()
    print(f"limits {times:.2f} times those of the reference", flush=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", headless=True, args=FLAGS)
        rounds = [one_round(browser) for _ in range(ROUNDS)]
        browser.close()
    for name in rounds[0]:
        print(f"{name}: {', '.join(f'{figures[name]:.1f}' for figures in rounds)} s", flush=True)
    return any(median(figures[name] for figures in rounds) > most * times for name, most in MOST_SECONDS.items())


if __name__ == "__main__":
    sys.exit(main())
