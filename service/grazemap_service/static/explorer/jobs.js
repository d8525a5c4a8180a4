// The list of jobs with their progress, while it is open: those that run, then the newest of the others.
import { cancel, send } from "./api.js";
import { byId, element } from "./dom.js";
import { toRead } from "./ticks.js";

const ASKED = 100;
const SHOWN = 20;
const LOOK_AGAIN = 2000;

export function listJobs() {
  const section = byId("jobs-section");
  let again = null;
  let isLooking = false;
  const look = async () => {
    clearTimeout(again);
    if (!section.open || isLooking) return;
    isLooking = true;
    try {
      const { jobs } = await (await send(`v1/jobs?small=false&limit=${ASKED}`)).json();
      const sorted = [...jobs.filter(isRunning), ...jobs.filter((job) => !isRunning(job))];
      const focused = byId("jobs").querySelector("button:focus")?.value;
      byId("jobs").replaceChildren(...sorted.slice(0, SHOWN).map(entry));
      if (focused) byId("jobs").querySelector(`button[value="${focused}"]`)?.focus();
      if (sorted.length > SHOWN) byId("jobs").append(element("li", { textContent: "and older ones" }));
    } catch (error) {
      byId("jobs").replaceChildren(element("li", { textContent: error.message }));
    }
    isLooking = false;
    again = setTimeout(look, LOOK_AGAIN);
  };
  section.addEventListener("toggle", look);
  look(); // it may be open already
}

const isRunning = ({ status }) => status === "accepted" || status === "running";

// What varies in a request, in words; lists leave out long requests.
function rangesOf(request) {
  const { axis, horizontal, vertical } = request ?? {};
  return [axis, horizontal, vertical].filter(Boolean).map(({ vary, values }) => {
    const ends = Array.isArray(values) ? [values[0], values[values.length - 1]] : [values.start, values.stop];
    return `${vary === "omega" ? "ω" : vary} ${ends.map((value) => toRead(value)).join(" to ")}`;
  });
}

function entry(job) {
  const { id, process, status, progress, request, waiting_for: waitingFor } = job;
  const { done, total } = progress;
  const what = [process.replaceAll("-", " "), request?.preview && "preview", ...rangesOf(request)]
    .filter(Boolean)
    .join(", ");
  const line = element(
    "li",
    {},
    element("a", { href: `v1/jobs/${id}`, textContent: what, title: "The job, as JSON" }),
    " ",
  );
  if (!isRunning(job)) line.append(status);
  else {
    line.append(
      element("progress", { max: total || 1, value: done, "aria-label": `Progress of ${what}` }),
      waitingFor ?? "",
      element("button", {
        type: "button",
        textContent: "Cancel",
        value: id,
        "aria-label": `Cancel ${what}`,
        onclick: () => cancel(id),
      }),
    );
  }
  return line;
}
