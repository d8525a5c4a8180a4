// What one takes home: the link, pictures, data and code.
import { mapOf, send } from "./api.js";
import { asCurl, asPython } from "./code.js";
import { byId, save } from "./dom.js";
import { LAYERS } from "./layers.js";
import { FIXED, parameter } from "./parameters.js";
import { asPng, asText, picture } from "./picture.js";
import { STARTS } from "./starts.js";
import { toRead } from "./ticks.js";
import { named, shown } from "./units.js";

// Copies a text, which is shown too where it is one to read, and where it cannot be copied.
async function copy(text, what, { isShown = false } = {}) {
  const show = () => {
    byId("to-copy").value = text;
    byId("to-copy").hidden = false;
  };
  if (isShown) show();
  try {
    await navigator.clipboard.writeText(text);
    byId("copied").textContent = `${what} copied.`;
  } catch {
    // clipboards need a secure address: the text is shown instead
    byId("copied").textContent = "Copy this:";
    show();
    byId("to-copy").select();
  }
}

const isThere = (tile) => Boolean(tile.labels);

// How a file of a view that is not complete is named, and what the page says of it; nothing of a complete one.
function partOf(tiles) {
  const count = tiles.filter(isThere).length;
  if (count === tiles.length) return { name: "", text: "" };
  return {
    name: `-${count}-of-${tiles.length}-tiles`,
    text: `The file has ${count} of the ${tiles.length} tiles, as yet.`,
  };
}

const READABLE = 100; // characters of a link that a picture shows
const FIGURES = [LAYERS.exponent, LAYERS.speed];

// The points of tiles inside a window, as text with commas: by rows, from below. Those of a tile that is not there are
// "not computed".
/** @param {Tile[]} tiles  @param {State} state */
export function asCsv(tiles, { plane, x, y, machine, layer }) {
  const fields = [...FIGURES, ...[LAYERS[layer]].filter((chosen) => chosen?.field && !FIGURES.includes(chosen))];
  const head = (name, quantity) => named(name, machine, quantity);
  const quantities = [plane.horizontal, plane.vertical].map((name) => parameter(name).quantity);
  const axes = [head(plane.horizontal, quantities[0]), head(plane.vertical, quantities[1])];
  const inAxes = (...point) => point.map((value, k) => shown(machine, quantities[k], value));
  const heads = fields.map(({ field, quantity }) => head(field, quantity));
  const lines = [[...axes, "motion", "verified", "sensitive", ...heads].join(",")];
  const places = ([low, high], points, [from, to]) =>
    Array.from({ length: points }, (_, k) => ({ k, value: low + ((k + 0.5) * (high - low)) / points })).filter(
      ({ value }) => from <= value && value <= to,
    );
  const values = (tile, k) => {
    if (!isThere(tile)) return ["not computed", "", "", ...fields.map(() => "")];
    const figures = fields.map(({ field, quantity }) =>
      Number.isFinite(tile[field]?.[k]) ? shown(machine, quantity, tile[field][k]) : "",
    );
    return [tile.labels[tile.motion[k]], tile.verified[k], tile.sensitive[k], ...figures];
  };
  const bands = Map.groupBy(
    [...tiles].sort((tile, other) => tile.y[0] - other.y[0] || tile.x[0] - other.x[0]),
    (tile) => tile.y[0],
  );
  for (const band of bands.values())
    for (const up of places(band[0].y, band[0].points, y))
      for (const tile of band)
        for (const across of places(tile.x, tile.points, x))
          lines.push([...inAxes(across.value, up.value), ...values(tile, up.k * tile.points + across.k)].join(","));
  return `${lines.join("\n")}\n`;
}

// What a picture says of itself below it.
async function captionOf({ state, names, tiles, inUnits, link, open, pending }) {
  const { version } = await (await send("v1")).json();
  const axis = (name, [low, high]) => `${name} ${toRead(low, high - low)} to ${toRead(high, high - low)}`;
  const { x, y } = inUnits(state);
  const { plane, machine, layer, policy } = state;
  const fixed = FIXED.filter((name) => plane[name] !== null).map((name) => {
    const { text, quantity } = parameter(name, machine);
    return `${named(text, machine, quantity)} ${toRead(shown(machine, quantity, plane[name]))}`;
  });
  return [
    `${[axis(names.x, x), axis(names.y, y), ...fixed].join("; ")}.`,
    ...(open ? [`${open}.`] : []),
    ...(pending.length ? [`Not there yet: ${pending.join(", ")}.`] : []),
    `${LAYERS[layer].text} ${STARTS[policy].phrase}, ${machine.periods} forcing periods watched. ${partOf(tiles).text}`,
    `grazemap ${version}${link.length > READABLE ? "" : `, ${link}`}`,
  ];
}

async function pictureOf(view) {
  const blob = await view.image.convertToBlob();
  const reader = new FileReader();
  const image = await new Promise((done) => {
    reader.onload = () => done(reader.result);
    reader.readAsDataURL(blob);
  });
  const caption = await captionOf(view);
  const { width, height } = view.image;
  return picture({ ...view, view: view.state, machine: view.state.machine, size: { width, height }, image, caption });
}

// `now()` is { state, link, tiles, lines, marks, at, open, names, image, legend, pending, lookOf, ranges }: all tiles of the view, the
// middle one last, those that are not complete with their points alone; `ranges(most)` those of the points of the view.
export function offer(now) {
  let again = null; // saves a picture as the last one
  let waiting = null; // the same, when all tiles are there
  const tell = (error) => {
    byId("copied").textContent = error.message;
  };
  byId("save-later").addEventListener("click", () => {
    waiting = again;
    byId("save-later").hidden = true;
    byId("save-png").focus();
    byId("copied").textContent = "The picture will be saved when all tiles are there.";
  });
  const address = new URL(".", location.href).href.replace(/\/$/, "");
  const on = (id, task) =>
    byId(id).addEventListener("click", async () => {
      byId("to-copy").hidden = byId("save-later").hidden = true;
      byId("copied").textContent = "";
      try {
        await task(now());
      } catch (error) {
        tell(error);
      }
    });
  const place = ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname)
    ? ", to the service of this machine,"
    : "";
  on("copy-link", () => copy(location.href, `The link${place} was`));
  on("copy-frame", () => {
    const link = `${location.href}${location.hash ? "&" : "#"}embed=sliders,legend,point`.replaceAll("&", "&amp;");
    const style = "width: 100%; height: 520px; border: 0";
    const lines = `<iframe src="${link}" style="${style}" title="A map of impacts"></iframe>`;
    return copy(lines, `The lines for a page, as below${place}, were`, { isShown: true });
  });
  const withoutBorders = ({ state }) => (state.borders ? ", without the explained borders," : "");
  const limited = async ({ ranges }) => ranges((await (await send("v1")).json()).limits.pixels);
  on("copy-python", async (view) =>
    copy(asPython(view.state, await limited(view), address), `Python${withoutBorders(view)} was`),
  );
  on("copy-curl", async (view) => copy(asCurl(view.state, await limited(view), address), "The command was"));
  const savePicture = (kind, blobOf) =>
    on(`save-${kind}`, async (view) => {
      await savedPicture(view);
      again = () => savedPicture(now()).catch(tell);
      byId("save-later").hidden = !partOf(view.tiles).name;

      async function savedPicture(seen) {
        const part = partOf(seen.tiles);
        save(`grazemap${part.name}.${kind}`, await blobOf(await pictureOf(seen)));
        byId("copied").textContent = part.text || "The picture was saved.";
      }
    });
  savePicture("png", asPng);
  savePicture("svg", (svg) => new Blob([asText(svg)], { type: "image/svg+xml" }));
  on("save-csv", ({ state, tiles }) => {
    if (!tiles.some(isThere)) throw new Error("No tile of this window is complete yet.");
    const part = partOf(tiles);
    save(`grazemap${part.name}.csv`, new Blob([asCsv(tiles, state)], { type: "text/csv" }));
    byId("copied").textContent = part.text
      ? `${part.text} The points of the others are “not computed”.`
      : "The table was saved.";
  });
  on("save-npz", async ({ tiles }) => {
    const tile = tiles.at(-1);
    if (!tile || !isThere(tile)) throw new Error("The tile in the middle is not complete yet.");
    save(`grazemap-${tile.id.slice(0, 12)}.npz`, new Blob([await mapOf(tile.id, tile.request)]));
    byId("copied").textContent = "The tile in the middle was saved.";
  });
  return {
    // To be called when all tiles of the view are there.
    complete: () => {
      waiting?.();
      waiting = null;
    },
    // To be called when another view is shown; returns what the page tells of a picture that is not saved then.
    dropped: () => {
      if (!waiting) return "";
      waiting = null;
      byId("copied").textContent = "";
      return "Another view is shown: the picture was not saved again.";
    },
  };
}
