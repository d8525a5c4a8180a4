"""The names of grazemap's keys in Redis, and the numbers that bound what they hold.

All keys share one prefix, so that a Redis can hold other things too. The number in it is that of the layout: of these
keys, of what they hold and of the scripts that change them. Versions of grazemap with different layouts on one Redis
never run their scripts on the same keys. `older_layouts` takes over the jobs of an earlier layout.

    job:<id>            hash: the record (process, request, plan, status, times, problem, counters)
    job:<id>:tiles      hash: tile number -> bytes of the finished tile
    job:<id>:claims     hash: tile number -> "holder|seconds since the epoch"
    job:<id>:failures   hash: "<tile>:<kind>" -> how often
    job:<id>:events     stream: progress, tile, done; removed an hour after the job's end
    job:<id>:waiting    string with a time to live: what keeps a tile of it from being computed, in a worker
    records:bytes       number: length of the requests in all records
    jobs, status:<s>    sorted sets of ids by sequence number, all of them and one per status
    unfinished          hash: id -> tiles that remain, of accepted and running jobs
    unfinished:tiles    number: their sum
    held:<name>         set of "id|tile": where to look for the claims of a worker; what it holds is in the claims
    holders             set of the names that have such a set
    result:<id>:<f>     string: npz bytes; f is the fingerprint of the numerics that made it
    results...          the least-recently-used order, sizes and total of the results
    worker:<name>       string with a time to live: the lease of a worker, its fingerprint the value
    workers             hash: name -> description
    starting            string with a time to live: what workers do that are not ready yet
    compiled:<f>        set: the numbers of masses for which workers with these numerics have the kernels of maps
    fingerprint:<f>, version:<v>   a worker recently had these numerics, this core version
"""

LAYOUT = 2
PREFIX = f"grazemap:{LAYOUT}:"
QUEUE_PREFIX = PREFIX
# Prefixes of earlier layouts. That of version 0.1.0 had no number.
OLDER_PREFIXES = ("grazemap:",)

# The number of the step that assembles a map once its tiles are done.
ASSEMBLY = -1

# Attempts at a tile before its job fails. An exception will probably recur, a lost worker will not.
MOST_EXCEPTIONS = 3
MOST_LOST = 10

# Maximum number of job records, and of bytes of their requests. Above them the oldest finished jobs are removed,
# results included. If unfinished jobs alone fill the bytes, new ones are refused as with a full queue.
MOST_RECORDS = 10_000
MOST_RECORD_BYTES = 256 << 20
# A longer request is left out of lists of jobs.
LISTED_REQUEST_BYTES = 4096
# A result or a tile, as npz. Redis takes no value over 512 MB, and clients hold it in memory.
MOST_RESULT_BYTES = 256 << 20
# Seconds that the tiles of a complete map are kept, for clients that fetch it tile by tile.
TILES_KEPT_AFTER_SUCCESS = 600
# Seconds that the tiles of a failed job are kept, in case its request is posted again.
TILES_KEPT_AFTER_FAILURE = 86_400
# Seconds that a job stays bound to a fingerprint without workers, and after which a job of a core version that no
# worker has fails.
FINGERPRINT_REMEMBERED = 60


def job_key(job_id: str, part: str = "") -> str:
    """Return the key of a job's record, or of one of its parts (tiles, claims, failures, events, waiting)."""
    return f"{PREFIX}job:{job_id}:{part}" if part else f"{PREFIX}job:{job_id}"


def queue_name(fingerprint: str) -> str:
    """Return the name of the queue that workers with this fingerprint listen to."""
    return QUEUE_PREFIX + fingerprint
