// The legend: the motions in the view, which one switches off and on, or the ramp of a value.
import { byId, element, swatch } from "./dom.js";
import { NAMED } from "./labels.js";
import { LAYERS, percent } from "./layers.js";
import { toRead } from "./ticks.js";
import { named } from "./units.js";

const numbered = (colour, k) => [swatch(colour), ` ${k + 1} `];

export class Legend {
  hidden = new Set();
  #shown = "";
  #meanings = [];

  // `names` are those of bifurcations; `changed` is called when a motion was switched off or on.
  constructor({ colours, names, changed }) {
    Object.assign(this, { colours, changed });
    const { bifurcations, orders } = colours.palette;
    const item = (...parts) => element("li", { hidden: true }, ...parts);
    this.#meanings = [
      ...Object.entries(names).map(([type, name]) => ({
        isSeen: (drawing) => drawing.type === type,
        item: item(swatch(bifurcations[type]), `${type}: ${name}`),
      })),
      {
        isSeen: ({ dashed }) => dashed,
        item: item("Dashed: no motion follows it, as its orbits are not admissible."),
      },
      {
        isSeen: ({ thin, type }) => thin && type,
        item: item("Thin: the motion is unstable on both sides."),
      },
      {
        isSeen: ({ shape }) => shape === "circle",
        item: item(
          element("span", {}, "Circles: half periods after which the graze recurs: ", ...orders.flatMap(numbered)),
        ),
      },
    ];
    byId("curve-legend").append(...this.#meanings.map((meaning) => meaning.item));
  }

  // Says what the curves and marks that are drawn mean.
  explain({ lines, marks }) {
    const drawn = [...lines, ...marks];
    for (const { isSeen, item } of this.#meanings) item.hidden = !drawn.some(isSeen);
  }

  // Shows the motions with their shares, the largest first, or the range of a layer's values.
  show(state, motions, range) {
    const { field } = LAYERS[state.layer];
    byId("ramp").hidden = !field;
    byId("legend").hidden = Boolean(field);
    if (field) this.#showRamp(state, range);
    else this.#showMotions(motions);
  }

  #showRamp({ layer, machine }, range) {
    const { text, unit = "", quantity, diverging, white } = LAYERS[layer];
    const name = `${named(text, machine, quantity)}${unit && ` ${unit}`}`;
    byId("ramp-white").textContent = `White: ${white}.`;
    byId("ramp").className = diverging ? "diverging" : "sequential";
    byId("ramp-text").textContent = range
      ? `${name}: ${toRead(range[0])} to ${toRead(range[1])}${range[2] ? " or more" : ""}`
      : `${name}: comes with the complete tiles; the motions stand, pale`;
  }

  #showMotions(all) {
    const first = all.slice(0, NAMED);
    const signature = JSON.stringify([first, [...this.hidden], this.colours.version]);
    if (signature === this.#shown) return; // so that a box keeps the focus
    this.#shown = signature;
    const focused = document.activeElement?.value;
    byId("legend").replaceChildren(...first.map(({ label, share }) => this.#entry(label, share)));
    const others = all.length - first.length;
    const more = others === 1 ? "and one other" : `and ${others} others`;
    if (others) byId("legend").append(element("li", { textContent: more }));
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
    const { colour, image } = this.colours.of(label);
    return element("li", {}, element("label", {}, box, swatch(colour, image), `${label} `, part));
  }
}
