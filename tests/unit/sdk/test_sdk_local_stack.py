"""`local()` when the stack starts, does not start, or is not installed. The stack is a stand-in."""

import json
import os
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

import grazemap
from grazemap import local_stack
from grazemap.errors import MissingExtra, StackError

READY = 'import sys; print(\'{"url": "http://127.0.0.1:9", "pid": 1}\', flush=True); sys.stdin.read(); import time; '


@pytest.fixture
def stack(monkeypatch, tmp_path):
    """Gives `stack(code)`: from then on the stack is that piece of Python."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def planted(code: str) -> None:
        monkeypatch.setattr(local_stack, "stack_command", lambda *options: [sys.executable, "-c", code, *options])

    return planted


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_block_has_a_client_and_leaves_nothing(stack, tmp_path):
    stack(READY + "time.sleep(60)")
    with grazemap.local(workers=2) as client:
        assert client.base_url == "http://127.0.0.1:9"
        pid = client._stack._process.pid
        assert alive(pid)
        assert client._stack._process.args[-4:] == ["--die-with-parent", str(os.getpid()), "--workers", "2"]
    assert not alive(pid)
    assert list(tmp_path.iterdir()) == []
    client.close()  # once more does no harm


@pytest.mark.parametrize("key", ["secret", "no key"])
def test_the_key_of_another_service_is_not_sent_to_it(stack, tmp_path, monkeypatch, key):
    monkeypatch.setenv("GRAZEMAP_API_KEY", key)
    stack(READY + "time.sleep(60)")
    with grazemap.local() as client:
        assert not client._connection.settings.api_key
    assert list(tmp_path.iterdir()) == []


def test_a_stack_that_gets_no_client_is_stopped(stack, monkeypatch):
    def refused(*_, **__):
        raise ValueError("refused")

    stack(READY + "time.sleep(60)")
    stopped, stop = [], local_stack.LocalStack.stop
    monkeypatch.setattr(local_stack.LocalStack, "stop", lambda of: stopped.append(stop(of)))
    monkeypatch.setattr(grazemap.Client, "__init__", refused)
    with pytest.raises(ValueError, match="refused"):
        grazemap.local()
    assert stopped


@pytest.mark.parametrize("kind", [Path, str])
def test_a_given_data_folder_stays(stack, tmp_path, kind):
    stack("import os, sys; os.makedirs(sys.argv[-1]);" + READY + "time.sleep(60)")
    with grazemap.local(data=kind(tmp_path / "kept")):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


def test_a_client_shows_whether_its_results_go_with_it(stack, tmp_path):
    stack(READY + "time.sleep(60)")
    for data in (None, tmp_path):
        with grazemap.local(data=data) as client:
            shown = repr(client), client._repr_html_()
            assert all(client.base_url in text and ("data=" in text) is (data is None) for text in shown)


def test_a_stack_that_dies_is_reported_with_the_end_of_its_log(stack, tmp_path):
    stack("import sys; print('\\n'.join(f'line {i}' for i in range(99)), file=sys.stderr); sys.exit('no redis-server')")
    with pytest.raises(StackError, match="exit code 1") as caught:
        grazemap.local()
    assert str(caught.value).endswith("no redis-server")
    assert "line 98" in str(caught.value)
    assert "line 1\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_stack_that_is_never_ready_is_stopped(stack, tmp_path):
    stack("import time; time.sleep(60)")
    started = time.monotonic()
    with pytest.raises(StackError, match="not ready after"):
        local_stack.LocalStack(timeout=0.3)
    assert time.monotonic() - started < 30
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("line", ["hello", "[]", '{"pid": 1}'])
def test_a_stack_that_prints_no_address_is_reported(stack, line):
    stack(f"print({line!r}, flush=True); import time; time.sleep(60)")
    with pytest.raises(StackError, match="did not print its address"):
        grazemap.local()


def test_a_stack_that_closes_its_output_and_goes_on_is_reported(stack, monkeypatch):
    monkeypatch.setattr("grazemap.constants.LOCAL_STOP_TIMEOUT", 0.3)
    stack("import os, time; os.close(1); time.sleep(60)")
    with pytest.raises(StackError, match="did not print its address"):
        grazemap.local()


def test_a_stack_that_ignores_a_request_to_stop_is_killed(stack, monkeypatch):
    monkeypatch.setattr("grazemap.constants.LOCAL_STOP_TIMEOUT", 0.3)
    stack("import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN);" + READY + "time.sleep(60)")
    client = grazemap.local()
    pid = client._stack._process.pid
    client.close()
    assert not alive(pid)


def test_without_the_server_extra_the_error_names_what_to_install(monkeypatch):
    monkeypatch.setattr("grazemap.server_command.find_spec", lambda name: None if name == "rq" else find_spec(name))
    with pytest.raises(MissingExtra, match=r'pip install "grazemap\[server\]"') as caught:
        grazemap.local()
    assert isinstance(caught.value, ImportError)


def test_settings_of_an_operators_service_do_not_reach_it(stack, tmp_path, monkeypatch):
    foreign = {
        "API_KEYS": "abc",
        "API_KEYS_FILE": "keys",
        "ALLOWED_HOSTS": "lab",
        "CORS_ORIGINS": "*",
        "HOST": "0.0.0.0",
        "PORT": "1",
        "FD": "0",
    }
    own = {"GRAZEMAP_REDIS_URL": "redis://elsewhere", "GRAZEMAP_MAX_POINTS": "7"}
    for name in [name for name in os.environ if name.upper().startswith("GRAZEMAP_")]:
        monkeypatch.delenv(name)
    for name, value in foreign.items():
        monkeypatch.setenv(f"GRAZEMAP_{name}", value)
        monkeypatch.setenv(f"grazemap_{name.lower()}", value)  # the service takes them in any case
    for name, value in own.items():
        monkeypatch.setenv(name, value)
    seen = tmp_path / "seen"
    stack(f"import json, os; json.dump(dict(os.environ), open({str(seen)!r}, 'w'));" + READY + "time.sleep(60)")
    with grazemap.local():
        environment = json.loads(seen.read_text())
    assert {name: value for name, value in environment.items() if name.upper().startswith("GRAZEMAP_")} == own
    assert "PATH" in environment
