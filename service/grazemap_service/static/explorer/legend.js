// The legend: the motions in the view, which one switches off and on, or the ramp of a value.
import { byId, element, swatch } from "./dom.js";
import { LAYERS, percent, shares } from "./layers.js";
import { toRead } from "./ticks.js";
import { unitOf } from "./units.js";

const NAMED = 24;

export class Legend {
  hidden = new Set();
  #shown = "";

  // `changed` is called when a motion was switched off or on.
  constructor({ colours, changed }) {
    Object.assign(this, { colours, changed });
  }

  show(state, tiles, range) {
    const { field } = LAYERS[state.layer];
    byId("ramp").hidden = !field;
    byId("legend").hidden = Boolean(field);
    if (field) this.#showRamp(state, range);
    else this.#showMotions(state, tiles);
  }

  #showRamp({ layer, machine }, range) {
    const { text, unit = "", quantity, diverging, white } = LAYERS[layer];
    const named = `${text}${unit && ` ${unit}`}${quantity ? unitOf(machine, quantity) : ""}`;
    byId("ramp-white").textContent = `White: ${white}.`;
    byId("ramp").className = diverging ? "diverging" : "sequential";
    byId("ramp-text").textContent = range
      ? `${named}: ${toRead(range[0])} to ${toRead(range[1])}`
      : `${named}: comes with the verified tiles`;
  }

  #showMotions(view, tiles) {
    const verified = tiles.filter(({ preview }) => !preview);
    const all = shares(verified.length ? verified : tiles, view);
    const first = all.slice(0, NAMED);
    const signature = JSON.stringify([first, [...this.hidden]]);
    if (signature === this.#shown) return; // so that a box keeps the focus
    this.#shown = signature;
    const focused = document.activeElement?.value;
    byId("legend").replaceChildren(...first.map(({ label, share }) => this.#entry(label, share)));
    const others = all.length - first.length;
    if (others) byId("legend").append(element("li", { textContent: `and ${others} others` }));
    if (focused)
      byId("legend")
        .querySelector(`input[value="${CSS.escape(focused)}"]`)
        ?.focus();
  }

  #entry(label, share) {
    const box = element("input", { type: "checkbox", value: label, checked: !this.hidden.has(label) });
    box.addEventListener("change", () => {
      if (box.checked) this.hidden.delete(label);
      else this.hidden.add(label);
      this.changed();
    });
    const part = element("small", { textContent: percent(share) });
    return element("li", {}, element("label", {}, box, swatch(this.colours.of(label)), `${label} `, part));
  }
}
