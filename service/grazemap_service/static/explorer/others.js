// Other motions at an open point: those to which other starts lead, and the one that a longer watch names.
import { sizeOf } from "./contact.js";
import { byId, element, swatch } from "./dom.js";
import { numbered } from "./labels.js";
import { percent } from "./layers.js";
import * as requests from "./requests.js";

const STATES = 64;
const FAST = 2; // times the frequency and the clearance, the largest velocity of a start
export const LONGER = 10; // times as many forcing periods

// The motions to which random states lead, [{ label, share }], the largest share first, and the share that none is
// named for; of an answer about basin fractions, at its first value.
export function motionsOf({ attractors, share, unresolved }) {
  const names = numbered(attractors.map(({ label, kind }) => label ?? kind));
  const motions = names.map((label, k) => ({ label, share: share[k][0] ?? 0 }));
  const there = motions.filter((motion) => motion.share > 0).sort((motion, other) => other.share - motion.share);
  return { motions: there, unresolved: unresolved[0] ?? 0 };
}

// So many states with random velocities up to `most`, the same ones each time, with every mass where it is at rest.
function startsOf(count, masses, most) {
  let seed = 1;
  const random = () => {
    seed = (16807 * seed) % 2147483647;
    return (2 * seed) / 2147483647 - 1;
  };
  return Array.from({ length: count }, () => ({ velocity: Array.from({ length: masses }, () => most * random()) }));
}

// For each motion to which some of these states lead, the first of them, by its name.
async function startsByName(panel) {
  const { machine, at } = panel;
  const starts = startsOf(STATES, sizeOf(machine), FAST * at[0] * at[1]);
  const settled = { transient: machine.periods, periods: 1, samples: 1, initial: starts };
  const { trajectories } = await panel.compute(
    "trajectories",
    requests.trajectory(machine, at, settled),
    panel.ofPoint,
  );
  const named = trajectories.map(({ motion }, k) => [motion.label, starts[k]]).filter(([label]) => label);
  return new Map(named.reverse());
}

export async function showOthers(panel) {
  const answer = await panel.compute(
    "basin-fractions",
    requests.fractions(panel.machine, panel.at, STATES),
    panel.ofPoint,
  );
  const { motions, unresolved } = motionsOf(answer);
  const looks = panel.colours.beside(motions.map(({ label }) => label));
  const fromRest = panel.labelFromRest;
  const items = motions.map(({ label, share }) => {
    const { colour, image } = looks.get(label);
    const text = `${label}: ${percent(share)}${label === fromRest ? ", from rest " : " "}`;
    return { label, item: element("li", {}, swatch(colour, image), text) };
  });
  const open = unresolved ? [element("li", { textContent: `not decided: ${percent(unresolved)}` })] : [];
  const list = element("ul", {}, ...items.map(({ item }) => item), ...open);
  const says = `Of ${STATES} random starts, in which every mass is displaced and moves, so many lead to each motion:`;
  byId("others").replaceChildren(element("p", {}, says), list);
  if (motions.length === 1 && motions[0].label === fromRest) return;
  const starts = (await startsByName(panel)).set(fromRest, null);
  for (const { label, item } of items) {
    if (!starts.has(label)) continue;
    const button = element("button", {
      type: "button",
      value: label,
      textContent: "Show",
      "aria-label": `Show ${label}`,
    });
    button.addEventListener("click", () => panel.choose({ start: starts.get(label), note: OF_START }));
    item.append(button);
  }
  mark(panel.label);
}
const OF_START = "From one of the random starts.";

// Marks the motion that is shown in the list of motions.
export function mark(label) {
  for (const button of byId("others").querySelectorAll("button"))
    button.setAttribute("aria-pressed", button.value === label);
}

// Reasons of the service that a person may not know the words of, by a part of them.
export const PLAIN = {
  "did not close":
    "it has neither settled, nor been shown to be chaotic. It may settle later, or have a long period, or none",
  "converges too slowly": "it is still settling, very slowly, as close to a bifurcation",
  "an impact is so slow": "an impact is so gentle that it may be none in the long run: a graze is near",
  "too many impacts": "it has too many impacts to follow: the contact chatters on a stop",
};
const plain = (reason) =>
  Object.entries(PLAIN).find(([part]) => reason.includes(part))?.[1] ?? reason.replace(/\.$/, "");

// What a map says of a point, { label, reason, remedy, exponent }: its motion, and of one that is not decided why not,
// and what may help.
export function verdictOf({ motion, motions, lyapunov, reason, reasons }) {
  const { label, kind } = motions[motion[0][0]];
  const [why, remedy = ""] = (kind === "unresolved" ? (reasons[reason[0][0]] ?? "") : "").split(/\.? Remedy: /s);
  return { label: label ?? kind, reason: why, remedy, exponent: lyapunov?.[0]?.[0] ?? null };
}

// Says why no motion is named after so many forcing periods; nothing without a reason.
export function explain({ reason, remedy }, periods) {
  byId("unresolved").hidden = !reason;
  if (!reason) return;
  byId("unresolved-why").textContent = `After ${periods} forcing periods no motion can be named: ${plain(reason)}.`;
  byId("unresolved-words").textContent = `${reason}${remedy && `; what may help: ${remedy}`}`;
  byId("ask-longer").textContent = `Watch ${LONGER * periods} forcing periods here`;
}
