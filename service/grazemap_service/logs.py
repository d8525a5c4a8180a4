"""Structured logs: one JSON object a line on stderr, each with the request id and, where there is one, the job id.

`configure` is called once by the process's entry point; the library code only asks for `get_logger`.
"""

from __future__ import annotations

import logging
import sys

import structlog

JOB_ID = "job_id"
REQUEST_ID = "request_id"


def configure(level: str) -> None:
    """Send the service's and the server's own log records to stderr as JSON lines.

    Parameters
    ----------
    level : str
        DEBUG, INFO, WARNING, ERROR or CRITICAL.
    """
    shared: list[structlog.typing.Processor] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
        structlog.processors.format_exc_info,
    ]
    structlog.configure(
        processors=[*shared, structlog.stdlib.ProcessorFormatter.wrap_for_formatter],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=True,
    )
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=shared,
            processors=[
                structlog.stdlib.ProcessorFormatter.remove_processors_meta,
                structlog.processors.JSONRenderer(),
            ],
        )
    )
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level)


def get_logger() -> structlog.stdlib.BoundLogger:
    """Return the service's logger."""
    logger: structlog.stdlib.BoundLogger = structlog.get_logger("grazemap_service")
    return logger


def bind_job(job_id: str) -> None:
    """Put a job's id into every further log line of this request."""
    structlog.contextvars.bind_contextvars(**{JOB_ID: job_id})
