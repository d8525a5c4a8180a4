"""The operations page names what exists of metrics, problems and alerts."""

import re
from pathlib import Path

import pytest
import yaml

from grazemap.wire.problems import KINDS
from grazemap_worker.store import EVENT_KINDS

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "operations.md").read_text("utf-8")
API = (DOCS / "reference" / "http.md").read_text("utf-8")
# the guide's own test compares these with /metrics
METRICS = set(re.findall(r"^\| `(grazemap_\w+)` \|", API, re.MULTILINE))
PROBLEMS = set(re.findall(r"^\| `urn:grazemap:problem:([a-z-]+)` \|", API, re.MULTILINE))
GROUPS = yaml.safe_load((DOCS / "alerts.yml").read_text("utf-8"))["groups"]
ALERTS = {rule["alert"]: rule for group in GROUPS for rule in group["rules"]}
TABLE = PAGE.partition("| what fails |")[2].partition("\n\n")[0]


def test_every_kind_of_event_is_a_row_and_no_other() -> None:
    assert set(re.findall(r"`((?:failures|overran|poisoned|ended|hung):\w+)`", PAGE)) == set(EVENT_KINDS)


def test_every_alert_is_named_in_a_row_and_no_other() -> None:
    assert set(re.findall(r"`(Grazemap\w+)`", TABLE)) == set(ALERTS)


def test_metrics_and_problems_on_the_page_exist() -> None:
    assert set(re.findall(r"`(grazemap_\w+)`", PAGE)) <= METRICS
    named = set(re.findall(r"`([a-z]+(?:-[a-z]+)+)`", TABLE))
    assert named <= PROBLEMS
    # the other problems are the client's to mend
    assert named >= {name for name, kind in KINDS.items() if kind.status >= 500} | {"core-outdated"}


@pytest.mark.parametrize("name", sorted(ALERTS))
def test_alerts_are_rules_about_metrics_and_kinds_that_exist(name: str) -> None:
    rule = ALERTS[name]
    assert set(rule) <= {"alert", "expr", "for", "labels", "annotations"}
    assert re.fullmatch(r"\d+[mh]", rule.get("for", "1m"))
    assert rule["labels"]["severity"] in ("page", "ticket")
    assert rule["annotations"]["summary"].endswith(".")
    expression = rule["expr"]
    named = re.findall(r"grazemap_\w+", expression)
    assert named
    assert set(named) <= METRICS
    words = set(re.findall(r"[a-z_]+(?=\()", re.sub(r'"[^"]*"', "", expression)))
    assert words <= {"absent", "increase", "sum"}
    for opening, closing in ("()", "[]", "{}"):
        assert expression.count(opening) == expression.count(closing)
    for pattern in re.findall(r'kind=~?"([^"]*)"', expression):
        for alternative in pattern.split("|") if "(" not in pattern else [pattern]:
            assert any(re.fullmatch(alternative, kind) for kind in EVENT_KINDS), alternative
    # a range needs a function, and a threshold is compared with
    assert ("[" in expression) == ("increase" in expression)
    assert re.search(r"==|>|absent", expression)
