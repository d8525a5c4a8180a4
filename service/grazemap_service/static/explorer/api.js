// Requests to the service: problems, the key, waiting for a job, and giving it up.

const FINISHED = ["successful", "failed", "dismissed"];
const BUSY = [429, 502, 503, 504, 507];
const WAIT_SECONDS = 20;
const NPZ = "application/x-npz";

// One asker for each open page, so that pages that share a job give it up one by one.
const asker = `explorer-${[...crypto.getRandomValues(new Uint8Array(9))].map((byte) => byte.toString(36)).join("")}`;

// What the service refused or could not do: an RFC 9457 document.
export class Problem extends Error {
  constructor(body, status) {
    super(body.detail ?? body.title ?? `The service answers ${status}.`);
    this.status = status;
    this.errors = body.errors ?? [];
  }
}

let askForKey = null;
// `ask` returns a promise of the key that a person enters.
export function whenKeyIsNeeded(ask) {
  askForKey = ask;
}

const pause = (seconds, signal) => new Promise((resolve, reject) => {
  const timer = setTimeout(resolve, 1000 * seconds);
  signal?.addEventListener("abort", () => { clearTimeout(timer); reject(signal.reason); }, { once: true });
});

let key = sessionStorage.getItem("grazemap-key");
let keyIsAsked = null;
async function newKey() {
  keyIsAsked ??= askForKey().finally(() => { keyIsAsked = null; });
  key = await keyIsAsked;
  sessionStorage.setItem("grazemap-key", key);
}

// The answer to a request; waits while the service is busy. Throws a Problem for every other answer of 400 or more.
export async function send(path, { method = "GET", headers = {}, body, signal } = {}) {
  for (;;) {
    const all = { "Grazemap-Client": asker, ...headers };
    if (key) all.Authorization = `Bearer ${key}`;
    if (body !== undefined) all["Content-Type"] = "application/json";
    const answer = await fetch(path, { method, headers: all, signal, body: body && JSON.stringify(body) });
    if (answer.ok) return answer;
    if (answer.status === 401) {
      await newKey();
      continue;
    }
    if (!BUSY.includes(answer.status)) throw new Problem(await answer.json().catch(() => ({})), answer.status);
    await pause(Number(answer.headers.get("Retry-After")) || 2, signal);
  }
}

export const isAborted = (error) => error.name === "AbortError";

// Takes back this page's interest in a job: it is stopped unless others asked for it too.
const giveUp = (id) => send(`v1/jobs/${id}`, { method: "DELETE" }).catch(() => {});

const cancelled = new Set();
// Gives a job up for whatever in this page waits for it.
export function cancel(id) {
  cancelled.add(id);
  return giveUp(id);
}

// The result of a process, { id, data }: data is an ArrayBuffer (npz) or what the JSON says. An aborted `signal` gives
// the job up. `onJob` is called with each state of the job before its end.
export async function compute(process, request, { npz = false, priority, signal, onJob } = {}) {
  const headers = { Accept: npz ? NPZ : "application/json", ...(priority !== undefined && { Priority: `${priority}` }) };
  let id = null;
  try {
    for (let wait = 1; ; wait = WAIT_SECONDS) {
      // The first answer has the id, which giving up needs: so it is awaited even when `signal` is aborted.
      const answer = await send(`v1/${process}`, {
        method: "POST",
        headers: { ...headers, Prefer: `wait=${wait}, return=representation` },
        body: request,
        signal: id ? signal : undefined,
      });
      id = answer.headers.get("Location").split("/").pop();
      if (answer.headers.get("Preference-Applied")?.includes("return=representation")) {
        return { id, data: await (npz ? answer.arrayBuffer() : answer.json()) };
      }
      const job = await answer.json();
      if (signal?.aborted) throw signal.reason;
      if (job.status === "failed") throw new Problem(job.problem ?? {}, 500);
      if (job.status === "dismissed" || cancelled.delete(id)) throw new Problem({ detail: "The job was cancelled." }, 409);
      if (!FINISHED.includes(job.status)) onJob?.(job);
    }
  } catch (error) {
    if (isAborted(error) && id) giveUp(id);
    throw error;
  }
}
