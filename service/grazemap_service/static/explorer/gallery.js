// The gallery: a card for each place worth seeing, with a small map that is computed when it is first looked at.
import { compute, isAborted } from "./api.js";
import { byId, element, swatch } from "./dom.js";
import { Colours } from "./labels.js";
import { LAYERS, paint, rangeOf } from "./layers.js";
import { USUAL } from "./parameters.js";
import { PLACES } from "./places.js";
import * as requests from "./requests.js";

// a preview, of few points along a side, comes before what the plane below asks for, the rest after it
const STEPS = [
  { points: 24, priority: 7, preview: true, atOnce: 3 },
  { points: 48, priority: 1, preview: false, atOnce: 1 },
];

const rangeIn = ([low, high], points) => {
  const half = (high - low) / points / 2;
  return { start: low + half, stop: high - half, points };
};

export class Gallery {
  #cards = null;
  #abort = null;

  // `addressOf(place)` is the link of a place, `decode(buffer)` a promise of what a map has; `opened(place, address)` is
  // called with a place whose link was pressed.
  constructor({ addressOf, decode, palette, opened }) {
    this.opened = opened;
    this.addressOf = addressOf;
    this.decode = decode;
    this.palette = palette;
    this.dialog = byId("gallery");
    byId("open-gallery").addEventListener("click", () => this.#open());
    this.dialog.addEventListener("close", () => this.#abort.abort());
    this.dialog.addEventListener("click", ({ target }) => {
      if (target === this.dialog || target.closest("a, button")) this.dialog.close();
    });
  }

  #open() {
    this.#cards ??= PLACES.map((place) => this.#card({ plane: USUAL, layer: "motion", ...place }));
    byId("places").replaceChildren(...this.#cards.map(({ item }) => item));
    this.dialog.showModal();
    this.#abort = new AbortController();
    this.#draw(this.#abort.signal);
  }

  #card(place) {
    const canvas = element("canvas");
    const motions = element("small");
    const href = this.addressOf(place);
    const link = element("a", { href }, canvas, element("b", { textContent: place.text }));
    link.append(element("span", { textContent: place.says }), motions);
    link.addEventListener("click", ({ ctrlKey, metaKey, shiftKey }) => {
      if (!ctrlKey && !metaKey && !shiftKey) this.opened(place, href); // else it opens beside this page
    });
    return { place, canvas, motions, colours: new Colours(this.palette), points: 0, item: element("li", {}, link) };
  }

  // Draws coarse pictures soon, then fine ones where nothing else is asked for.
  async #draw(signal) {
    for (const step of STEPS) {
      const left = this.#cards.filter(({ points }) => points < step.points);
      const oneByOne = async () => {
        while (left.length && !signal.aborted) await this.#picture(left.shift(), step, signal);
      };
      await Promise.all(Array.from({ length: step.atOnce }, oneByOne));
    }
  }

  async #picture(card, step, signal) {
    try {
      await this.#paint(card, step, signal);
      card.points = step.points;
    } catch (error) {
      if (!isAborted(error)) card.motions.textContent = error.message;
    }
  }

  async #paint({ place, canvas, motions, colours }, { points, priority, preview }, signal) {
    const { machine, plane, x, y, layer, shows } = place;
    if (preview && LAYERS[layer].field) return; // previews have motions alone
    const request = requests.map(machine, plane, rangeIn(x, points), rangeIn(y, points), { preview });
    const { data } = await compute("unfolding-maps", request, { npz: true, priority, signal });
    const tile = { ...(await this.decode(data)), points };
    colours.see([...new Set([...shows, ...tile.labels])]);
    const image = paint(tile, layer, { hidden: new Set(), range: rangeOf(layer, [tile]), colours });
    Object.assign(canvas, { width: points, height: points }).getContext("2d").drawImage(image, 0, 0);
    const named = ({ colour, image: stripes }, label) => element("span", {}, swatch(colour, stripes), label);
    if (layer === "motion") motions.replaceChildren(...shows.map((label) => named(colours.of(label), label)));
  }
}
