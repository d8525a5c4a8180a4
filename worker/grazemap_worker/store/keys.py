"""The names of grazemap's keys in Redis, and the numbers that bound what they hold.

All keys share one prefix, so that a Redis can hold other things too. The number in it is that of the layout: of these
keys, of what they hold and of the scripts that change them. Versions of grazemap with different layouts on one Redis
never run their scripts on the same keys.

    job:<id>            hash: the record (process, request, plan, status, times, problem, counters, place in the queue)
    job:<id>:tiles      hash: tile number -> bytes of the finished tile
    job:<id>:claims     hash: tile number -> "holder|seconds since the epoch"
    job:<id>:again      set of tiles to be claimed again, besides those that were never claimed ("next" in the record)
    job:<id>:failures   hash: "<tile>:<kind>" -> how often
    job:<id>:askers     sorted set: who asked for it, by the time at which their interest runs out
    job:<id>:events     stream: progress, tile, done; removed an hour after the job's end; small jobs have none
    jobs, status:<s>    sorted sets of ids by sequence number, all of them and one per status
    over:<class>        the same of finished jobs, by class (small, large), in which they are forgotten
    unfinished          hash: id -> tiles that remain, of accepted and running jobs
    unfinished:tiles    number: their sum; unfinished:askers: hash of the sums by asker
    flows:<f>           sorted set: the flows of jobs that have tiles to claim by workers with fingerprint f, by the
                        virtual time up to which they were served; clocks: hash of the virtual times that were reached
    flow:<f>:<flow>     sorted set: the jobs of a flow "lane|kernels|priority|asker", by the same; ":tiles" follows the
                        lane of jobs whose tiles are long, each by itself
    load                hash: fingerprint -> milliseconds that the unfinished tiles of the jobs bound to it should take
    overran:<asker>     string with a time to live: a small tile of this asker took far too long
    alone:<f>           string: the worker that last claimed a small tile of such an asker
    held:<name>         set of "id|tile": where to look for the claims of a worker; what it holds is in the claims
    holders             set of the names that have such a set
    result:<id>:<f>     string: npz bytes; f is the fingerprint of the numerics that made it
    results:<class>     the least-recently-used order; results:sizes: class and size of each
    tiles:kept          sorted set: finished jobs with tiles, by the time at which these are removed
    bytes               hash: bytes of requests, tiles, results:small, results:large
    waiting:<lane>      sorted set: the jobs that have tiles to claim, by the time of the last claim, or of the offer
    budget              string: the bytes that results and tiles may take, as the workers have it
    counts              hash: how often something happened: failures of each kind, poisoned records and entries, ends
    worker:<name>       string with a time to live: the lease of a worker, its length in milliseconds the value
    workers             hash: name -> description
    starting            string with a time to live: what workers do that are not ready yet
    compiling:<k>       string with a time to live: what is said of kernels that jobs wait for
    written             string with a time to live: shows that Redis takes writes
    fingerprint:<f>, version:<v>   a worker recently had these numerics, this core version
    events              channel: "id, number, name, data" of every event, in lines
"""

LAYOUT = 4
PREFIX = f"grazemap:{LAYOUT}:"
QUEUE_PREFIX = PREFIX
EVENTS_CHANNEL = f"{PREFIX}events"

# The number of the step that assembles a map once its tiles are done.
ASSEMBLY = -1

# Attempts at a tile before its job fails. An exception will probably recur, a lost worker will not.
MOST_EXCEPTIONS = 3
MOST_LOST = 10

# Seconds for which the small tiles of an asker are claimed one by one after one that took far too long.
ALONE_SECONDS = 600

# A job is stopped when its processor time is over the service's limit of seconds and over so many times its estimate.
SPENT_FACTOR = 4.0

# Maximum number of records of finished jobs in each class, and of bytes of all requests. Above them the oldest finished
# jobs are removed, small ones first, results included. If unfinished jobs alone fill the bytes, new ones are refused as
# with a full queue.
MOST_SMALL_RECORDS = 10_000
MOST_LARGE_RECORDS = 10_000
MOST_RECORD_BYTES = 256 << 20
# Seconds for which one who asked for a job counts as interested in it, after the last sign of it.
INTEREST_SECONDS = 900
# A longer request is left out of lists of jobs.
LISTED_REQUEST_BYTES = 4096
# Jobs that one script looks at for a list of selected ones: a millisecond or two, in which Redis serves nobody else.
EXAMINED_AT_ONCE = 500
# Seconds that the tiles of a complete map are kept, for clients that fetch it tile by tile.
TILES_KEPT_AFTER_SUCCESS = 600
# Seconds that the tiles of a failed job are kept, in case its request is posted again.
TILES_KEPT_AFTER_FAILURE = 86_400
# Seconds that a job stays bound to a fingerprint without workers, and after which a job of a core version that no
# worker has fails.
FINGERPRINT_REMEMBERED = 60


def job_key(job_id: str, part: str = "") -> str:
    """Return the key of a job's record, or of one of its parts (tiles, claims, failures, askers, ...)."""
    return f"{PREFIX}job:{job_id}:{part}" if part else f"{PREFIX}job:{job_id}"


def queue_name(fingerprint: str) -> str:
    """Return the name of the queue that workers with this fingerprint listen to."""
    return QUEUE_PREFIX + fingerprint
