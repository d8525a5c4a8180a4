"""`python -m paper.published`: compute the page on a stack of its own and write it, with its pictures."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import grazemap
from grazemap import Client
from paper.page import PICTURES, Section, save_pictures, table, wrapped
from paper.published.elastic_wall import elastic_wall
from paper.published.impact_damper import impact_damper
from paper.published.not_found import not_found
from paper.published.period_adding import period_adding
from paper.published.resonant_graze import curves, tangency
from paper.published.tutorial import tutorial
from paper.published.undamped import undamped

PAGE = "published.md"
PARTS: tuple[Callable[[Client], Section], ...] = (
    tutorial,
    curves,
    tangency,
    undamped,
    impact_damper,
    elastic_wall,
    period_adding,
    not_found,
)


def head(sections: Sequence[Section]) -> str:
    """Return the top of the page, with the table of what is compared."""
    introduction = [
        "# Published results, computed again",
        wrapped(
            f"`make published` writes this page and its pictures (grazemap {grazemap.__version__}); do not edit it."
            " Columns called printed have numbers of the source that a section names, or what its formulas give, as"
            " its authors have coded them. Every other number is computed by the service. On another processor the"
            " last digits may differ."
        ),
        wrapped(
            "Sources differ in their conventions. A force F at a stop at 1 is here a stop at 1/F under a unit force,"
            " with speeds divided by F. Forces are cosines: in grazemap a phase of pi/2. Impact speeds are those"
            " before the impact."
        ),
        table(
            ["source", "what", "printed", "computed", "difference, and why"],
            [[row.where, row.what, row.printed, row.computed, row.verdict] for part in sections for row in part.rows],
        ),
    ]
    return "\n\n".join(introduction)


def main() -> None:
    """Compute and write."""
    parser = argparse.ArgumentParser(prog="python -m paper.published", description="Published results, again.")
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="folder of the page")
    arguments = parser.parse_args()
    started = time.monotonic()

    def say(text: str) -> None:
        print(f"[{time.monotonic() - started:4.0f} s] {text}", file=sys.stderr, flush=True)

    say("starting service, queue and workers; the first time, the kernels are compiled, a few minutes")
    with grazemap.local() as client:
        sections = []
        for part in PARTS:
            sections.append(part(client))
            say(sections[-1].title)
        (arguments.docs / PICTURES).mkdir(parents=True, exist_ok=True)
        for section in sections:
            save_pictures(section, arguments.docs / PICTURES)
    text = "\n\n".join([head(sections), *(section.markdown() for section in sections)])
    (arguments.docs / PAGE).write_text(text + "\n", encoding="utf-8")
    say(f"written: {arguments.docs / PAGE} and {sum(len(section.pictures) for section in sections)} pictures")


if __name__ == "__main__":
    main()
