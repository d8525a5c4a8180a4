"""The command line: output files, exit codes, and messages on stderr."""

import io
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import grazemap
from grazemap import cli, constants
from grazemap.cli import up_command
from grazemap.client import Client
from grazemap.codec import decode_npz, encode_npz
from grazemap.errors import ConnectionFailed
from grazemap.results.diagrams import QUANTITIES
from grazemap.results.tables import Column, text
from grazemap.wire import parse_request
from tests.support.sdk_documents import ONE_STOP, REQUESTS, npz


@pytest.fixture
def run(url, tmp_path, capsys):
    """Gives `run(body, output, process)`: the exit code of `grazemap run`, what it printed, and its errors."""

    def ran(body=REQUESTS["unfolding-maps"], output="map.npz", process="unfolding-maps"):
        source = tmp_path / "request.json"
        source.write_bytes(body if isinstance(body, bytes) else json.dumps(body).encode())
        code = cli.main(["run", process, "--json", str(source), "-o", str(tmp_path / output), "--url", url])
        return code, *capsys.readouterr()

    return ran


@pytest.mark.parametrize("name", ["map.npz", "map.json", "map.png", "map.svg"])
def test_run_writes_the_format_of_the_file_ending(run, tmp_path, name):
    output = tmp_path / name
    assert run(output=name) == (0, f"{output}\n", "")  # no terminal, so no progress
    assert output.stat().st_size > 500
    if output.suffix in (".npz", ".json"):
        assert grazemap.load(output).kind.shape == (2, 3)


UNREADABLE = [b'{"omega": 1', b'{"omega": "\xff"}', b'{"omega":' + b"[" * 100_000, b"1" * 5000]


def test_run_reads_standard_input_and_the_environment(url, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("GRAZEMAP_URL", url)
    for body in (json.dumps(REQUESTS["grazing-curves"]).encode(), *UNREADABLE):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(body), encoding="utf-8"))
        command = ["run", "grazing-curves", "--json", "-", "-o", str(tmp_path / "c.npz"), "--quiet"]
        assert cli.main(command) == (2 if body in UNREADABLE else 0)
        assert ("the request is not JSON" in capsys.readouterr().err) is (body in UNREADABLE)


@pytest.mark.parametrize(
    ("body", "output", "text"),
    [
        *((body, "c.npz", "the request is not JSON") for body in UNREADABLE),
        ({"omega": {"start": 2, "stop": 1, "points": 5}}, "c.npz", "/omega"),
        ([1], "c.npz", "not a JSON object"),
        (REQUESTS["grazing-curves"], "c.txt", "must end in"),
        (REQUESTS["grazing-curves"], "none/map.npz", "the output"),
        (REQUESTS["grazing-curves"], "file/map.npz", "the output"),
        (REQUESTS["grazing-curves"], "folder.npz", "the output"),
    ],
)
def test_a_wrong_request_or_output_gives_2_and_sends_nothing(run, service, tmp_path, body, output, text):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder.npz").mkdir()
    code, _, errors = run(body, output, "grazing-curves")
    assert code == 2
    assert text in errors
    assert service.requests == []


def test_a_picture_without_matplotlib_is_reported_before_anything_is_sent(run, service, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    code, _, errors = run(output="map.png")
    assert code == 1
    assert "grazemap[plot]" in errors
    assert service.requests == []


def test_a_failed_job_gives_1_with_its_reason(run, service, tmp_path):
    service.ending = "failed"
    code, _, errors = run()
    assert code == 1
    assert "tile 3" in errors
    assert not (tmp_path / "map.npz").exists()


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
    monkeypatch.setattr(up_command, "stack_command", lambda *options: [sys.executable, "-c", told, *options])


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

    monkeypatch.setattr("grazemap.cli.status_command.time.sleep", sleep)
    assert cli.main(["status", "--watch", "--url", url]) == 130
    assert looks == [True, False]
    written = capsys.readouterr().out
    assert written.index("state     ready") < written.index("state     not ready")


def test_a_failure_is_not_among_the_lines_of_json_of_a_service_that_is_watched(url, service, capsys, monkeypatch):
    looks = []

    def sleep(_: float) -> None:
        looks.append(1)
        monkeypatch.setattr(Client, "status", unreachable)
        if len(looks) == 2:
            raise KeyboardInterrupt

    def unreachable(_: Client) -> None:
        raise ConnectionFailed("gone")

    monkeypatch.setattr("grazemap.cli.status_command.time.sleep", sleep)
    assert cli.main(["status", "--watch", "--json", "--url", url]) == 130
    written, told = capsys.readouterr()
    assert [json.loads(line)["ready"] for line in written.splitlines()] == [True]
    assert told


def test_status_without_a_service_gives_1(monkeypatch, capsys):
    monkeypatch.setattr(constants, "BACKOFF_START", 0.001)
    assert cli.main(["status", "--url", "http://127.0.0.1:9"]) == 1
    message = capsys.readouterr().err
    assert "no answer from the service at http://127.0.0.1:9: " in message
    assert "grazemap up" in message


@pytest.fixture
def assembly(monkeypatch):
    """Gives `assembly(process, **fields)`: what the tiles of any folder are joined to."""

    def made(process, fields=None, units="nondimensional"):
        request = parse_request(process, REQUESTS[process])

        def planned(_, folder):
            folder.mkdir(exist_ok=True)
            return SimpleNamespace(has_tiles=False, plan=SimpleNamespace(estimate=SimpleNamespace(seconds=1.0)))

        data = npz(process, fields or {}, units=units)
        direct = SimpleNamespace(planned=planned, assembled=lambda *_: (request, data))
        monkeypatch.setattr("grazemap.cli.tile_commands.worker_module", lambda _: direct)

    return made


def test_an_assembled_result_has_the_units_that_were_written_for_its_plan(assembly, tmp_path, capsys):
    assembly("grazing-curves", units="SI")
    folder, table = tmp_path / "sweep", tmp_path / "curve.csv"
    machine = ["--units", "SI", "--masses", "0.5", "--stiffnesses", "2000", "--damping", "1.5", "--forcing", "5"]
    for omega, heads in (("8Hz:14Hz:4", "omega (Hz),clearance (mm)"), ("50:88:4", "omega (rad/s),clearance (m)")):
        assert cli.main(["plan", "grazing-curves", *machine, "--omega", omega, "-o", str(folder)]) == 0
        assert cli.main(["assemble", str(folder), "-o", str(table), "--quiet"]) == 0
        assert table.read_text().startswith(heads)
    (folder / "shown_units.json").write_text("{}")
    assert cli.main(["assemble", str(folder), "-o", str(table), "--quiet"]) == 2


def test_a_folder_without_units_is_assembled_and_an_orbit_that_was_not_found_has_its_exit_code(assembly, tmp_path):
    assembly("periodic-orbits", {"converged": False, "reason": "it is too far away"})
    assert cli.main(["assemble", str(tmp_path), "-o", str(tmp_path / "orbit.npz"), "--quiet"]) == 3
    assert (tmp_path / "orbit.npz").exists()


@pytest.mark.parametrize("flags", [["--omega", "0.2:0.3:5"], ["--omega", "0.2:0.3:5", "--url", "http://127.0.0.1:9"]])
def test_a_key_that_no_service_takes_is_an_invalid_command(monkeypatch, capsys, flags):
    monkeypatch.setenv("GRAZEMAP_API_KEY", "a b")
    assert cli.main(["grazing-curves", *flags]) == 2
    assert "api_key" in capsys.readouterr().err


def test_a_table_of_a_process_without_tables_is_refused_before_it_is_computed(tmp_path, capsys):
    body = tmp_path / "proof.json"
    body.write_text(json.dumps(REQUESTS["proofs"]))
    nowhere = ["--json", str(body), "--url", "http://127.0.0.1:9"]
    assert cli.main(["proofs", *nowhere, "-o", str(tmp_path / "proof.csv")]) == 2


@pytest.mark.parametrize(
    ("address", "key", "told"),
    [
        ("localhost", "", "http://"),
        ("http://127.0.0.1:abc", "", "base_url must"),
        ("http://127.0.0.1:9", "k\u00e9y", "api_key must"),
    ],
)
def test_a_bad_address_or_key_gives_2(monkeypatch, capsys, address, key, told):
    monkeypatch.setenv("GRAZEMAP_API_KEY", key)
    assert cli.main(["status", "--url", address]) == 2
    assert told in capsys.readouterr().err


def test_plot_draws_beside_the_result(tmp_path, capsys):
    result = tmp_path / "map.npz"
    result.write_bytes(npz("unfolding-maps"))
    assert cli.main(["plot", str(result)]) == 0
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    assert cli.main(["plot", str(result), "-o", str(tmp_path / "map.csv")]) == 2


def test_plot_draws_curves_and_points_over_a_map(tmp_path, capsys):
    over = ["grazing-curves", "codimension-two-points", "bifurcation-curves"]
    saved = {name: str(tmp_path / f"{name}.npz") for name in ["unfolding-maps", *over, "basins", ONE_STOP]}
    for name, path in saved.items():
        Path(path).write_bytes(npz(name))

    def drawn(name, *names):
        picture = tmp_path / "picture.svg"
        laid = [word for other in names for word in ("--over", saved[other])]
        code = cli.main(["plot", saved[name], "-o", str(picture), *laid])
        return code, picture.read_text().count("<path") if code == 0 else capsys.readouterr().err

    _, plain = drawn("unfolding-maps")
    for names in (over, [ONE_STOP]):
        code, paths = drawn("unfolding-maps", *names)
        assert (code, paths > plain) == (0, True)
    assert drawn("unfolding-maps", "basins")[0] == drawn("basins", *over)[0] == 2
    assert "allowed: grazing-curves" in drawn("unfolding-maps", "basins")[1]


def test_a_quantity_that_a_result_lacks_is_refused_with_those_it_has(tmp_path, capsys):
    path = tmp_path / "diagram.npz"
    path.write_bytes(npz("bifurcation-diagrams"))
    assert cli.main(["plot", str(path), "--quantity", "foo"]) == 2
    told = capsys.readouterr().err
    assert all(name in told for name in QUANTITIES)


def test_plot_of_something_else_gives_1(tmp_path, capsys):
    path = tmp_path / "text.npz"
    path.write_text("hello")
    assert cli.main(["plot", str(path)]) == 1
    message = capsys.readouterr().err
    assert "not a grazemap result" in message
    assert str(path) in message


def test_a_file_that_cannot_be_read_or_written_is_named_with_its_option(tmp_path, capsys):
    missing, result, nowhere = tmp_path / "none.json", tmp_path / "map.npz", tmp_path / "none" / "map.png"
    result.write_bytes(npz("unfolding-maps"))
    for command, told in (
        (
            ["run", "trajectories", "--json", missing, "-o", tmp_path / "t.npz", "--url", "http://x"],
            f"(--json) {missing}",
        ),
        (["plot", missing], f"the result {missing}"),
        (["show", missing], f"the result {missing}"),
        (["plot", result, "-o", nowhere], f"the picture {nowhere}"),
    ):
        assert cli.main([str(word) for word in command]) == 1
        assert f"{told}: No such file" in capsys.readouterr().err


@pytest.mark.parametrize("process", ["periodic-orbits", "orbit-branches"])
def test_an_orbit_that_was_not_found_is_written_reported_and_has_its_own_exit_code(run, tmp_path, monkeypatch, process):
    assert run(REQUESTS[process], "orbit.npz", process)[::2] == (0, "")
    nothing = {"converged": False} if process == "periodic-orbits" else {"parameter": np.empty(0)}
    lost = npz(process, {**nothing, "reason": "it is too far away"})
    monkeypatch.setattr("tests.support.sdk_fake_service.npz", lambda *_, **__: lost)
    code, _, errors = run({**REQUESTS[process], "max_period": 7}, "lost.npz", process)
    assert (code, errors) == (3, "grazemap: no periodic orbit was found: it is too far away\n")
    assert grazemap.load(tmp_path / "lost.npz").reason == "it is too far away"


def test_a_saved_result_says_what_it_is(tmp_path, capsys):
    path = tmp_path / "map.npz"
    document, meta = decode_npz(npz("unfolding-maps"))
    path.write_bytes(encode_npz(document, meta | {"notes": [{"code": "x", "detail": "a note"}]}))
    assert cli.main(["show", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("UnfoldingMap: 2 x 3 points")
    assert json.dumps(grazemap.load(path).meta["request"]) in "\n".join(lines)
    assert "note      a note" in lines
    rows = lines[lines.index("table     motions") + 1 :]
    assert rows[0].split()[:3] == ["label", "kind", "period"]
    assert rows[1].split()[1:4] == ["1-2r-2l", "periodic", "1"]


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


@pytest.mark.parametrize("name", ["unfolding-maps", "unfolding_maps"])
def test_the_schema_of_a_request_is_printed(capsys, name):
    assert cli.main(["schema", name]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema["title"] == "UnfoldingMapsRequest"
    assert {"omega", "clearance", "policy"} <= schema["properties"].keys()


def test_a_service_on_this_machine_is_used(url, service, tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("GRAZEMAP_URL", raising=False)
    monkeypatch.setattr(constants, "DEFAULT_BASE_URL", url)
    assert cli.main(["grazing-curves", "--omega", "0.2:0.4:5", "-o", str(tmp_path / "curve.npz")]) == 0
    assert f"grazemap: using the service at {url}" in capsys.readouterr().err
    assert service.computed == 1


def test_a_client_takes_address_and_key_from_the_environment(monkeypatch):
    monkeypatch.setenv("GRAZEMAP_URL", "http://elsewhere:1")
    monkeypatch.setenv("GRAZEMAP_API_KEY", "secret")
    client = grazemap.Client()
    assert client.base_url == "http://elsewhere:1"
    assert client._connection.settings.api_key == "secret"
    assert grazemap.Client("http://here:2", api_key="").base_url == "http://here:2"


def without_reader(stream: str, *arguments: str) -> subprocess.CompletedProcess:
    """Run a command, of whose stdout or stderr the reader is gone."""
    reader, writer = os.pipe()
    os.close(reader)
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, stream: writer}
    done = subprocess.run([sys.executable, "-m", "grazemap.cli", *arguments], **streams, text=True, check=False)
    os.close(writer)
    return done


@pytest.mark.parametrize("arguments", [["schema", "trajectories"], ["--help"], ["show", "FILE"]])
def test_a_command_that_prints_ends_well_without_a_reader(tmp_path, arguments):
    path = tmp_path / "result.npz"
    path.write_bytes(npz("grazing-curves"))
    done = without_reader("stdout", *(str(path) if word == "FILE" else word for word in arguments))
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_result_is_written_whether_or_not_anybody_reads_notes_and_names_of_files(url, tmp_path, stream):
    """The window is above the grazing curve, which is a note."""
    output = tmp_path / "map.npz"
    window = ["--omega", "0.26:0.30:8", "--clearance", "9:10:8"]
    done = without_reader(stream, "unfolding-maps", *window, "-o", str(output), "--url", url)
    assert done.returncode == 0
    assert output.exists()


def test_all_tiles_are_computed_also_without_a_reader_of_their_names(monkeypatch, tmp_path):
    computed: list[int] = []

    def tiles(*_):
        for index in range(5):
            computed.append(index)
            yield index, False

    monkeypatch.setattr("grazemap.cli.tile_commands.worker_module", lambda _: SimpleNamespace(compute_tiles=tiles))
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as stream:
        monkeypatch.setattr("sys.stdout", stream)
        assert cli.main(["tile", str(tmp_path), "0", "--of", "1"]) == 0
    assert computed == [0, 1, 2, 3, 4]


def test_an_error_that_nobody_reads_keeps_its_exit_code(tmp_path):
    assert without_reader("stderr", "show", str(tmp_path / "absent.npz")).returncode == 1


def test_a_pipe_that_breaks_elsewhere_is_a_failure(tmp_path, monkeypatch, capsys):
    def broken(*_: object) -> None:
        raise BrokenPipeError(32, "Broken pipe")

    path = tmp_path / "result.npz"
    path.write_bytes(npz("grazing-curves"))
    monkeypatch.setattr("grazemap.cli.result_commands.describe", broken)
    assert cli.main(["show", str(path)]) == 1
    assert capsys.readouterr().err


def test_a_reader_that_has_enough_ends_a_command_without_an_error():
    command = f"{shlex.quote(sys.executable)} -m grazemap.cli schema trajectories | head -1"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("{\n", "")
