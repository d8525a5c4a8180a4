"""`python -m paper`: compute the page on a stack of its own and write it, with its pictures."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import grazemap
from grazemap import Client
from paper.codimension_two import computed_points, figure_5, figure_7
from paper.discontinuity import mapping, unfolding
from paper.double_grazing import figure_2, figure_3, figure_6
from paper.errors import errors
from paper.figure_8 import figure_8
from paper.figure_9 import figure_9
from paper.page import PICTURES, Row, Section, save_pictures, table, wrapped
from paper.paper import GAMMA, TITLE

PAGE = "reproduction.md"
POINTS = 1013


def first_part(client: Client) -> Iterator[Section]:
    """Yield the sections on the paper's own numbers, without the maps of Figures 8 and 9."""
    yield figure_2(client)
    yield figure_3(client)
    yield mapping(client)
    yield figure_5(client)
    points = computed_points(client)
    yield figure_6(client, points)
    yield figure_7(client)
    yield unfolding(client)
    yield errors(client, points[GAMMA])


def head(rows: list[Row], cpu: str) -> str:
    """Return the top of the page, with the table of everything that the paper prints as a number."""
    version = grazemap.__version__
    introduction = [
        "# The paper, reproduced",
        wrapped(
            f"`make reproduce` writes this page and its pictures (grazemap {version}, kernels compiled for {cpu}); do"
            " not edit it. Every number is computed by the service, except those that the paper prints, which are"
            " marked as printed. On another processor the last digits may differ."
        ),
        wrapped(
            f"The paper is *{TITLE}*; numbers in brackets are its equations. Its system: k_2 = k_3 = 5, m_2 = m_3 = 10,"
            " zeta_i = 0.05, R = 0.8, f = (1, 0, 0). Figures 1 and 4 are sketches without numbers."
        ),
        "The first table has every number that the paper prints as a result, and the computed one:",
        table(
            ["where", "what", "printed", "computed", "agreement"],
            [[row.where, row.what, row.printed, row.computed, row.verdict] for row in rows],
        ),
    ]
    return "\n\n".join(introduction)


def write(docs: Path, sections: list[Section], cpu: str) -> None:
    """Write the page and its pictures."""
    (docs / PICTURES).mkdir(parents=True, exist_ok=True)
    for section in sections:
        save_pictures(section, docs / PICTURES)
    rows = [row for section in sections for row in section.rows]
    text = "\n\n".join([head(rows, cpu), *(section.markdown() for section in sections)])
    (docs / PAGE).write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Compute and write."""
    parser = argparse.ArgumentParser(prog="python -m paper", description="The paper, reproduced.")
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="folder of the page")
    parser.add_argument("--points", type=int, default=POINTS, help="clearances on each of Figure 9's two lines")
    arguments = parser.parse_args()
    started = time.monotonic()

    def say(text: str) -> None:
        print(f"[{time.monotonic() - started:4.0f} s] {text}", file=sys.stderr, flush=True)

    say("starting service, queue and workers; the first time, the kernels are compiled, a minute or two")
    with grazemap.local() as client:
        sections: list[Section] = []
        for section in first_part(client):
            sections.append(section)
            say(section.title)
        motions, samples = figure_9(client, arguments.points)
        say(motions[0].title)
        sections.append(figure_8(client, samples))
        say(sections[-1].title)
        sections += motions
        cpu = str(client.grazing_curve(omega=[0.1, 0.2, 0.3], progress=False).meta["numerics"]["cpu"])
        write(arguments.docs, sections, cpu)
    say(f"written: {arguments.docs / PAGE} and {sum(len(section.pictures) for section in sections)} pictures")


if __name__ == "__main__":
    main()
