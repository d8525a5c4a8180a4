"""The client's fixed figures, each with the reason for its size."""

from __future__ import annotations

from typing import Final, Literal, get_args

DEFAULT_BASE_URL: Final = "http://127.0.0.1:8000"
API_PREFIX: Final = "/v1"
# The types of all problems begin with this.
PROBLEM_PREFIX: Final = "urn:grazemap:problem:"

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
MAX_BACKOFF: Final = 10.0
# Longest Retry-After that is waited for. After a longer one there is no further attempt; the exception has its value.
MAX_RETRY_AFTER: Final = 60.0
RETRIED_STATUSES: Final = frozenset({429, 502, 503, 504})

# Maximum bytes of an answer, after decompression, and characters of an event; no result or event is longer.
MAX_ANSWER_BYTES: Final = 257 << 20
MAX_EVENT_LENGTH: Final = 1 << 20

# Seconds of silence after which an event stream counts as broken: the service sends a comment every 15 s.
STREAM_SILENCE: Final = 45.0
# Number of consecutive streams without an event after which the client polls instead.
STREAM_ATTEMPTS: Final = 3
POLL_START: Final = 0.1
MAX_POLL_INTERVAL: Final = 2.0
POLL_GROWTH: Final = 1.5

# Maximum number of requests in one batch, for clients and services, and of bytes, within the limits of services.
MAX_BATCH_REQUESTS: Final = 1000
MAX_BATCH_BYTES: Final = 900_000
# Maximum bytes of a line of the answer to a batch; a result in a line has at most a megabyte.
MAX_LINE_BYTES: Final = 4_000_000
# Seconds of silence after which the answer to a batch counts as broken: the service sends an empty line every 5 s.
BATCH_SILENCE: Final = 30.0

# Seconds until a local stack must be ready: its first start on a machine compiles every kernel.
LOCAL_START_TIMEOUT: Final = 240.0
# Seconds for the orderly stop of a local stack before it is killed.
LOCAL_STOP_TIMEOUT: Final = 10.0

# Units of parameters in SI.
UNITS: Final = {
    "omega": "rad/s",
    "clearance": "m",
    "clearance_right": "m",
    "clearance_left": "m",
    "masses": "kg",
    "stiffnesses": "N/m",
    "dampings": "N s/m",
}
# By the quantity of a mass that varies over the initial states of basins.
COORDINATE_UNITS: Final = {"displacement": "m", "velocity": "m/s"}
# The units of machines, which go together.
ENGINEERING_UNITS: Final = ("Hz", "mm")

# Every number of a request is 0, or has a modulus between these, in any unit.
SMALLEST_NUMBER: Final = 1e-60
LARGEST_NUMBER: Final = 1e60
# Twice the largest relative rounding of a number; the core has the same.
EPSILON: Final = 2.0**-52

# The endings of files that pictures are written to, and the styles of pictures, the default first.
PICTURE_FILES: Final = (".png", ".svg", ".pdf")
PictureStyle = Literal["screen", "column"]
PICTURE_STYLES: Final[tuple[PictureStyle, ...]] = get_args(PictureStyle)

# The endings of files that tables are written to.
TABLE_FILES: Final = (".csv", ".xlsx", ".parquet")
