"""`python -m grazemap_worker`: the workers of this machine, on the Redis that GRAZEMAP_REDIS_URL names."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import NoReturn

from grazemap_worker.environment import one_thread


def main(arguments: Sequence[str] | None = None) -> None:
    """Supervise the workers until SIGTERM or SIGINT, and compile their kernels."""
    parser = argparse.ArgumentParser(prog="python -m grazemap_worker", description=__doc__)
    parser.add_argument("--workers", type=int, help="worker processes (default: GRAZEMAP_WORKERS, or one per core)")
    parser.add_argument("--redis-url", help="default: GRAZEMAP_REDIS_URL")
    options = {name: value for name, value in vars(parser.parse_args(arguments)).items() if value is not None}

    one_thread()
    import structlog
    from pydantic import ValidationError

    from grazemap_worker import logs
    from grazemap_worker.redis_settings import refusal_text, unknown_variables
    from grazemap_worker.settings import WorkerSettings
    from grazemap_worker.supervision import kernel_cache

    try:
        settings = WorkerSettings(**options)
        logs.configure(settings.log_level)
        for unknown in unknown_variables(os.environ, WorkerSettings, near=True):
            structlog.get_logger("grazemap_worker").warning(unknown)
        # before numba is imported
        os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache.private_folder(settings.cache_dir))
    except ValidationError as error:
        _refuse(refusal_text(error))
    except RuntimeError as error:  # CacheFolderError, or the home is not known
        _refuse(str(error))

    from redis.exceptions import RedisError

    from grazemap_worker.store import Store
    from grazemap_worker.watchdog import beating, repeated

    workers = Store(settings.connect()).workers

    def report_loading() -> None:
        with suppress(RedisError):
            workers.set_starting("loading the kernels")

    # SIGTERM ends the loading with status 0; the supervisor installs its own handler.
    signal.signal(signal.SIGTERM, lambda _number, _frame: sys.exit(0))
    with beating(), repeated(report_loading, 1.0):
        from grazemap_core import kernel_folder
        from grazemap_worker.supervision.kernels import Kernels

        mark = kernel_cache.mark_used(kernel_folder.folder())
        kernels = Kernels()
        kernels.advance()  # child processes compile what is missing, while this process loads what the workers need

        from grazemap_worker import tasks  # noqa: F401
        from grazemap_worker.numerics import numerics
        from grazemap_worker.queue import tile_worker  # noqa: F401
        from grazemap_worker.supervision.supervisor import Supervisor
    with mark:
        Supervisor(settings, numerics(), kernels).run()


def _refuse(reason: str) -> NoReturn:
    from grazemap_worker.redis_settings import USAGE_ERROR

    sys.stderr.write(f"grazemap_worker: {reason}\n")
    sys.exit(USAGE_ERROR)


if __name__ == "__main__":
    main()
