"""The list of all settings, for `grazemap up --help` and the table of the guide."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import wrap
from typing import NamedTuple

from pydantic.fields import FieldInfo

from grazemap_service.settings import ServiceSettings, StackSettings
from grazemap_worker.redis_settings import RedisSettings, variable_of
from grazemap_worker.settings import WorkerSettings

_KINDS = (
    ("both", RedisSettings),
    ("service", ServiceSettings),
    ("worker", WorkerSettings),
    ("`grazemap up`", StackSettings),
)
"""From the processes that read settings to the class that declares these."""
_INDENT = "      "


class Setting(NamedTuple):
    """An environment variable that is a setting."""

    variable: str
    """Its name."""
    default: str
    """Its default as a user would write it, or words that describe it; empty: none."""
    readers: str
    """The processes that read it."""
    meaning: str
    """What it is, in Markdown."""


def settings() -> Iterator[Setting]:
    """Yield every setting once, those of a process after one another."""
    yielded: set[str] = set()
    for readers, kind in _KINDS:
        for name, field in kind.model_fields.items():
            if name not in yielded:
                yielded.add(name)
                yield Setting(variable_of(name), _default(field), readers, field.description or "")


def help_text(columns: int) -> str:
    """Return all settings, which the processes of a stack read, as text for a terminal of a width."""
    lines = ["settings, which are environment variables (with their defaults):"]
    for setting in settings():
        default = f" ({setting.default})" if setting.default else ""
        lines.append(f"  {setting.variable}{default}".replace("`", ""))
        lines += wrap(setting.meaning.replace("`", ""), columns, initial_indent=_INDENT, subsequent_indent=_INDENT)
    return "\n".join(lines) + "\n"


def _default(field: FieldInfo) -> str:
    if isinstance(field.json_schema_extra, dict):
        return str(field.json_schema_extra["shown"])
    match field.default:
        case None | ():
            return ""
        case tuple():
            return ",".join(field.default)
        case float():
            return f"{field.default:.0f}"
        case _:
            return str(field.default)
