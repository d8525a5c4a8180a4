// The page as a part of another one: #...&embed=sliders,legend has the plane, the machine beside the pointer, and the
// controls that are named.
import { byId } from "./dom.js";

const CONTROLS = ["sliders", "legend", "point", "colour", "zoom"];

export const isFramed = window.top !== window;

// The controls that the address names; null: the page is whole.
export function controlsOf(query) {
  const names = query.get("embed")?.split(",");
  return names ? CONTROLS.filter((name) => names.includes(name)) : null;
}

// Whether a page with these controls has one of them.
export const hasControl = (controls, name) => !controls || controls.includes(name);

// Shows these controls alone, and in a frame a link to the whole page of the same view, at `address`.
export function showControls(controls, address) {
  const { dataset } = document.documentElement;
  if (controls) dataset.embed = controls.join(" ");
  else delete dataset.embed;
  Object.assign(byId("whole"), { hidden: !controls && !isFramed, href: address });
}
