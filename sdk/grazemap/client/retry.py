"""One request and its answer, with the rules for trying again and for raising typed exceptions.

Everything the client sends may be sent twice: reads change nothing, DELETE is idempotent, and a POST's job is
named by its own question, so that the second one finds the first one's job and no work is done twice.
"""

from __future__ import annotations

import json
import random
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from grazemap import constants
from grazemap.client.io_effects import Flow, LinkBroken, Now, Reply, Send, Sleep
from grazemap.errors import ConnectionFailed, ProtocolError, ServiceProblem, problem_exception
from grazemap.wire import Problem

M = TypeVar("M", bound=BaseModel)


def exchange(request: Send, retries: int, deadline: float | None = None) -> Flow[Reply]:
    """Send a request until it is answered for good, and return an answer with a status below 400.

    Parameters
    ----------
    request : Send
    retries : int
        Attempts after the first one.
    deadline : float, optional
        Time of the flow's clock after which no further attempt starts.

    Raises
    ------
    ServiceProblem
        The service's problem, typed.
    ConnectionFailed
        No answer after all attempts.
    """
    attempt = 0
    while True:
        retry_after: float | None = None
        failure: ServiceProblem | ConnectionFailed
        try:
            reply: Reply = yield request
        except LinkBroken as broken:
            failure = ConnectionFailed(f"no answer from the service at {broken}")
            if not broken.retryable:
                raise failure from broken
        else:
            if reply.status < 400:
                return reply
            failure = problem_of(reply)
            retry_after = failure.retry_after
            if reply.status not in constants.RETRIED_STATUSES:
                raise failure
        if attempt >= retries or (retry_after or 0.0) > constants.RETRY_AFTER_LIMIT:
            raise failure
        seconds = pause(attempt) + (retry_after or 0.0)
        if deadline is not None and (yield Now()) + seconds >= deadline:
            raise failure
        yield Sleep(seconds)
        attempt += 1


def pause(attempt: int) -> float:
    """Return the seconds before the next attempt: exponential, with full jitter."""
    return random.uniform(0.0, min(constants.BACKOFF_LIMIT, constants.BACKOFF_START * 2**attempt))


def problem_of(reply: Reply) -> ServiceProblem:
    """Return the exception for an answer with a status of 400 or more, whoever sent it."""
    try:
        problem = Problem.model_validate_json(reply.content)
    except ValidationError:
        problem = Problem(type="about:blank", title=f"HTTP status {reply.status}", status=reply.status)
    if problem.status != reply.status:  # the status line decides which exception it is
        problem = problem.model_copy(update={"status": reply.status})
    return problem_exception(problem, reply.headers.get("x-request-id"), _retry_after(reply))


def _retry_after(reply: Reply) -> float | None:
    text = reply.headers.get("retry-after", "").strip()
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


def read_model(model: type[M], reply: Reply) -> M:
    """Return an answer's body as a model. Raises ProtocolError."""
    try:
        return model.model_validate_json(reply.content)
    except ValidationError as error:
        raise ProtocolError(f"the answer is not a {model.__name__.lower()} of a grazemap service") from error


def read_object(reply: Reply) -> dict[str, Any]:
    """Return an answer's body as a JSON object. Raises ProtocolError."""
    try:
        value = json.loads(reply.content)
    except (ValueError, RecursionError) as error:
        raise ProtocolError("the answer is not JSON") from error
    if not isinstance(value, dict):
        raise ProtocolError("the answer is not a JSON object")
    return value
