"""The command line: output files, exit codes, and messages on stderr."""

import io
import json
import subprocess
import sys

import numpy as np
import pytest

import grazemap
from grazemap import cli, constants
from grazemap.codec import decode_npz, encode_npz
from grazemap.results.tables import Column, text
from tests.support.sdk_documents import ONE_STOP, REQUESTS, npz
from tests.support.sdk_fake_service import FakeService, served


@pytest.fixture
def url(service: FakeService):
    with served(service) as address:
        yield address


@pytest.fixture
def request_file(tmp_path):
    path = tmp_path / "request.json"
    path.write_text(json.dumps(REQUESTS["unfolding-maps"]))
    return str(path)


@pytest.mark.parametrize("name", ["map.npz", "map.json", "map.png", "map.svg"])
def test_run_writes_the_format_of_the_file_ending(url, request_file, tmp_path, capsys, name):
    output = tmp_path / name
    assert cli.main(["run", "unfolding-maps", "--json", request_file, "-o", str(output), "--url", url]) == 0
    assert output.stat().st_size > 500
    captured = capsys.readouterr()
    assert captured.out.strip() == str(output)
    assert captured.err == ""  # no terminal, so no progress
    if output.suffix in (".npz", ".json"):
        assert grazemap.load(output).kind.shape == (2, 3)


def test_run_reads_standard_input_and_the_environment(url, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("GRAZEMAP_URL", url)
    monkeypatch.setattr("sys.stdin", io.StringIO(json.dumps(REQUESTS["grazing-curves"])))
    assert cli.main(["run", "grazing-curves", "--json", "-", "-o", str(tmp_path / "c.npz"), "--quiet"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("body", "output", "said"),
    [
        ('{"omega": {"start": 2, "stop": 1, "points": 5}}', "c.npz", "/omega"),
        ('{"omega": 1', "c.npz", "not JSON"),
        ("[1]", "c.npz", "not a JSON object"),
        ('{"omega": [1, 2]}', "c.csv", "must end in"),
    ],
)
def test_an_invalid_request_gives_2_and_sends_nothing(url, service, tmp_path, capsys, body, output, said):
    source = tmp_path / "request.json"
    source.write_text(body)
    arguments = ["run", "grazing-curves", "--json", str(source), "-o", str(tmp_path / output), "--url", url]
    assert cli.main(arguments) == 2
    assert said in capsys.readouterr().err
    assert service.requests == []


@pytest.mark.parametrize("content", [b'{"omega": "\xff"}', b'{"omega":' + b"[" * 100_000, b"1" * 5000])
@pytest.mark.parametrize("source", ["file", "stdin"])
def test_a_request_that_cannot_be_read_gives_2(tmp_path, monkeypatch, capsys, content, source):
    path = tmp_path / "request.json"
    path.write_bytes(content)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content), encoding="utf-8"))
    given = str(path) if source == "file" else "-"
    assert cli.main(["run", "trajectories", "--json", given, "-o", str(tmp_path / "t.npz"), "--url", "http://x"]) == 2
    assert "the request is not JSON" in capsys.readouterr().err


@pytest.mark.parametrize("output", ["none/map.npz", "file/map.npz", "folder.npz"])
def test_an_output_that_cannot_be_written_is_reported_before_anything_is_sent(
    url, service, request_file, tmp_path, capsys, output
):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder.npz").mkdir()
    arguments = ["run", "unfolding-maps", "--json", request_file, "-o", str(tmp_path / output), "--url", url]
    assert cli.main(arguments) == 2
    assert "the output" in capsys.readouterr().err
    assert service.requests == []


def test_a_picture_without_matplotlib_is_reported_before_anything_is_sent(
    url, service, request_file, tmp_path, monkeypatch, capsys
):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    arguments = ["run", "unfolding-maps", "--json", request_file, "-o", str(tmp_path / "map.png"), "--url", url]
    assert cli.main(arguments) == 1
    assert "grazemap[plot]" in capsys.readouterr().err
    assert service.requests == []


def test_a_failed_job_gives_1_with_its_reason(url, service, request_file, tmp_path, capsys):
    service.ending = "failed"
    arguments = ["run", "unfolding-maps", "--json", request_file, "-o", str(tmp_path / "m.npz"), "--url", url]
    assert cli.main(arguments) == 1
    assert "tile 3" in capsys.readouterr().err
    assert not (tmp_path / "m.npz").exists()


@pytest.mark.parametrize(
    "arguments", [[], ["fly"], ["run", "no-such-process"], ["up", "--workers", "0"], ["up", "--port", "99999"]]
)
def test_a_wrong_command_gives_2(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(arguments)
    assert caught.value.code == 2
    assert "usage:" in capsys.readouterr().err


@pytest.fixture
def told_stack(monkeypatch):
    """A stack that comes up at an address made of its own arguments, and ends."""
    told = "import json, sys; print(json.dumps({'url': ' '.join(sys.argv[1:])}))"
    monkeypatch.setattr(cli.stack, "stack_command", lambda *options: [sys.executable, "-c", told, *options])


@pytest.mark.parametrize(
    ("environment", "arguments", "listens"),
    [
        ({}, [], "--host 127.0.0.1 --port 8000 "),
        ({"GRAZEMAP_PORT": "8141"}, [], "--host 127.0.0.1 --port 8141 "),
        ({"GRAZEMAP_HOST": "::1", "grazemap_port": "8141"}, [], "--host ::1 --port 8141 "),
        (
            {"GRAZEMAP_HOST": "::1", "GRAZEMAP_PORT": "8141"},
            ["--host", "localhost", "--port", "0"],
            "--host localhost --port 0 ",
        ),
    ],
)
def test_up_listens_at_the_address_of_the_environment_unless_options_are_given(
    told_stack, monkeypatch, capsys, environment, arguments, listens
):
    for name in ("GRAZEMAP_HOST", "GRAZEMAP_PORT"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert cli.main(["up", *arguments]) == 0
    assert listens in capsys.readouterr().out.splitlines()[0]


def test_an_invalid_port_in_the_environment_is_refused_by_name_and_shown_by_help(monkeypatch, capsys):
    monkeypatch.setenv("GRAZEMAP_PORT", "high")
    monkeypatch.setenv("GRAZEMAP_HOST", "fe80::1%eth0")
    for arguments, code in ((["up"], 2), (["up", "--help"], 0)):
        with pytest.raises(SystemExit) as caught:
            cli.main(arguments)
        assert caught.value.code == code
        written = capsys.readouterr()
        assert "GRAZEMAP_PORT" in written.out + written.err
    assert "(default: high)" in " ".join(written.out.split())
    assert "(default: fe80::1%eth0)" in " ".join(written.out.split())


def test_version(capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"grazemap {grazemap.__version__}\n"


def test_status_shows_the_service_and_its_jobs(url, service, capsys):
    with grazemap.Client(url) as client:
        client.submit("grazing-curves", REQUESTS["grazing-curves"])
    assert cli.main(["status", "--url", url]) == 0
    written = capsys.readouterr().out
    assert "version" in written
    assert "grazing-curves" in written
    # an id as commands and addresses take it
    assert next(iter(service.jobs)) in written.split()
    for line in (
        f"service   {url}, version fake",
        "state     ready",
        "workers   1, and 1 for small jobs; 1 compute",
        "          unfolding-maps aaaaaaaaaaaa, tile 3, for 2.5 min",
        "queue     812 unfinished tiles; the longest in work for 2 h",
        "          2 long jobs wait, one for 90 s",
        "store     4 MB of 2 GB, requests 2.1 kB",
        "failures  failures:lost 3",
    ):
        assert line in written.splitlines()


def test_status_of_a_service_that_is_not_ready_gives_1(url, service, capsys):
    service.ready = False
    assert cli.main(["status", "--url", url]) == 1
    assert "state     not ready: The disk is full." in capsys.readouterr().out
    assert cli.main(["status", "--json", "--url", url]) == 1
    assert json.loads(capsys.readouterr().out)["pending_tiles"] == 812


def test_status_says_why_jobs_failed(url, service, capsys):
    service.ending = "failed"
    with grazemap.Client(url) as client, pytest.raises(grazemap.errors.JobFailed):
        client.grazing_curve(omega=[0.1, 0.2, 0.3])
    assert cli.main(["status", "--url", url]) == 0
    assert "Tile failed: tile 3" in capsys.readouterr().out


def test_status_is_shown_again_until_it_is_interrupted(url, service, capsys, monkeypatch):
    looks = []

    def sleep(_: float) -> None:
        looks.append(service.ready)
        service.ready = False
        if len(looks) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr("grazemap.cli.status.time.sleep", sleep)
    assert cli.main(["status", "--watch", "--url", url]) == 130
    assert looks == [True, False]
    written = capsys.readouterr().out
    assert written.index("state     ready") < written.index("state     not ready")


def test_status_without_a_service_gives_1(monkeypatch, capsys):
    monkeypatch.setattr(constants, "BACKOFF_START", 0.001)
    assert cli.main(["status", "--url", "http://127.0.0.1:9"]) == 1
    said = capsys.readouterr().err
    assert "no answer from the service at http://127.0.0.1:9: " in said
    assert "grazemap up" in said


def test_a_bad_address_gives_2(capsys):
    assert cli.main(["status", "--url", "localhost"]) == 2
    assert "http://" in capsys.readouterr().err
    assert cli.main(["status", "--url", "http://127.0.0.1:abc"]) == 2
    assert "base_url must" in capsys.readouterr().err


def test_a_key_that_cannot_be_sent_gives_2(monkeypatch, capsys):
    monkeypatch.setenv("GRAZEMAP_API_KEY", "k\u00e9y")
    assert cli.main(["status", "--url", "http://127.0.0.1:9"]) == 2
    assert "api_key must" in capsys.readouterr().err


def test_plot_draws_beside_the_result(tmp_path, capsys):
    result = tmp_path / "map.npz"
    result.write_bytes(npz("unfolding-maps"))
    assert cli.main(["plot", str(result)]) == 0
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    assert cli.main(["plot", str(result), "-o", str(tmp_path / "map.csv")]) == 2
    assert cli.main(["plot", str(tmp_path / "none.npz")]) == 1


def test_plot_draws_the_curve_of_one_stop_over_a_map(tmp_path):
    saved = {name: tmp_path / f"{name.split()[0]}.npz" for name in ("unfolding-maps", ONE_STOP)}
    for name, path in saved.items():
        path.write_bytes(npz(name))
    umap, curve = saved.values()
    picture = tmp_path / "over.svg"
    assert cli.main(["plot", str(umap), "-o", str(picture), "--over", str(curve)]) == 0
    assert picture.exists()


def test_plot_draws_curves_and_points_over_a_map(tmp_path, capsys):
    saved = {}
    for process in ("unfolding-maps", "grazing-curves", "codimension-two-points", "bifurcation-curves", "basins"):
        saved[process] = tmp_path / f"{process}.npz"
        saved[process].write_bytes(npz(process))
    picture, plain = tmp_path / "over.svg", tmp_path / "plain.svg"
    over = [word for name in list(saved)[1:4] for word in ("--over", str(saved[name]))]
    assert cli.main(["plot", str(saved["unfolding-maps"]), "-o", str(picture), *over]) == 0
    assert cli.main(["plot", str(saved["unfolding-maps"]), "-o", str(plain)]) == 0
    assert picture.read_text().count("<path") > plain.read_text().count("<path")
    assert cli.main(["plot", str(saved["unfolding-maps"]), "--over", str(saved["basins"])]) == 2
    assert "allowed: grazing-curves" in capsys.readouterr().err
    assert cli.main(["plot", str(saved["basins"]), *over]) == 2
    assert "over an unfolding map" in capsys.readouterr().err


def test_plot_of_something_else_gives_1(tmp_path, capsys):
    path = tmp_path / "text.npz"
    path.write_text("hello")
    assert cli.main(["plot", str(path)]) == 1
    said = capsys.readouterr().err
    assert "not a grazemap result" in said
    assert str(path) in said


def test_a_file_that_cannot_be_read_or_written_is_named_with_its_option(tmp_path, capsys):
    missing = tmp_path / "none.json"
    run = ["run", "trajectories", "--json", str(missing), "-o", str(tmp_path / "t.npz"), "--url", "http://x"]
    assert cli.main(run) == 1
    assert capsys.readouterr().err == f"grazemap: the request (--json) {missing}: No such file or directory\n"
    assert cli.main(["plot", str(missing)]) == 1
    assert capsys.readouterr().err == f"grazemap: the result {missing}: No such file or directory\n"
    result = tmp_path / "map.npz"
    result.write_bytes(npz("unfolding-maps"))
    nowhere = tmp_path / "none" / "map.png"
    assert cli.main(["plot", str(result), "-o", str(nowhere)]) == 1
    assert capsys.readouterr().err == f"grazemap: the picture {nowhere}: No such file or directory\n"


def test_help_names_every_kind_of_file(capsys):
    with pytest.raises(SystemExit):
        cli.main(["run", "trajectories", "--help"])
    written = capsys.readouterr().out
    for ending in (".npz", ".json", ".png", ".svg", ".pdf"):
        assert ending in written


@pytest.mark.parametrize("process", ["periodic-orbits", "orbit-branches"])
def test_an_orbit_that_was_not_found_is_written_reported_and_has_its_own_exit_code(
    url, tmp_path, monkeypatch, capsys, process
):
    request, output = tmp_path / "request.json", tmp_path / "orbit.npz"
    request.write_text(json.dumps(REQUESTS[process]))
    arguments = ["run", process, "--json", str(request), "-o", str(output), "--url", url, "--quiet"]
    assert cli.main(arguments) == 0
    assert capsys.readouterr().err == ""
    document, meta = decode_npz(npz(process))
    nothing = {"converged": False} if process == "periodic-orbits" else {"parameter": np.empty(0)}
    lost = encode_npz({**document, **nothing, "reason": "it is too far away"}, meta)
    monkeypatch.setattr("tests.support.sdk_fake_service.npz", lambda name: lost)
    request.write_text(json.dumps({**REQUESTS[process], "max_period": 7}))
    output.unlink()
    assert cli.main(arguments) == 3
    assert capsys.readouterr().err == "grazemap: no periodic orbit was found: it is too far away\n"
    assert grazemap.load(output).reason == "it is too far away"


def test_a_saved_result_says_what_it_is(tmp_path, capsys):
    path = tmp_path / "map.npz"
    document, meta = decode_npz(npz("unfolding-maps"))
    path.write_bytes(encode_npz(document, meta | {"notes": [{"code": "x", "detail": "a note"}]}))
    assert cli.main(["show", str(path)]) == 0
    said = capsys.readouterr().out
    assert said.startswith("UnfoldingMap: 2 x 3 points")
    assert json.dumps(grazemap.load(path).meta["request"]) in said
    assert "note      a note" in said
    assert "table     motions" in said
    rows = said.splitlines()[said.splitlines().index("table     motions") + 1 :]
    assert rows[0].split()[:3] == ["label", "kind", "period"]
    assert rows[1].split()[1:4] == ["1-2r-2l", "periodic", "1"]
    assert cli.main(["show", str(tmp_path / "none.npz")]) == 1


def test_tables_are_printed_without_pandas_and_say_how_many_rows_are_left_out(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pandas", None)
    path = tmp_path / "path.npz"
    document, meta = decode_npz(npz("trajectories"))
    samples = {name: np.zeros((len(document[name]), 70)) for name in ("displacement", "velocity")}
    path.write_bytes(encode_npz({**document, **samples, "time": np.arange(70) / 3.0}, meta))
    assert cli.main(["show", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    samples, rests = lines.index("table     time"), lines.index("table     sticking")
    assert lines[samples + 1].split()[:2] == ["time", "displacement_1"]
    assert [line.split()[:2] for line in lines[samples + 2 : samples + 5]] == [
        ["0", "0"],
        ["1", "0.333333"],
        ["2", "0.666667"],
    ]
    assert lines[samples + 10] == "62 more rows"
    assert lines[rests + 1] == "no rows"


def test_columns_beyond_the_width_stand_below():
    table = {name: Column([1.5, 2.5]) for name in ("first", "second", "third")}
    above, below = ["   first  second", "0    1.5     1.5", "1    2.5     2.5"], ["   third", "0    1.5", "1    2.5"]
    assert text(table, 8, 18) == [*above, *below]


def test_the_schema_of_a_request_is_printed(capsys):
    assert cli.main(["schema", "unfolding-maps"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert {"omega", "clearance", "policy"} <= schema["properties"].keys()


def test_a_service_on_this_machine_is_used(url, service, request_file, tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("GRAZEMAP_URL", raising=False)
    monkeypatch.setattr(constants, "DEFAULT_BASE_URL", url)
    output = tmp_path / "map.npz"
    assert cli.main(["run", "unfolding-maps", "--json", request_file, "-o", str(output)]) == 0
    assert f"grazemap: using the service at {url}" in capsys.readouterr().err
    assert service.computed == 1


def test_a_client_takes_address_and_key_from_the_environment(monkeypatch):
    monkeypatch.setenv("GRAZEMAP_URL", "http://elsewhere:1")
    monkeypatch.setenv("GRAZEMAP_API_KEY", "secret")
    client = grazemap.Client()
    assert client.base_url == "http://elsewhere:1"
    assert client._connection.settings.api_key == "secret"
    assert grazemap.Client("http://here:2", api_key="").base_url == "http://here:2"


def test_a_reader_that_has_enough_ends_a_command_without_an_error():
    command = f"{sys.executable} -m grazemap.cli schema trajectories | head -1"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("{\n", "")
