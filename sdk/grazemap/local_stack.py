"""`local()`: a private stack on this machine, for the duration of a block.

The client is imported while the stack starts.
"""

from __future__ import annotations

import atexit
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from importlib import import_module
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from grazemap import constants, running_stacks, streams
from grazemap.errors import GrazemapError, StackError
from grazemap.server_command import stack_command
from grazemap.start_display import StartDisplay, ready_line, start_display

if TYPE_CHECKING:
    from grazemap.local_client import LocalClient

_LOG_LINES_SHOWN = 20
# Seconds that a stack of another process has to answer.
_JOIN_TIMEOUT = 2.0


def local(data: str | os.PathLike[str] | None = None, workers: int | None = None) -> LocalClient:
    """Return a client of a stack of this user that runs already, or else start one on a free loopback port.

    Without arguments, a stack of the same version, installation and settings is joined, whether `grazemap up` or
    another process has started it; a line says so. It lives as long as a process uses it. GRAZEMAP_LOCAL=own, or an
    argument, forbids that.

    The first start on a machine begins to compile the kernels; a job waits until the kernels that it needs are ready.
    On a terminal, or below a notebook's cell, a line says what the start waits for, and is removed when the stack is
    ready. Elsewhere a start of more than a few seconds writes some lines to stderr.

    Environment variables about access and address (GRAZEMAP_API_KEYS, GRAZEMAP_API_KEYS_FILE, GRAZEMAP_ALLOWED_HOSTS,
    GRAZEMAP_CORS_ORIGINS, GRAZEMAP_HOST, GRAZEMAP_PORT, GRAZEMAP_FD) do not apply; limits and GRAZEMAP_REDIS_URL do.

    Parameters
    ----------
    data : path, optional
        Folder in which jobs and results are kept. Default: a temporary folder, which is removed with all of them when
        the stack ends.
    workers : int, optional
        Number of worker processes. Default: one for each processor.

    Returns
    -------
    LocalClient
        Use it in a `with` block, or close it, to stop everything that was started, unless another process has joined
        it. The end of this process, even if it is killed, has the same effect.

    Raises
    ------
    MissingExtra
        The extra "server" is not installed.
    StackError
        The stack did not start; the message ends with its log's last lines.
    """
    stack = (joined_stack() if data is None and workers is None else None) or LocalStack(data, workers)
    from grazemap.local_client import LocalClient

    return LocalClient(stack)


class JoinedStack:
    """A stack of another process, which this process uses too.

    Attributes
    ----------
    url : str
        The address of its service.
    temporary : bool
        Whether its jobs and results are known to be removed when it ends.
    """

    temporary = False

    def __init__(self, membership: running_stacks.Membership) -> None:
        self.url, self._membership = membership.url, membership
        atexit.register(self.stop)

    def stop(self) -> None:
        """Leave the stack, which ends when its owner and all who joined it have left. Idempotent."""
        atexit.unregister(self.stop)
        self._membership.close()


def joined_stack(quiet: bool = False) -> JoinedStack | None:
    """Return a stack that runs already and answers; None if there is none, or GRAZEMAP_LOCAL=own forbids joining."""
    if os.environ.get("GRAZEMAP_LOCAL") == "own":
        return None
    for membership in running_stacks.memberships():
        from grazemap.client import Client

        with Client(membership.url, api_key="", timeout=_JOIN_TIMEOUT, retries=0) as probe:
            try:
                probe.status()
            except GrazemapError:
                membership.close()
                continue
        if not quiet:
            text = f"grazemap: using the stack at {membership.url} (GRAZEMAP_LOCAL=own starts another one)\n"
            streams.write(sys.stderr, text)
        return JoinedStack(membership)
    return None


class LocalStack:
    """The stack as a child process; the constructor returns when it is ready.

    Parameters
    ----------
    data, workers
        As for `local`.
    timeout : float
        Seconds after which a start has failed.
    quiet : bool
        Show nothing of the start.

    Attributes
    ----------
    url : str
        The address of its service.
    temporary : bool
        Whether its jobs and results are removed when it ends.
    """

    def __init__(
        self,
        data: str | os.PathLike[str] | None = None,
        workers: int | None = None,
        timeout: float = constants.LOCAL_START_TIMEOUT,
        quiet: bool = False,
    ) -> None:
        self.temporary = data is None
        options = ["--host", "127.0.0.1", "--port", "0", "--talk"]
        if data is not None or workers is not None:
            options.append("--unannounced")
        options += ["--die-with-parent", str(os.getpid())]
        if workers is not None:
            options += ["--workers", str(workers)]
        # without a folder the stack uses a temporary one, which it removes even if this process is killed
        if data is not None:
            options += ["--data", str(Path(data).expanduser())]
        command = stack_command(*options)
        # A file without a name disappears with this process, even if this process is killed.
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as the stack
        # In a session of its own, so that Ctrl-C in a notebook or a shell does not stop the stack.
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env=_environment(),
            start_new_session=True,
        )
        self._announcement: Path | None = None
        atexit.register(self.stop)
        try:
            import_module("grazemap.local_client")  # takes half a second, in which the stack starts
            self.url = self._await_ready(timeout, start_display(quiet))
        except BaseException:
            self.stop()
            raise

    def _await_ready(self, timeout: float, display: StartDisplay) -> str:
        """Return the address from the one line of JSON that the stack prints when it is ready."""
        assert self._process.stdout is not None
        lines: queue.Queue[bytes] = queue.Queue()
        line = b""
        threading.Thread(target=_put_ready_line, args=(self._process.stdout, lines, display), daemon=True).start()
        try:
            line = lines.get(timeout=timeout)
        except queue.Empty:
            raise StackError(f"the stack was not ready after {timeout:.0f} s{self._log_tail()}") from None
        finally:
            display.close(ready=bool(line))
        try:
            if not line:
                code = self._process.wait(constants.LOCAL_STOP_TIMEOUT)
                raise StackError(f"the stack ended with exit code {code} before it was ready{self._log_tail()}")
            ready: Any = json.loads(line)
            url = str(ready["url"])
            self._announcement = Path(ready["announcement"]) if ready.get("announcement") else None
            return url
        except (ValueError, KeyError, TypeError, subprocess.TimeoutExpired) as error:
            raise StackError(f"the stack did not print its address{self._log_tail()}") from error

    def _log_tail(self) -> str:
        self._log.seek(0)
        lines = self._log.read().decode(errors="replace").splitlines()[-_LOG_LINES_SHOWN:]
        return "\n" + "\n".join(lines) if lines else ""

    def stop(self) -> None:
        """Stop the stack, or have it end after the processes that have joined it; it removes its temporary data.

        Idempotent.
        """
        atexit.unregister(self.stop)
        if self._process.poll() is None and self._announcement and not running_stacks.withdraw(self._announcement):
            self._process.send_signal(signal.SIGUSR1)
        elif self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(constants.LOCAL_STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._log.close()


def _environment() -> dict[str, str]:
    """Return this process's environment without the settings of a public service."""
    # Compared in upper case, as the case of the service's settings does not matter.
    return {name: value for name, value in os.environ.items() if name.upper() not in running_stacks.OF_SERVICE}


def _put_ready_line(stream: IO[bytes], lines: queue.Queue[bytes], display: StartDisplay) -> None:
    """Put the line with the address into the queue, or b"" if the stream ends before it."""
    lines.put(ready_line(stream, display))
