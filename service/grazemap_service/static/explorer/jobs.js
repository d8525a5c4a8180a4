// The list of jobs, newest first, with their progress, while it is open.
import { cancel, send } from "./api.js";
import { byId, element } from "./dom.js";

const SHOWN = 20;
const LOOK_AGAIN = 2000;

export function listJobs() {
  const section = byId("jobs-section");
  const look = async () => {
    if (!section.open) return;
    try {
      const { jobs } = await (await send(`v1/jobs?small=false&limit=${SHOWN}`)).json();
      byId("jobs").replaceChildren(...jobs.map(entry));
    } catch (error) {
      byId("jobs").replaceChildren(element("li", { textContent: error.message }));
    }
    setTimeout(look, LOOK_AGAIN);
  };
  section.addEventListener("toggle", look);
}

function entry({ id, process, status, progress, request, waiting_for: waitingFor }) {
  const running = status === "accepted" || status === "running";
  const { done, total } = progress;
  const what = `${process}${request?.preview ? ", preview" : ""} `;
  const line = element(
    "li",
    {},
    element("a", { href: `v1/jobs/${id}`, textContent: id.slice(0, 8), title: "The job, as JSON" }),
    ` ${what}`,
  );
  if (!running) line.append(status);
  else {
    line.append(
      element("progress", { max: total || 1, value: done, "aria-label": `Progress of ${process} ${id.slice(0, 8)}` }),
      waitingFor ?? "",
      element("button", {
        type: "button",
        textContent: "Cancel",
        "aria-label": `Cancel ${process} ${id.slice(0, 8)}`,
        onclick: () => cancel(id),
      }),
    );
  }
  return line;
}
