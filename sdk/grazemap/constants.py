"""The client's fixed figures, each with the reason for its size."""

from __future__ import annotations

import math
from typing import Final

DEFAULT_BASE_URL: Final = "http://127.0.0.1:8000"
API_PREFIX: Final = "/v1"

# Seconds without data after which a request fails. The service answers within milliseconds and streams results.
DEFAULT_TIMEOUT: Final = 30.0
# Seconds that the service may delay the answer to a POST: enough for a curve, and short enough for a progress bar.
PREFER_WAIT: Final = 1

# Further attempts. With full jitter the pauses add up to 8 s on average: longer than a stack needs to restart its
# service, and short enough after a mistyped address.
DEFAULT_RETRIES: Final = 5
# More attempts while a job is computed: 23 s on average.
FOLLOW_RETRIES: Final = 8
BACKOFF_START: Final = 0.5
BACKOFF_LIMIT: Final = 10.0
# After a longer Retry-After there is no further attempt; the exception has it.
RETRY_AFTER_LIMIT: Final = 60.0
RETRIED_STATUSES: Final = frozenset({429, 502, 503, 504})

# Bytes of an answer, after decompression, and characters of an event: no result and no event of a service is longer.
LONGEST_ANSWER: Final = 257 << 20
LONGEST_EVENT: Final = 1 << 20

# Seconds of silence after which an event stream counts as broken: the service sends a comment every 15 s.
STREAM_SILENCE: Final = 45.0
# Number of consecutive streams without an event after which the client polls instead.
STREAM_ATTEMPTS: Final = 3
POLL_START: Final = 0.1
POLL_LIMIT: Final = 2.0
POLL_GROWTH: Final = 1.5

# Requests and bytes of one batch, within the limits of the service; bytes of a line of the answer, whose results have
# at most a megabyte. The service sends an empty line every 5 s.
MOST_OF_BATCH: Final = 1000
BYTES_OF_BATCH: Final = 900_000
MOST_OF_LINE: Final = 4_000_000
BATCH_SILENCE: Final = 30.0

# Seconds until a local stack must be ready: its first start on a machine compiles every kernel.
LOCAL_START_TIMEOUT: Final = 240.0
# Seconds for the orderly stop of a local stack before it is killed.
LOCAL_STOP_TIMEOUT: Final = 10.0

# Units of parameters in SI.
UNITS: Final = {"omega": "rad/s", "clearance": "m", "clearance_right": "m", "clearance_left": "m"}
# Unit and factor that engineers read, by the unit of results in SI.
ENGINEERING_UNITS: Final = {"rad/s": ("Hz", 1.0 / (2.0 * math.pi)), "m": ("mm", 1e3)}

# A number of a request is 0, or of a size between these, in any unit.
SMALLEST_NUMBER: Final = 1e-60
LARGEST_NUMBER: Final = 1e60
