// What the page says below the plane: of the point under the pointer, and of what is being computed.
import { withoutRemedy } from "./layers.js";
import { parameter } from "./parameters.js";
import { STARTS } from "./starts.js";
import { toRead } from "./ticks.js";
import { shown, symbolOf, unitOf, withUnit } from "./units.js";

const midSentence = (text) => (text.startsWith("Lyapunov") ? text : text.toLowerCase());

// What is known of a point of a tile, as `reading` has it.
/** @param {any} known  @param {State} state */
function described({ label, verified, sensitive, preview, reason, figures }, { policy, machine }) {
  const parts = [label];
  if (preview) parts.push("preview");
  else if (verified) parts.push("verified");
  else if (reason) parts.push(withoutRemedy(reason));
  else if (sensitive) parts.push("sensitive to round-off");
  if (policy !== "rest") parts.push(STARTS[policy].phrase);
  for (const { layer, value } of figures)
    parts.push(`${midSentence(layer.text)} ${withUnit(machine, layer.quantity, value)}`);
  return parts.join("; ");
}

// A point of the plane with what is known there, `here`, or with the curve or mark that is `drawn` there.
/** @param {State} state  @param {Place} at  @param {{ drawn: string, here: any }} known */
export function ofPoint(state, at, { drawn, here }) {
  const value = (name, number, interval) => {
    const { text, quantity } = parameter(name, state.machine);
    const label = name === "omega" ? `${symbolOf(state.machine)} =` : text;
    const [read, low, high] = shown(state.machine, quantity, [number, ...interval]);
    return `${label} ${toRead(read, high - low)}${unitOf(state.machine, quantity)}`;
  };
  const { horizontal, vertical } = state.plane;
  const values = `${value(horizontal, at.x, state.x)}, ${value(vertical, at.y, state.y)}`;
  const known = drawn ?? (here && described(here, state));
  return known ? `${values}: ${known}` : values;
}

// What the page is doing. `hasPicture`: something of the plane is there; `isChoosing`: a machine is about to be shown;
// `pending` are curves in words; `isEnded`: double precision has no finer points; `isSensitive`: round-off decides.
export function ofWork({ progress, policy, hasPicture, isChoosing, isRefining, pending, isEnded, isSensitive }) {
  const { failed, total, waitingFor } = progress;
  const parts = [];
  if (isChoosing) parts.push("Computing the grazing curve of the machine.");
  if (!hasPicture && waitingFor) parts.push(`Waiting for ${waitingFor}.`);
  else if (isRefining) parts.push("Refining …");
  if (failed) parts.push(`${failed} of ${total} tiles failed.`);
  if (hasPicture && STARTS[policy].means) parts.push(STARTS[policy].means);
  parts.push(...pending.map((what) => `Computing ${what}.`));
  if (isEnded) parts.push("Double precision ends here: neighbouring points would be less than 64 roundings apart.");
  else if (isSensitive) parts.push("Round-off decides nearly all labels here: a closer look shows no more.");
  return parts.join(" ");
}
