// The legend: the motions in the view, which one switches off and on, or the ramp of a value.
import { byId, element, swatch } from "./dom.js";
import { NAMED } from "./labels.js";
import { LAYERS, percent } from "./layers.js";
import { toRead } from "./ticks.js";
import { named } from "./units.js";

const FIRST = 8; // motions that are named until more are asked for

const numbered = (colour, k) => [swatch(colour), ` ${k + 1} `];

export class Legend {
  hidden = new Set();
  #shown = "";
  #isWhole = false;
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

  // Says what the curves and marks in a window mean.
  explain({ lines, marks }, { x, y }) {
    const inside = (value, [low, high]) => value !== null && low <= value && value <= high;
    const drawn = [
      ...lines.filter((line) => line.x.some((value, k) => inside(value, x) && inside(line.y[k], y))),
      ...marks.filter((mark) => inside(mark.x, x) && inside(mark.y, y)),
    ];
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
    const most = this.#isWhole ? NAMED : FIRST;
    const first = all.slice(0, most);
    const signature = JSON.stringify([first, all.length, [...this.hidden], this.colours.version]);
    if (signature === this.#shown) return; // so that a button keeps the focus
    this.#shown = signature;
    const focused = document.activeElement?.value;
    byId("legend").replaceChildren(...first.map(({ label, share }) => this.#entry(label, share)));
    const others = all.length - first.length;
    if (others) byId("legend").append(this.#rest(others, first.length < Math.min(all.length, NAMED)));
    if (focused)
      byId("legend")
        .querySelector(`button[value="${CSS.escape(focused)}"]`)
        ?.focus();
  }

  // Says how many motions are left out, and shows more of them if they have colours of their own.
  #rest(others, hasMore) {
    const text = others === 1 ? "one other" : `${others} others`;
    if (!hasMore) return element("li", { textContent: `and ${text}` });
    const more = element("button", { type: "button", textContent: `and ${text} …` });
    more.addEventListener("click", () => {
      this.#isWhole = true;
      this.changed();
    });
    return element("li", {}, more);
  }

  #entry(label, share) {
    const { colour, image } = this.colours.of(label);
    const part = element("small", { textContent: percent(share) });
    const pressed = { type: "button", value: label, title: "Hide or show", "aria-pressed": !this.hidden.has(label) };
    const button = element("button", pressed, swatch(colour, image), label, part);
    button.addEventListener("click", () => {
      if (!this.hidden.delete(label)) this.hidden.add(label);
      this.changed();
    });
    return element("li", {}, button);
  }
}
