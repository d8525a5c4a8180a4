"""The operations page names every setting, with its default."""

import re
from pathlib import Path

import pytest

from grazemap_service.settings import Settings, StackSettings

ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in (Path(__file__).parents[2] / "docs" / "operations.md").read_text("utf-8").splitlines()
    if line.startswith("| `GRAZEMAP_")
]
DOCUMENTED = {
    name: default
    for names, defaults, *_ in ROWS
    for name, default in zip(re.findall(r"`(GRAZEMAP_\w+)`", names), [*defaults.split(", "), ""], strict=False)
}
FIELDS = {
    f"GRAZEMAP_{name}".upper(): field
    for model in (Settings, StackSettings)
    for name, field in model.model_fields.items()
}


def test_page_and_code_name_the_same_settings() -> None:
    assert set(DOCUMENTED) == set(FIELDS)


@pytest.mark.parametrize("name", sorted(FIELDS))
def test_documented_default_is_the_default(name: str) -> None:
    default, shown = FIELDS[name].default, DOCUMENTED[name]
    if isinstance(default, float | int) and not isinstance(default, bool):
        assert float(shown) == default
    elif isinstance(default, tuple):
        assert shown == ",".join(default)
    elif isinstance(default, str):
        assert shown == default
