"""What editors read of the clients is what the generator writes; the blocking client is like the asynchronous one."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import grazemap
from grazemap.wire import PROCESSES

ROOT = Path(__file__).parents[3]
CLIENT = ROOT / "sdk" / "grazemap" / "client"
BOTH = [(grazemap.Client, grazemap.AsyncClient), (grazemap.JobHandle, grazemap.AsyncJobHandle)]


def test_the_stubs_are_up_to_date(tmp_path: Path) -> None:
    subprocess.run([sys.executable, ROOT / "tools" / "generate_stubs.py", tmp_path], check=True, timeout=120)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["client.pyi", "direct_client.pyi", "methods.pyi"]
    for path in tmp_path.iterdir():
        assert (CLIENT / path.name).read_text() == path.read_text(), "run `make tables`"


def test_a_stub_has_the_fields_of_every_request() -> None:
    text = (CLIENT / "methods.pyi").read_text()
    for request in PROCESSES.values():
        axis = {"axis"} if request.short is not None else set()  # its short forms stand for it
        for name in request.model_fields.keys() - axis:
            assert f"        {name}: " in text


@pytest.mark.parametrize(("blocking", "awaited"), BOTH)
def test_both_clients_have_the_same_methods_parameters_and_documentation(blocking: type, awaited: type) -> None:
    def public(kind: type) -> dict[str, tuple[list[str], str]]:
        methods = {name: method for name, method in inspect.getmembers(kind, inspect.isfunction) if name[0] != "_"}
        return {
            name: (
                [str(parameter) for parameter in inspect.signature(method).parameters.values()],
                (inspect.getdoc(method) or "").replace("await client.", "client."),
            )
            for name, method in methods.items()
        }

    assert public(blocking) == public(awaited)


@pytest.mark.parametrize(("blocking", "awaited"), BOTH)
def test_nothing_of_the_blocking_client_is_awaited(blocking: type, awaited: type) -> None:
    for name, method in inspect.getmembers(blocking, inspect.isfunction):
        if name[0] != "_":
            assert not inspect.iscoroutinefunction(method)
            assert "async" not in f"{inspect.getdoc(method)}{inspect.signature(method)}".lower()
            assert "await" not in (inspect.getdoc(method) or "")
    assert "async" not in (blocking.__doc__ or "").lower()
    assert not hasattr(blocking, "__aenter__")
