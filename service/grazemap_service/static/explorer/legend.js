// The legend: the motions in the view, which one switches off and on, or the ramp of a value.
import { byId, element, swatch } from "./dom.js";
import { NAMED, isFree, rampOf } from "./labels.js";
import { inWords } from "./motionwords.js";
import { LAYERS, percent } from "./layers.js";
import { toRead } from "./ticks.js";
import { named, shown } from "./units.js";

const FIRST = 8; // motions that are named until more are asked for

export class Legend {
  hidden = new Set();
  #shown = "";
  #isWhole = false;
  #hasGrown = false; // since it was shown last
  #meanings = [];
  #inSight = { motions: [], ramp: null, key: "" };

  // `names` are those of bifurcations, `meanings` what they do; `changed` is called when a motion was switched off or on.
  constructor({ colours, names, meanings, changed }) {
    this.colours = colours;
    this.changed = changed;
    const { bifurcations, orders } = colours.palette;
    this.#meanings = [
      ...Object.entries(names).map(([type, name]) => ({
        isSeen: (drawing) => drawing.type === type,
        colours: [bifurcations[type]],
        shape: "diamond",
        text: `${type}: ${name}; ${meanings[type]}`,
      })),
      {
        isSeen: ({ isGraze }) => isGraze,
        text: "Bold line: the grazing curve; on it the motion without impacts just touches a stop.",
      },
      { isSeen: ({ dashed }) => dashed, text: "Dashed: no motion follows it, as a stop is met before." },
      {
        isSeen: ({ isBorder }) => isBorder,
        text: "Thin lines: borders between motions; point at one, or press it, to read why it is there.",
      },
      { isSeen: ({ thin, type }) => thin && type, text: "Thin: the motion is unstable on both sides." },
      {
        isSeen: ({ shape, order }) => shape === "circle" && order,
        text: "Circles: the touch recurs after so many half periods:",
        numbered: orders,
        shape: "circle",
      },
      {
        isSeen: ({ shape, order }) => shape === "circle" && !order,
        text: "Dark circles: both stops are touched, or one stop twice in a period.",
      },
    ].map((/** @type {any} */ { colours: before = [], numbered = [], ...meaning }) => {
      const shaped = (colour) => Object.assign(swatch(colour), { className: `swatch ${meaning.shape}` });
      const after = numbered.flatMap((colour, k) => [shaped(colour), ` ${k + 1} `]);
      const parts = [...before.map(shaped), element("span", {}, `${meaning.text} `, ...after)];
      return { ...meaning, before, numbered, item: element("li", { hidden: true }, ...parts) };
    });
    byId("curve-legend").append(...this.#meanings.map((meaning) => meaning.item));
  }

  // Says what the curves and marks in a window mean.
  explain(scene, window) {
    const drawn = this.#drawn(scene, window);
    for (const meaning of this.#meanings) meaning.item.hidden = !drawn.some(meaning.isSeen);
  }

  // The curves and marks in a window.
  #drawn({ lines, marks }, { x, y }) {
    const meets = ([low, high], ...ends) => Math.max(...ends) >= low && Math.min(...ends) <= high;
    const isSeen = (line) =>
      line.x.some((value, k) => {
        const near = k && line.y[k - 1] !== null ? k - 1 : k; // a line may pass between its points
        return line.y[k] !== null && meets(x, value, line.x[near]) && meets(y, line.y[k], line.y[near]);
      });
    return [...lines.filter(isSeen), ...marks.filter((mark) => meets(x, mark.x) && meets(y, mark.y))];
  }

  // What the legend says of what is in sight in a window: { motions, ramp, key, meanings }. Motions are { label, share },
  // meanings { text, before, numbered, shape } with their colours; `ramp` is { text, ends, missing, diverging } where
  // values are shown, `key` the text that explains motions elsewhere.
  inSight(scene, window) {
    const drawn = this.#drawn(scene, window);
    return { ...this.#inSight, meanings: this.#meanings.filter(({ isSeen }) => drawn.some(isSeen)) };
  }

  // Shows the motions with their shares, the largest first, or the range of a layer's values; `without` says
  // which points without values are there, as `withoutValues`.
  show(state, motions, range, without) {
    const { field } = LAYERS[state.layer];
    this.machine = state.machine;
    byId("legend-key").hidden = byId("legend-hides").hidden = Boolean(field);
    byId("ramp").hidden = !field;
    byId("legend").hidden = Boolean(field);
    if (field) this.#showRamp(state, range, without);
    else this.#showMotions(motions);
    const ramp = field && { ...this.#rampOf(state, range, without), diverging: LAYERS[state.layer].diverging };
    const key = field ? "" : byId("legend-key").textContent.replace(/\s+/g, " ");
    const others = Math.max(0, motions.length - NAMED);
    this.#inSight = {
      motions: motions.slice(0, NAMED).filter(({ label }) => !this.hidden.has(label)),
      ramp,
      key: others ? `And ${others === 1 ? "one other" : `${others} others`}. ${key}` : key,
    };
  }

  #rampOf({ layer, machine }, range, { isCream, isPale }) {
    const { text: what, unit = "", quantity, missing, diverging } = LAYERS[layer];
    const name = `${named(what, machine, quantity)}${unit && ` ${unit}`}`;
    const value = (end) => toRead(shown(machine, quantity, end));
    const [below, above] = range?.[2] ? [diverging ? " or less" : "", " or more"] : ["", ""];
    const text = range
      ? `${name}: ${value(range[0])}${below} to ${value(range[1])}${above}`
      : `${name}: being computed; what is pale has no such value yet`;
    const ends = range ? [range[0], (range[0] + range[1]) / 2, range[1]].map(value) : [];
    const cream = isCream ? " Cream: no impacts." : "";
    const pale = isPale ? " Pale: motions, until the values come." : "";
    return { text, ends, missing: `Grey: ${missing}.${cream}${pale}` };
  }

  #showRamp(state, range, without) {
    const { text, ends, missing } = this.#rampOf(state, range, without);
    byId("ramp-missing").textContent = missing;
    const colours = rampOf(LAYERS[state.layer].diverging);
    byId("ramp-ends").replaceChildren(...ends.map((textContent) => element("span", { textContent })));
    byId("ramp").querySelector("span").style.backgroundImage = `linear-gradient(90deg, ${colours.join(", ")})`;
    byId("ramp-text").textContent = text;
  }

  #showMotions(all) {
    const most = this.#isWhole ? NAMED : FIRST;
    const first = all.slice(0, most);
    const signature = JSON.stringify([first, all.length, [...this.hidden], this.colours.version, this.machine.stops]);
    if (signature === this.#shown) return; // so that a button keeps the focus
    this.#shown = signature;
    const focused = document.activeElement?.getAttribute("value");
    byId("legend").replaceChildren(...first.map(({ label, share }) => this.#entry(label, share)));
    const others = all.length - first.length;
    if (others) byId("legend").append(this.#rest(others, first.length < Math.min(all.length, NAMED)));
    if (first.length > FIRST) byId("legend").append(this.#grows("fewer", false));
    const buttons = [...byId("legend").querySelectorAll("button")];
    if (this.#hasGrown) buttons[FIRST]?.focus();
    else if (focused) buttons.find(({ value }) => value === focused)?.focus();
    this.#hasGrown = false;
  }

  // Says how many motions are left out, and shows more of them if they have colours of their own.
  #rest(others, hasMore) {
    const text = others === 1 ? "one other" : `${others} others`;
    if (!hasMore) return element("li", { textContent: `and ${text}` });
    return this.#grows(`and ${text} …`, true);
  }

  // A button that shows the whole legend, or its first motions.
  #grows(textContent, isWhole) {
    const button = element("button", { type: "button", textContent });
    button.addEventListener("click", () => {
      this.#isWhole = isWhole;
      this.#hasGrown = isWhole;
      this.changed();
    });
    return element("li", {}, button);
  }

  #entry(label, share) {
    const { colour, image } = this.colours.of(label);
    const part = element("small", { textContent: percent(share) });
    const name = isFree(label) ? `${label}, no impacts` : label;
    const words = inWords(label, this.machine);
    const title = words ? `${words}. Press to hide or show it.` : "Press to hide or show it.";
    const pressed = { type: "button", value: label, title, "aria-pressed": !this.hidden.has(label) };
    const button = element("button", pressed, swatch(colour, image), name, part);
    button.addEventListener("click", () => {
      if (!this.hidden.delete(label)) this.hidden.add(label);
      this.changed();
    });
    return element("li", {}, button);
  }
}
