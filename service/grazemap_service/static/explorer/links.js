// What a link says that this page or its service does not take.
import { UNSAID, read } from "./address.js";
import { structureOf } from "./structures.js";

const MOST_ERRORS = 3; // of a machine that are said

// What the service says against a machine; null where it takes it, or does not say.
async function against(machine) {
  try {
    await structureOf(machine);
    return null;
  } catch ({ errors }) {
    if (!errors?.length) return null; // the tiles say what is wrong with the service
    const texts = errors.map(({ pointer, detail, allowed }) => {
      const where = pointer.split("/").slice(2).join("/");
      return `${where ? `${where}: ` : ""}${detail}${allowed ? `; allowed: ${allowed}` : ""}`;
    });
    return texts.slice(0, MOST_ERRORS).join("; ");
  }
}

// The state that an address says, and its faults: `standard` with the paper's machine where the service refuses its
// own.
/** @param {string} hash  @param {State} standard  @returns {Promise<{ state: State, faults: string[] }>} */
export async function followed(hash, standard) {
  const answer = read(hash, standard);
  const { machine } = answer.state;
  const wrong = machine.oscillator && (await against(machine));
  if (!wrong) return answer;
  const fault = `The service refuses the link’s machine: ${wrong}. Shown instead: the paper’s machine and its first window.`;
  return { state: { ...standard, machine: UNSAID.machine }, faults: [...answer.faults, fault] };
}
