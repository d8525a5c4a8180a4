"""HTTP for both clients: settings, headers, pauses between attempts, and the exceptions for answers."""

from __future__ import annotations

import ipaddress
import json
import math
import os
import random
import re
import secrets
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any

import httpx2
from pydantic import ValidationError

from grazemap import constants
from grazemap.client.cache import ResultCache
from grazemap.errors import ConnectionFailed, NotFound, ProtocolError, ServiceProblem, problem_exception
from grazemap.version import __version__
from grazemap.wire import Problem
from grazemap.wire.problems import make_problem

_ADDRESS = "base_url must look like http://host:port or https://host"
# The characters of a key in a header; an empty key counts as no key.
_HEADER_TEXT = re.compile(r"[!-~]*")
# Job ids become parts of addresses and of file names in the cache.
JOB_ID = re.compile(r"[0-9A-Za-z_-]{1,128}")
_GROUP = re.compile(r"[A-Za-z0-9._-]{1,64}")
# Identifies this process to a service without keys, which shares its workers fairly between clients.
_CLIENT_ID = secrets.token_hex(8)
UNKNOWN_JOB = make_problem("unknown-job", "There is no job with this id.")


class ConnectionSettings:
    """The arguments of a client's constructor; values that are not allowed raise ValueError."""

    def __init__(
        self,
        base_url: str,
        api_key: str | None,
        cache_dir: str | os.PathLike[str] | None,
        timeout: float,
        retries: int,
        group: str | None = None,
    ) -> None:
        try:
            parts = httpx2.URL(base_url)
            port_fits = parts.port is None or parts.port < 1 << 16
        except (httpx2.InvalidURL, TypeError, ValueError):
            raise ValueError(_ADDRESS) from None
        if parts.scheme not in ("http", "https") or not parts.host or not port_fits:
            raise ValueError(_ADDRESS)
        if "?" in base_url or "#" in base_url:  # the paths of requests are added at its end
            raise ValueError(_ADDRESS)
        if parts.userinfo:
            raise ValueError("base_url must not contain a user or a password; use api_key")
        if api_key is not None and not _HEADER_TEXT.fullmatch(api_key):
            raise ValueError("api_key must be printable ASCII without spaces")
        if not 0 < timeout < math.inf or retries < 0:  # NaN is refused too
            raise ValueError("timeout must be a number > 0 and retries >= 0")
        if group is not None and not _GROUP.fullmatch(group):
            raise ValueError("group must be 1 to 64 letters, digits, '.', '_' and '-'")
        self.group = group
        self.base_url, self.api_key = base_url.rstrip("/"), api_key
        self.cache = ResultCache(cache_dir) if cache_dir is not None else None
        self.timeout, self.retries = timeout, retries

    @property
    def http(self) -> dict[str, Any]:
        """The arguments of the clients of httpx2."""
        headers = {"user-agent": f"grazemap/{__version__}", "accept": "application/json", "grazemap-client": _CLIENT_ID}
        if self.group is not None:
            headers["grazemap-group"] = self.group
        if self.api_key:
            headers["authorization"] = f"Bearer {self.api_key}"
        return {
            "base_url": self.base_url,
            "headers": headers,
            "timeout": self.timeout,
            "trust_env": self._uses_environment,
        }

    @property
    def _uses_environment(self) -> bool:
        """Whether proxies of the environment are used: not for a loopback address or localhost."""
        host = httpx2.URL(self.base_url).host
        try:
            return not ipaddress.ip_address(host).is_loopback
        except ValueError:
            return host != "localhost"


def job_path(job_id: str) -> str:
    """Return a job's address below the base URL. Raises NotFound for an invalid id."""
    if not isinstance(job_id, str) or not JOB_ID.fullmatch(job_id):
        raise NotFound(UNKNOWN_JOB)
    return f"{constants.API_PREFIX}/jobs/{job_id}"


def pause(attempt: int) -> float:
    """Return the seconds before the next attempt: random, up to a limit that doubles to MAX_BACKOFF (full jitter)."""
    doublings = min(attempt, 64)  # a larger power need not fit into a float
    return random.uniform(0.0, min(constants.MAX_BACKOFF, constants.BACKOFF_START * 2**doublings))


def failure_of(error: httpx2.RequestError) -> ConnectionFailed:
    """Return the exception for a request without an answer. Raises ProtocolError for an answer that cannot be read."""
    if not isinstance(error, httpx2.TransportError):
        raise ProtocolError(f"the answer cannot be read: {error}") from error
    url = error.request.url
    reason = f"{url.scheme}://{url.netloc.decode('ascii')}: {error or type(error).__name__}"
    return ConnectionFailed(f"no answer from the service at {reason}")


def problem_of(response: httpx2.Response) -> ServiceProblem:
    """Return the exception for an answer with a status of 400 or more; the answer may come from a proxy."""
    try:
        problem = Problem.model_validate_json(response.content)
    except ValidationError:
        problem = Problem(type="about:blank", title=f"HTTP status {response.status_code}", status=response.status_code)
    if problem.status != response.status_code:  # the status line decides which exception it is
        problem = problem.model_copy(update={"status": response.status_code})
    return problem_exception(problem, response.headers.get("x-request-id"), _retry_after(response))


def _retry_after(response: httpx2.Response) -> float | None:
    text = response.headers.get("retry-after", "").strip()
    if not text:
        return None
    if text.isascii() and text.isdigit():
        return float(text)
    try:
        moment = parsedate_to_datetime(text)
    except ValueError:
        return None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return max(0.0, (moment - datetime.now(UTC)).total_seconds())


def json_object(content: str | bytes, name: str) -> dict[str, Any]:
    """Return a JSON object that the service sent. Raises ProtocolError, whose text has the name."""
    try:
        value = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ProtocolError(f"{name} is not JSON") from error
    if not isinstance(value, dict):
        raise ProtocolError(f"{name} is not a JSON object")
    return value
