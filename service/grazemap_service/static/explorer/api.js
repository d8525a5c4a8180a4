// Requests to the service: problems, the key, waiting for a job, and giving it up.
import { forTab } from "./kept.js";

const FINISHED = ["successful", "failed", "dismissed"];
const BUSY = [429, 502, 503, 504, 507];
const WAIT_SECONDS = 20;
const NPZ = "application/x-npz";

// One asker for each open page, so that pages that share a job give it up one by one.
const asker = `explorer-${[...crypto.getRandomValues(new Uint8Array(9))].map((byte) => byte.toString(36)).join("")}`;

// What the service refused or could not do: an RFC 9457 document.
class Problem extends Error {
  constructor(body, status) {
    const [first] = body.errors ?? [];
    const where = first?.pointer ? `${first.pointer.slice(1)}: ` : "";
    super(first ? `${where}${first.detail}.` : (body.detail ?? body.title ?? `The service answers ${status}.`));
    this.errors = body.errors ?? []; // what the service has against a request; none where it fails itself
  }
}

// What the page does where the service needs it: `key({ isWrong })` is a promise of the key that a person enters, after
// one that the service does not take where it `isWrong`; `trouble(text)`
// says why an answer is awaited, and "" when it has come.
const page = { key: null, trouble: null };
export const serve = (handlers) => Object.assign(page, handlers);

const pause = (seconds, signal) =>
  new Promise((resolve, reject) => {
    signal?.throwIfAborted();
    const stop = () => {
      clearTimeout(timer);
      reject(signal.reason);
    };
    const timer = setTimeout(() => {
      signal?.removeEventListener("abort", stop);
      resolve();
    }, 1000 * seconds);
    signal?.addEventListener("abort", stop, { once: true });
  });

let key = forTab.get("grazemap-key");
let keyIsAsked = null;
async function newKey() {
  keyIsAsked ??= page.key({ isWrong: key !== null }).finally(() => {
    keyIsAsked = null;
  });
  key = await keyIsAsked;
  forTab.set("grazemap-key", key);
}

const RETRY_SECONDS = 2;
async function answerTo(path, options) {
  try {
    return await fetch(path, options);
  } catch (error) {
    if (isAborted(error)) throw error;
    return null; // there is no service, or no way to it
  }
}

// The answer to a request; waits while the service is busy or away, unless `wanted` is aborted. Throws a Problem for every
// other answer of 400 or more.
/** @param {string} path  @param {Sending} [options]  @returns {Promise<Response>} */
export async function send(path, { method = "GET", headers = {}, body, signal, wanted = signal, keepalive } = {}) {
  for (;;) {
    /** @type {Record<string, string>} */
    const all = { "Grazemap-Client": asker, ...headers };
    const sent = key;
    if (sent) all.Authorization = `Bearer ${sent}`;
    if (body !== undefined) all["Content-Type"] = "application/json";
    const answer = await answerTo(path, {
      method,
      headers: all,
      signal,
      keepalive,
      body: body && JSON.stringify(body),
    });
    if (answer?.ok) {
      page.trouble("");
      return answer;
    }
    if (!answer) {
      page.trouble("The service does not answer; trying again.");
      await pause(RETRY_SECONDS, wanted);
      continue;
    }
    if (answer.status === 401) {
      if (sent === key) await newKey(); // else another one was entered meanwhile
      continue;
    }
    const problem = new Problem(await answer.json().catch(() => ({})), answer.status);
    if (!BUSY.includes(answer.status)) throw problem;
    page.trouble(problem.message);
    await pause(Number(answer.headers.get("Retry-After")) || RETRY_SECONDS, wanted);
  }
}

export const isAborted = (error) => error.name === "AbortError";

// Takes back this page's interest in a job: it is stopped unless others asked for it too.
const giveUp = (id) => send(`v1/jobs/${id}`, { method: "DELETE", keepalive: true }).catch(() => {});

const cancelled = new Set();
// Gives a job up for whatever in this page waits for it.
export function cancel(id) {
  cancelled.add(id);
  return giveUp(id);
}

// The result of a process, { id, data }: data is an ArrayBuffer (npz) or what the JSON says. An aborted `signal` gives
// the job up. `onJob` is called with each state of the job before its end.
/** @param {string} process  @param {object} request  @param {Asking} [how]  @returns {Promise<{ id: string, data: any }>} */
export async function compute(process, request, { npz = false, priority, signal, onJob } = {}) {
  const headers = {
    Accept: npz ? NPZ : "application/json",
    ...(priority !== undefined && { Priority: `${priority}` }),
  };
  let id = null;
  let isRepeated = false;
  try {
    for (let wait = 1; ; wait = WAIT_SECONDS) {
      // The first answer has the id, which giving up needs: so it is awaited even when `signal` is aborted.
      const answer = await send(`v1/${process}`, {
        method: "POST",
        headers: { ...headers, Prefer: `wait=${wait}, return=representation` },
        body: request,
        signal: id ? signal : undefined,
        wanted: signal,
      });
      const isFirst = id === null;
      id = answer.headers.get("Location").split("/").pop();
      const isCancelled = cancelled.delete(id) && !isFirst;
      if (answer.headers.get("Preference-Applied")?.includes("return=representation")) {
        return { id, data: await (npz ? answer.arrayBuffer() : answer.json()) };
      }
      const job = await answer.json();
      if (signal?.aborted) throw signal.reason;
      if (job.problem?.type.endsWith(":core-outdated") && !isRepeated) {
        isRepeated = true; // the workers were updated: the next POST begins anew
        continue;
      }
      if (job.status === "failed") throw new Problem(job.problem ?? {}, 500);
      if (job.status === "dismissed" || isCancelled)
        throw new Problem({ detail: "The job was cancelled; moving the plane asks for it again." }, 409);
      if (!FINISHED.includes(job.status)) onJob?.(job);
    }
  } catch (error) {
    if (isAborted(error) && id) await giveUp(id); // before the same is asked for again
    throw error;
  }
}

// The npz of a map that a job has computed; it is computed again where the service does not have it any more.
/** @param {string} id  @param {object} request  @returns {Promise<ArrayBuffer>} */
export async function mapOf(id, request) {
  const answer = await send(`v1/jobs/${encodeURIComponent(id)}/result`, { headers: { Accept: NPZ } }).catch(() => null);
  if (answer?.status === 200) return answer.arrayBuffer();
  return (await compute("unfolding-maps", request, { npz: true })).data;
}
