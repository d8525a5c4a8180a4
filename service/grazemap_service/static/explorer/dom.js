// Elements of the page.

/** @type {(id: string) => any} */
export const byId = (id) => document.getElementById(id);

export const isPhone = () => matchMedia("(max-width: 48rem)").matches; // as in the style sheet

// An element with properties, attributes (names with a hyphen, and `role`) and children.
/** @returns {any} */
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.includes("-") || key === "role") made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children);
  return made;
}

// A square of a colour, with stripes as a background of CSS where there are some.
export function swatch(colour, image = "none") {
  const square = element("i", { className: "swatch" });
  square.style.backgroundColor = colour;
  square.style.backgroundImage = image;
  return square;
}

// A word that leads to the glossary of the guide, where it stands under a heading.
export const term = (textContent, heading = "periodic-orbits") =>
  element("a", {
    className: "term",
    target: "_blank",
    href: `guide/glossary.html#${heading}:~:text=${encodeURIComponent(textContent)}`,
    textContent,
  });

const POINT = /^[+-]?\d+,\d+$/; // a number with a comma in place of the point

// What is wrong with a text that is no number.
export const notNumber = (text) =>
  `“${text}” is not a number${POINT.test(text) ? `; write ${text.replace(",", ".")}` : ""}`;

// The number in a field, inside a domain, which is closed where it has an upper end or is said to be; null, and the
// field says what is wrong, if there is none.
/** @param {any} field  @param {Interval} [domain] */
export function numberOf(field, [low, high] = [0, Infinity], { isClosed = high < Infinity } = {}) {
  const text = field.value.trim();
  const value = Number(text || NaN);
  const least = low > -Infinity ? ` ${isClosed ? ">=" : ">"} ${low}` : "";
  const ends = high < Infinity ? ` from ${low} to ${high}` : least;
  const isThere = isClosed ? low <= value && value <= high : low < value && value < high;
  const wrong = Number.isFinite(value) ? `${text} is out of range` : notNumber(text);
  field.setCustomValidity(isThere ? "" : `${wrong}; allowed: numbers${ends}`);
  field.setAttribute("aria-invalid", !isThere);
  field.oninput = () => field.setCustomValidity("");
  return field.reportValidity() ? value : null;
}

const SVG = "http://www.w3.org/2000/svg";
export function drawing(name, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

export function save(name, blob) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
