"""Structured logs: one JSON object a line on stderr, each with the request id and, where there is one, the job id.

`configure`, the same as the workers', is called once by the process's entry point; the library code only asks for
`get_logger`.
"""

from __future__ import annotations

import structlog

from grazemap_worker.logs import configure

__all__ = ["JOB_ID", "REQUEST_ID", "bind_job", "configure", "get_logger"]

JOB_ID = "job_id"
REQUEST_ID = "request_id"


def get_logger() -> structlog.stdlib.BoundLogger:
    """Return the service's logger."""
    logger: structlog.stdlib.BoundLogger = structlog.get_logger("grazemap_service")
    return logger


def bind_job(job_id: str) -> None:
    """Put a job's id into every further log line of this request."""
    structlog.contextvars.bind_contextvars(**{JOB_ID: job_id})
