"""Prints, for each process, the compiled functions and modules that a request needs and that its step does not have.

Run as `python -m tests.support.kernels_used`. For each step there is a process that has loaded nothing else, and for
each request of that step a process that is forked from it. Neither stores anything in the cache. Each prints a line of
JSON: the request, the step, and the entries that it loads or compiles and the modules that it imports.
"""

from __future__ import annotations

import json
import os
import sys
from collections import defaultdict
from collections.abc import Callable
from typing import Any

from grazemap.wire import parse_request
from grazemap_core import kernel_folder, warmup
from grazemap_worker.planning.kernel_steps import components_of
from grazemap_worker.processes import IMPLEMENTATIONS, kernels_of
from grazemap_worker.supervision.kernels import import_core
from tests.support.sdk_documents import REQUESTS

BORDERS = {
    "omega": {"start": 0.27, "stop": 0.3, "points": 6},
    "clearance": {"start": 1.4, "stop": 1.7, "points": 6},
    "borders": True,
}
# no two of its points share tables, and some are chaotic
APART = {
    "horizontal": {"vary": "omega", "values": {"start": 0.295, "stop": 0.305, "points": 4}},
    "vertical": {"vary": "damping", "values": {"start": 0.6, "stop": 0.9, "points": 4}},
    "clearance": 1.5,
}
MORE = {
    "unfolding-diagrams with borders": BORDERS,
    "unfolding-maps apart": APART,
    "unfolding-maps apart, observed": APART | {"observables": ["rms_displacement"]},
    "unfolding-diagrams apart": APART,
    "periodic-orbits that rest on a stop": {"omega": 0.29, "clearance": 0.1},
}


def compute(process: str, request: Any) -> None:
    """Compute a request as a worker would."""
    plan, computes = IMPLEMENTATIONS[process].plan(request), IMPLEMENTATIONS[process]
    tiles = [computes.tile(request, tile) for tile in plan.tiles] if computes.tile is not None else []
    if computes.assembled is not None:
        computes.assembled(request, plan, tiles, lambda done, total: None)
    elif computes.whole is not None:
        computes.whole(request, lambda done, total: None)


def forked(run: Callable[[], None]) -> None:
    """Run something in a process of its own."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        run()
        sys.stdout.flush()
        os._exit(0)
    if os.waitpid(child, 0)[1] != 0:
        sys.exit(1)


def main() -> None:
    requests = defaultdict(list)
    for name, body in [*REQUESTS.items(), *MORE.items()]:
        process = name.partition(" ")[0]
        request = parse_request(process, body)
        requests[kernels_of(process, request)].append((name, process, request))
    kernel_folder._Entries.save = lambda self, key, data: kernel_folder._used.add(self._entry(key).name)  # type: ignore[method-assign]
    for step, those in requests.items():

        def run_step(step: str = step, those: Any = those) -> None:
            warmup.load(components_of(step))
            import_core()
            had = kernel_folder._used | sys.modules.keys()
            for name, process, request in those:

                def run(name: str = name, process: str = process, request: Any = request) -> None:
                    compute(process, request)
                    modules = {module for module in sys.modules if module.startswith("grazemap_")}
                    print(json.dumps([name, step, sorted((kernel_folder._used | modules) - had)]))

                forked(run)

        forked(run_step)


if __name__ == "__main__":
    main()
