"""The command line: run a stack, show the state of one, run a process, draw a result.

Exit codes: 0 success; 1 failure of the service, the job or a file; 2 invalid command or request;
3 success, but no periodic orbit was found; 130 Ctrl-C.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from grazemap import constants
from grazemap.client import Client
from grazemap.errors import ConnectionFailed, GrazemapError, ParameterError, ProtocolError, RequestWarning
from grazemap.local_stack import local, stack_command
from grazemap.plots import save_picture
from grazemap.plots.axes import new_figure
from grazemap.results import OrbitBranch, PeriodicOrbit, load
from grazemap.results.tables import tables
from grazemap.starting import StartLine, ready_line
from grazemap.version import __version__
from grazemap.wire import PROCESSES

DONE, FAILED, INVALID, NOT_FOUND, INTERRUPTED = 0, 1, 2, 3, 130
_PICTURES = (".png", ".svg", ".pdf")
_RESULTS = (".npz", ".json")
# Seconds in which a service on this machine says that it is there.
_ANSWERS_WITHIN = 2.0
# Default address of `up`, as in the service's settings; environment variables override it.
_LISTENS = {"GRAZEMAP_HOST": "127.0.0.1", "GRAZEMAP_PORT": "8000"}


class _Invalid(Exception):
    """The command's arguments are not valid together."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", RequestWarning)
            warnings.showwarning = _print_warning
            code: int = options.command(options)
    except (_Invalid, ParameterError) as error:
        return _fail(error, INVALID)
    except ConnectionFailed as error:
        return _fail(f"{error}\nStart one with `grazemap up`, or give its address with --url.", FAILED)
    except (GrazemapError, OSError) as error:
        return _fail(error, FAILED)
    except KeyboardInterrupt:
        return INTERRUPTED
    return code


def _print_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"grazemap: note: {message}", file=sys.stderr)


def _fail(error: Exception | str, code: int) -> int:
    print(f"grazemap: {error}", file=sys.stderr)
    return code


@contextmanager
def _files(what: str, path: Path | str) -> Iterator[None]:
    """Add the name of a file to an OSError of the block."""
    try:
        yield
    except OSError as error:
        raise OSError(f"{what} {path}: {error.strerror or error}") from error


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="grazemap", description="Grazing bifurcations of impact oscillators.")
    parser.add_argument("--version", action="version", version=f"grazemap {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    address = f"address of a running service (default: GRAZEMAP_URL, else {constants.DEFAULT_BASE_URL})"

    up = commands.add_parser("up", help="run a service with its workers on this machine")
    host, port = (_setting(name, default) for name, default in _LISTENS.items())
    up.add_argument("--host", default=host, help="address to listen on; overrides GRAZEMAP_HOST (default: %(default)s)")
    # argparse checks a default that is text like an argument
    up.add_argument(
        "--port", type=_port, default=port, help="port, 0 any free one; overrides GRAZEMAP_PORT (default: %(default)s)"
    )
    up.add_argument(
        "--data", type=Path, help="folder for jobs and results (default: a temporary one, removed at the end)"
    )
    up.add_argument("--workers", type=_positive, help="worker processes (default: one per processor)")
    up.set_defaults(command=_up)

    status = commands.add_parser("status", help="show a running service and its jobs")
    status.add_argument("--url", help=address)
    status.set_defaults(command=_status)

    run = commands.add_parser("run", help="submit a request and write its result to a file")
    run.add_argument("process", choices=sorted(PROCESSES))
    run.add_argument("--json", required=True, metavar="FILE", help="the request as JSON; - reads standard input")
    run.add_argument(
        "-o",
        "--output",
        required=True,
        type=Path,
        metavar="FILE",
        help="file of the result: .npz, .json, .png, .svg or .pdf",
    )
    run.add_argument(
        "--url",
        help="address of a service (default: GRAZEMAP_URL, else one on this machine, else a temporary stack)",
    )
    run.add_argument("--quiet", action="store_true", help="no progress bar")
    run.set_defaults(command=_run)

    plot = commands.add_parser("plot", help="draw a saved result")
    plot.add_argument("result", type=Path, help="a .npz or .json file")
    plot.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: the result's name with .png")
    plot.set_defaults(command=_plot)

    show = commands.add_parser("show", help="say what a saved result is: its request, its notes, its tables")
    show.add_argument("result", type=Path, help="a .npz or .json file")
    show.set_defaults(command=_show)

    schema = commands.add_parser("schema", help="print the JSON schema of a process's request")
    schema.add_argument("process", choices=sorted(PROCESSES))
    schema.set_defaults(command=_schema)
    return parser


def _setting(name: str, default: str) -> str:
    # the case of names does not matter, as in the service's settings
    return next((value for key, value in os.environ.items() if key.upper() == name), default)


def _positive(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError("must be a whole number of at least 1")
    return int(text)


def _port(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError("this port, or GRAZEMAP_PORT, must be a whole number from 0 to 65535")
    return int(text)


def _client(url: str | None) -> Client:
    try:
        return Client(url)
    except ValueError as error:
        raise _Invalid(str(error)) from error


def _running_or_local(url: str | None, quiet: bool) -> Client:
    """Return a client of the service that is named, or that runs at the default address, or of a temporary stack."""
    if url or os.environ.get("GRAZEMAP_URL"):
        return _client(url)
    with Client(timeout=_ANSWERS_WITHIN, retries=0) as looking:
        try:
            found = "processes" in looking.describe()
        except GrazemapError:
            found = False
    if not found:
        return local()
    if not quiet:
        print(f"grazemap: using the service at {constants.DEFAULT_BASE_URL}", file=sys.stderr)
    return Client()


def _up(options: argparse.Namespace) -> int:
    shown = StartLine(sys.stderr)
    shown.show("starting")
    address = ("--host", options.host, "--port", str(options.port))
    command = stack_command(*address, "--talk", "--die-with-parent", str(os.getpid()))
    for name in ("data", "workers"):
        if getattr(options, name) is not None:
            command += [f"--{name}", str(getattr(options, name))]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as stack:
        try:
            assert stack.stdout is not None
            line = ready_line(stack.stdout, shown)
            shown.close()
            if line:
                print(_addresses(line), flush=True)
            code = stack.wait()
        except KeyboardInterrupt:
            # The terminal sends the signal to the stack too, which then stops by itself.
            stack.wait()
            return DONE
    return DONE if code == 0 else FAILED


def _addresses(line: bytes) -> str:
    try:
        url = json.loads(line)["url"]
    except (ValueError, KeyError, TypeError) as error:
        raise ProtocolError("the stack did not print its address") from error
    return f"explorer  {url}/\ndocs      {url}/docs\nmetrics   {url}/metrics\nCtrl-C stops it."


def _status(options: argparse.Namespace) -> int:
    with _client(options.url) as client:
        described = client.describe()
        jobs = client.jobs(limit=10)
    print(f"service   {client.base_url}")
    for name, value in described.items():
        if not isinstance(value, list | dict):
            print(f"{name:<9} {value}")
    for handle in jobs:
        progress = handle.progress
        print(f"job       {handle.id}  {handle.process:<22} {handle.status:<10} {progress.done}/{progress.total}")
    return DONE


def _run(options: argparse.Namespace) -> int:
    if options.output.suffix not in (*_RESULTS, *_PICTURES):
        raise _Invalid(f"the output must end in one of {', '.join((*_RESULTS, *_PICTURES))}")
    _check_output(options.output)
    request = _request(options.json)
    with closing(_running_or_local(options.url, options.quiet)) as client:
        handle = client.submit(options.process, request).wait(progress=not options.quiet)
        result = handle.result()
    with _files("the output (-o)", options.output):
        if options.output.suffix in _RESULTS:
            result.save(options.output)
        else:
            save_picture(result, options.output)
    print(options.output)
    if (isinstance(result, PeriodicOrbit) and not result.converged) or (
        isinstance(result, OrbitBranch) and result.parameter.size == 0
    ):
        return _fail(f"no periodic orbit was found: {result.reason}", NOT_FOUND)
    return DONE


def _check_output(path: Path) -> None:
    """Raise for an output that cannot be written, before the computation."""
    if path.is_dir():
        raise _Invalid(f"the output {path} is a folder")
    if not path.parent.is_dir():
        raise _Invalid(f"the output's folder {path.parent} does not exist")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise _Invalid(f"the output {path} cannot be written")
    if path.suffix in _PICTURES:
        new_figure(1.0, 1.0)


def _request(source: str) -> dict[str, Any]:
    try:
        with _files("the request (--json)", source):
            text = sys.stdin.read() if source == "-" else Path(source).read_text(encoding="utf-8")
        request = json.loads(text)
    except RecursionError:
        raise _Invalid("the request is not JSON that can be read: its values are nested too deeply") from None
    except ValueError as error:
        raise _Invalid(f"the request is not JSON: {error}") from error
    if not isinstance(request, dict):
        raise _Invalid("the request is not a JSON object")
    return request


def _plot(options: argparse.Namespace) -> int:
    output = options.output or options.result.with_suffix(".png")
    if output.suffix not in _PICTURES:
        raise _Invalid(f"the picture must end in one of {', '.join(_PICTURES)}")
    with _files("the result", options.result):
        result = load(options.result)
    with _files("the picture", output):
        save_picture(result, output)
    print(output)
    return DONE


def _show(options: argparse.Namespace) -> int:
    with _files("the result", options.result):
        result = load(options.result)
    print(repr(result)[1:-1])
    print(f"core      {result.meta.get('core_version', 'unknown')}")
    print(f"request   {json.dumps(result.meta['request'])}")
    for note in result.notes:
        print(f"note      {note.detail}")
    for name in tables(result):
        print(f"table     {name}")
    return DONE


def _schema(options: argparse.Namespace) -> int:
    print(json.dumps(PROCESSES[options.process].model_json_schema(), indent=2))
    return DONE


if __name__ == "__main__":
    sys.exit(main())
