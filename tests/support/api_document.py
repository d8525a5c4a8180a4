"""The operations of the API's document, with what they refer to."""

from __future__ import annotations

from typing import Any


def operations(document: dict[str, Any]) -> list[tuple[str, str, dict[str, Any]]]:
    """The operations, with the parameters and responses to which they refer."""
    return [
        (method, path, {**operation,
            "responses": {status: looked_up(document, reply) for status, reply in operation["responses"].items()},
            "parameters": [looked_up(document, parameter) for parameter in operation.get("parameters", [])]})
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]  # fmt: skip


def looked_up(document: dict[str, Any], part: dict[str, Any]) -> dict[str, Any]:
    """A part of the document, or what it refers to."""
    for name in part.get("$ref", "").split("/")[1:]:
        document = document[name]
    return document if "$ref" in part else part
