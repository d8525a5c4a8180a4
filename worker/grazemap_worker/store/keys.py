"""The names of grazemap's keys in Redis, and the numbers that bound what they hold.

All keys share one prefix, so that other programs can use the same Redis. The number in the prefix is the layout: the
version of these keys, of their values and of the scripts that change them. Versions of grazemap with different layouts
on one Redis never run their scripts on the same keys.

Keys and scripts call a requester, who asked for a job, an "asker". A fingerprint f is that of the numerics.

    job:<id>            hash: the record (process, request, plan, status, times, problem, counters, place in its flow)
    job:<id>:tiles      hash: tile number -> bytes of the finished tile
    job:<id>:claims     hash: tile number -> "holder|seconds since the epoch"
    job:<id>:again      set of tiles to be claimed again; "next" in the record is the first tile never claimed
    job:<id>:failures   hash: "<tile>:<kind>" -> number of failures
    job:<id>:askers     sorted set: names of the subscribed askers, by the time at which their subscriptions expire
    job:<id>:events     stream: progress, tile, done; removed an hour after the end of the job; small jobs have none
    sequence            number: the last sequence number that a job was given
    jobs, status:<s>    sorted sets of ids by sequence number: of all jobs, and of the jobs of each status
    over:<class>        the same of finished jobs, by class (small, large); the oldest records are removed first
    unfinished          hash: id -> number of tiles that remain of an accepted or running job
    unfinished:tiles    number: sum over all jobs; unfinished:askers: hash of the sums by asker
    flows:<f>           sorted set: flows with tiles to claim by workers with fingerprint f, by their virtual time
    clocks              hash: "<f>" or "<f>:small" -> greatest virtual time of a flow that was served
    flow:<f>:<flow>     sorted set: jobs of the flow "lane|kernels|priority|asker", by their virtual time; ":tiles"
                        follows the lane of jobs with long tiles
    load                hash: fingerprint -> estimated milliseconds of the unfinished tiles of the jobs bound to it
    overran:<asker>     string with a time to live: a small tile of this asker took far too long
    alone:<f>           string: the worker that last claimed a small tile of such an asker
    held:<name>         set of "id|tile": index of the claims of a worker; only job:<id>:claims decides who holds a tile
    holders             set of the names of workers with such an index
    result:<id>:<f>     string: npz bytes of a result that was computed with fingerprint f
    results:<class>     sorted set: keys of results, least recently used first; results:sizes: hash of class and size
    clock               number: counts the uses of results
    tiles:kept          sorted set: finished jobs with tiles, by the time at which the tiles are removed
    bytes               hash: bytes of requests, tiles, results:small, results:large
    waiting:<lane>      sorted set: jobs with tiles to claim, by the time of the last claim, else of the first offer
    budget              string: maximum bytes of results and tiles, from the settings of the workers
    counts              hash: number of failures of each kind, of unreadable records and refused entries, and of ends
    worker:<name>       string with a time to live: the lease of a worker; the value is its length in milliseconds
    workers             hash: name -> description
    starting            string with a time to live: what workers do that are not ready yet
    compiling:<k>       string with a time to live: state of the compilation of kernels that jobs wait for
    kernel-waits        string with a time to live: seconds until kernels that no worker has are ready, as JSON
    lead:<role>         string with a time to live: the supervisor that does what only one of them does
    written             string with a time to live: written to test whether Redis takes writes
    fingerprint:<f>, version:<v>   strings with a time to live: a worker had this fingerprint, this core version
    events              channel: "id, number, name, data" of every event, on four lines
"""

LAYOUT = 4
PREFIX = f"grazemap:{LAYOUT}:"
EVENTS_CHANNEL = f"{PREFIX}events"

# The number of the step that assembles a map once its tiles are done.
ASSEMBLY = -1

# Failed attempts at a tile after which its job fails. An exception will probably recur; the loss of a worker will not.
MAX_EXCEPTIONS = 3
MAX_LOST = 10

# Seconds for which the small tiles of a requester are claimed one by one after one of them took far too long.
ALONE_SECONDS = 600

# A job is stopped when its processor time exceeds both the service's limit and so many times its own estimate.
SPENT_FACTOR = 4.0

# Maximum number of records of finished jobs in each class, and maximum bytes of all requests. Above these, the oldest
# finished jobs are removed with their results, small jobs first. If the requests of unfinished jobs alone exceed the
# maximum, new jobs are refused as if the queue were full.
MAX_SMALL_RECORDS = 10_000
MAX_LARGE_RECORDS = 10_000
MAX_RECORD_BYTES = 256 << 20
# Seconds for which a requester stays subscribed to a job after its last request for the job.
SUBSCRIPTION_SECONDS = 900
# Lists of jobs leave out longer requests.
LISTED_REQUEST_BYTES = 4096
# Number of jobs that one call of a script looks at to make a list. This takes a millisecond or two, during which Redis
# serves no other client.
EXAMINED_AT_ONCE = 500
# Seconds for which the tiles of a finished map are kept, for clients that fetch it tile by tile.
TILES_KEPT_AFTER_SUCCESS = 600
# Seconds for which the tiles of a failed job are kept, in case its request is posted again.
TILES_KEPT_AFTER_FAILURE = 86_400
# Seconds for which a job stays bound to a fingerprint that no live worker has; and seconds after which a job fails
# because no live worker has its core version.
FINGERPRINT_REMEMBERED = 60


def job_key(job_id: str, part: str = "") -> str:
    """Return the key of a job's record, or of one of its parts (tiles, claims, failures, ...)."""
    return f"{PREFIX}job:{job_id}:{part}" if part else f"{PREFIX}job:{job_id}"
