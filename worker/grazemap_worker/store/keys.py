"""The names of grazemap's keys in Redis, and the numbers that bound what they hold.

All keys share one prefix, so that a Redis can hold other things too. The number in it is that of the layout: of these
keys, of what they hold and of the scripts that change them. Versions of grazemap with different layouts on one Redis
never run their scripts on the same keys. `older_layouts` takes over the jobs of an earlier layout.

    job:<id>            hash: the record (process, request, plan, status, times, problem, counters)
    job:<id>:tiles      hash: tile number -> bytes of the finished tile
    job:<id>:claims     hash: tile number -> "holder|seconds since the epoch"
    job:<id>:failures   hash: "<tile>:<kind>" -> how often
    job:<id>:events     stream: progress, tile, done; goes an hour after the job's end
    records:bytes       number: length of the requests in all records
    jobs, status:<s>    sorted sets of ids by sequence number, all of them and one per status
    unfinished          hash: id -> tiles that remain, of accepted and running jobs
    unfinished:tiles    number: their sum
    held:<name>         set of "id|tile": where to look for the claims of a worker; what it holds is in the claims
    holders             set of the names that have one
    result:<id>:<f>     string: npz bytes; f is the fingerprint of the numerics that made it
    results...          the least-recently-used order, sizes and total of the results
    worker:<name>       string with a time to live: the lease of a worker, its fingerprint the value
    workers             hash: name -> description
    fingerprint:<f>, version:<v>   a worker had these numerics, this core version, not long ago
"""

LAYOUT = 2
PREFIX = f"grazemap:{LAYOUT}:"
QUEUE_PREFIX = PREFIX
# Of the layouts before this one. That of version 0.1.0 had no number.
OLDER_PREFIXES = ("grazemap:",)

# The number of the step that assembles a map once its tiles are done.
ASSEMBLY = -1

# Tries at a tile before its job fails. An exception will most likely come back, a lost worker will not.
MOST_EXCEPTIONS = 3
MOST_LOST = 10

# Job records that are kept; over it, in number or in bytes of their requests, the oldest finished ones are forgotten,
# results included. Requests that are unfinished and fill the bytes alone are refused like a full queue.
MOST_RECORDS = 10_000
MOST_RECORD_BYTES = 256 << 20
# A longer request is left out of lists of jobs.
LISTED_REQUEST_BYTES = 4096
# A result or a tile, as npz. Redis takes no value over 512 MB, and whoever asks holds it in memory.
MOST_RESULT_BYTES = 256 << 20
# Tiles of a map that is whole are still there for clients that followed it tile by tile, then only the result is.
TILES_KEPT_AFTER_SUCCESS = 600
# Tiles of a failed job are there when it is asked again.
TILES_KEPT_AFTER_FAILURE = 86_400
# A job stays bound to a fingerprint whose workers are all gone for this long, in seconds; a job of a core version that
# no worker has fails after it.
FINGERPRINT_REMEMBERED = 60


def job_key(job_id: str, part: str = "") -> str:
    """Return the key of a job's record, or of one of its parts (tiles, claims, failures, events)."""
    return f"{PREFIX}job:{job_id}:{part}" if part else f"{PREFIX}job:{job_id}"


def queue_name(fingerprint: str) -> str:
    """Return the name of the queue that workers with this fingerprint listen to."""
    return QUEUE_PREFIX + fingerprint
