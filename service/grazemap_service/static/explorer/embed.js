// The page as a part of another one: #...&embed=sliders,legend has the plane, the machine beside the pointer, and the
// controls that are named. The name of a slider, as restitution, stands for that one alone.
import { byId } from "./dom.js";
import { SLIDERS } from "./sliders.js";

const CONTROLS = ["sliders", "legend", "point", "colour", "zoom"];
export const EMBEDDED = [...CONTROLS, ...SLIDERS];

export const isFramed = window.top !== window;

// Whether a page with these controls has one of them; null: the page is whole.
export const hasControl = (controls, name) => !controls || controls.includes(name);

// The sliders that a page with these controls has.
export const slidersOf = (controls) =>
  hasControl(controls, "sliders") ? SLIDERS : SLIDERS.filter((name) => controls.includes(name));

// Shows these controls alone, and in a frame a link to the whole page of the same view, at `address`.
export function showControls(controls, address) {
  const { dataset } = document.documentElement;
  if (controls) {
    const some = slidersOf(controls).length ? ["sliders"] : [];
    dataset.embed = [...new Set([...controls.filter((name) => CONTROLS.includes(name)), ...some])].join(" ");
  } else delete dataset.embed;
  Object.assign(byId("whole"), { hidden: !controls && !isFramed, href: address });
}
