"""The paper for JOSS: its form, and references that the documents have too."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[3]
PAPER = (ROOT / "joss/paper.md").read_text("utf-8")
_, FRONT, BODY = PAPER.split("---\n", 2)
ENTRIES = {
    key: dict(re.findall(r"^  (\w+) = \{(.*)\},$", fields, re.MULTILINE))
    for key, fields in re.findall(
        r"^@\w+\{(\w+),\n((?:  .*\n)+)\}", (ROOT / "joss/paper.bib").read_text(), re.MULTILINE
    )
}
SECTIONS = ["Summary", "Statement of need", "State of the field", "Software design", "Research impact statement"]


def test_it_has_the_sections_and_the_length_that_the_journal_asks_for() -> None:
    assert re.findall(r"^# (.*)", BODY, re.MULTILINE) == [*SECTIONS, "References"]
    assert 750 <= len(BODY.split()) <= 1750
    front = yaml.safe_load(FRONT)
    assert set(front) == {"title", "tags", "authors", "date", "bibliography"}
    assert (ROOT / "joss" / front["bibliography"]).exists()


def test_every_reference_is_cited_and_every_citation_has_one() -> None:
    assert set(re.findall(r"@(\w+)", BODY)) == set(ENTRIES)
    assert len(ENTRIES) > 5


def test_references_are_those_of_the_documents() -> None:
    """None is invented: the documents name the same titles, DOIs and numbers of arXiv."""
    named = (ROOT / "CITATION.cff").read_text() + (ROOT / "docs/published.md").read_text()
    known = " ".join(named.split())
    for entry in ENTRIES.values():
        assert entry["title"].replace("{", "").replace("}", "") in known
        assert all(
            entry[name].replace("--", "-") in known for name in ("doi", "eprint", "volume", "pages") if name in entry
        )
        assert entry["year"] in known or entry["year"] == f"20{entry['eprint'][:2]}"


def test_pictures_and_targets_exist() -> None:
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert set(re.findall(r"`make\s([\w-]+)`", BODY)) <= set(targets)
    for name in re.findall(r"\]\(([^)]+)\)", BODY):
        assert (ROOT / "joss" / name).exists()
