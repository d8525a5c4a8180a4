// The map of the first page: computed by this service when the page is opened, drawn on a canvas.
const WINDOW = { omega: { start: 0.26, stop: 0.30 }, clearance: { start: 1.3, stop: 2.05 } };
const POINTS = { omega: 144, clearance: 96 };
const MARGIN = { left: 96, right: 36, top: 15, bottom: 56 };
const PERIODS = { transient_periods: 300, periods: 12 };
const NAMED_IN_LEGEND = 14;

const map = document.getElementById("map"), motion = document.getElementById("motion");
const says = document.getElementById("says"), back = document.getElementById("back");
const palette = await (await fetch("static/palette.json")).json();
let shown = null; // { umap, curve, cells, strokes } of the last map
let asked = 0;    // number of the last question: answers to earlier ones are not shown

const SUPERSEDED = new Error("superseded");
const BUSY = [429, 502, 503, 504], PAUSE = 500;

// The answer as { status, body }; waits while the service is busy. Throws what a problem says.
async function ask(number, path, options) {
  for (;;) {
    const answer = await fetch(path, options);
    if (number !== asked) throw SUPERSEDED;
    const body = await answer.json().catch(() => ({}));
    if (answer.ok) return { status: answer.status, body };
    if (answer.status === 401) throw new Error("This service computes with a key only.");
    if (!BUSY.includes(answer.status)) throw new Error(body.detail ?? `The service answers ${answer.status}.`);
    says.value = body.detail ?? "The service is busy.";
    await new Promise((resolve) => setTimeout(resolve, 4 * PAUSE));
  }
}

// The result of a process, and whether it was stored.
async function compute(number, process, request) {
  const headers = { "Content-Type": "application/json", Prefer: "wait=10" };
  const sent = await ask(number, `v1/${process}`, { method: "POST", headers, body: JSON.stringify(request) });
  let job = sent.body;
  for (;;) {
    while (!["successful", "failed", "dismissed"].includes(job.status)) {
      says.value = job.waiting_for ? `Waiting for ${job.waiting_for}`
        : `Computing: ${job.progress.done} of ${job.progress.total} parts`;
      await new Promise((resolve) => setTimeout(resolve, PAUSE));
      job = (await ask(number, `v1/jobs/${job.id}`)).body;
    }
    if (job.status !== "successful") throw new Error(job.problem?.detail ?? `The job is ${job.status}.`);
    const { status, body } = await ask(number, `v1/jobs/${job.id}/result`, { headers: { Accept: "application/json" } });
    if (status === 200) return { result: body, stored: sent.status === 200 };
    job = body; // the result was no longer stored, and is computed again
  }
}

const motionAt = (umap, row, column) => umap.motions[umap.motion[row][column]];
const isSensitive = (umap, row, column) => umap.sensitive?.[row][column] ?? false;

// Lengths on the canvas for omega and clearance, and back.
const inner = { width: map.width - MARGIN.left - MARGIN.right, height: map.height - MARGIN.top - MARGIN.bottom };
const ends = (values) => [values[0], values[values.length - 1]];
function scales({ omega, clearance }) {
  const [left, right] = ends(omega), [low, high] = ends(clearance);
  return {
    x: (w) => MARGIN.left + (w - left) / (right - left) * inner.width,
    y: (b) => MARGIN.top + (high - b) / (high - low) * inner.height,
    omega: (x) => left + (x - MARGIN.left) / inner.width * (right - left),
    clearance: (y) => high - (y - MARGIN.top) / inner.height * (high - low),
  };
}

function axis(pen, canvas, values, place, horizontal, text) {
  pen.fillStyle = pen.strokeStyle = palette.ink;
  pen.font = "16px system-ui, sans-serif";
  pen.textAlign = horizontal ? "center" : "right";
  pen.textBaseline = horizontal ? "top" : "middle";
  const [first, last] = ends(values), bottom = canvas.height - MARGIN.bottom;
  // steps of 1, 2 or 5 times a power of ten, at most six of them
  const power = 10 ** Math.floor(Math.log10((last - first) / 5));
  const step = power * [1, 2, 5, 10].find((factor) => (last - first) / (factor * power) <= 6);
  for (let k = Math.ceil(first / step - 1e-9); k * step <= last + 1e-9 * step; k++) {
    const number = Number((k * step).toPrecision(6)).toString();
    if (horizontal) pen.fillText(number, place(k * step), bottom + 8);
    else pen.fillText(number, MARGIN.left - 8, place(k * step));
  }
  pen.save();
  pen.textAlign = "center";
  if (horizontal) pen.fillText(text, MARGIN.left + inner.width / 2, bottom + 32);
  else {
    pen.translate(12, (MARGIN.top + bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(text, 0, 0);
  }
  pen.restore();
}

function drawMap(selected) {
  const { umap, curve, cells, strokes } = shown, pen = map.getContext("2d"), scale = scales(umap);
  pen.clearRect(0, 0, map.width, map.height);
  pen.imageSmoothingEnabled = false;
  pen.drawImage(cells, MARGIN.left, MARGIN.top, inner.width, inner.height);
  pen.save();
  pen.beginPath();
  pen.rect(MARGIN.left, MARGIN.top, inner.width, inner.height);
  pen.clip();
  const line = new Path2D();
  curve.omega.forEach((w, i) => line.lineTo(scale.x(w), scale.y(curve.clearance[i])));
  for (const [path, width, colour] of [[strokes, 3, palette.paper], [strokes, 1.5, palette.ink],
    [line, 5, palette.ink], [line, 2, palette.paper]]) {
    pen.lineWidth = width;
    pen.strokeStyle = colour;
    pen.stroke(path);
  }
  if (selected) {
    pen.strokeStyle = palette.ink;
    pen.setLineDash([6, 4]);
    pen.strokeRect(...selected);
  }
  pen.restore();
  axis(pen, map, umap.omega, scale.x, true, "forcing frequency ω");
  axis(pen, map, umap.clearance, scale.y, false, "clearance b");
}

// One dot for each point of a map.
function cellsOf(umap) {
  const cells = new OffscreenCanvas(umap.omega.length, umap.clearance.length), dots = cells.getContext("2d");
  umap.clearance.forEach((_, row) => umap.omega.forEach((_, column) => {
    dots.fillStyle = motionAt(umap, row, column).colour;
    dots.fillRect(column, umap.clearance.length - 1 - row, 1, 1);
  }));
  return cells;
}

// A stroke on each sensitive point of a map.
function strokesOf(umap) {
  const strokes = new Path2D(), across = inner.width / umap.omega.length, up = inner.height / umap.clearance.length;
  umap.clearance.forEach((_, row) => umap.omega.forEach((_, column) => {
    if (!isSensitive(umap, row, column)) return;
    const x = MARGIN.left + column * across, y = MARGIN.top + inner.height - row * up;
    strokes.moveTo(x, y);
    strokes.lineTo(x + across, y - up);
  }));
  return strokes;
}

function drawLegend({ motions, sensitive = [] }) {
  const entry = (text, share, colour) => {
    const line = document.createElement("li"), square = document.createElement("i");
    if (colour) square.style.backgroundColor = colour;
    line.append(square, `${text} (${(100 * share).toFixed(1)} %)`);
    return line;
  };
  const named = motions.slice(0, NAMED_IN_LEGEND), others = motions.slice(NAMED_IN_LEGEND);
  const lines = named.map(({ label, share, colour }) => entry(label, share, colour));
  if (others.length) lines.push(entry(`${others.length} others`, others.reduce((sum, { share }) => sum + share, 0)));
  const points = sensitive.flat(), found = points.filter(Boolean).length;
  if (found) lines.push(entry("sensitive", found / points.length));
  document.getElementById("legend").replaceChildren(...lines);
}

async function showMap(window) {
  const number = ++asked, began = performance.now();
  says.value = "Computing …";
  const sampled = Object.fromEntries(Object.keys(POINTS).map((name) => [name, { ...window[name], points: POINTS[name] }]));
  const [{ result: umap, stored }, { result: curve }] = await Promise.all([
    compute(number, "unfolding-maps", { ...sampled, preview: true }),
    compute(number, "grazing-curves", { omega: { ...window.omega, points: 400 } }),
  ]);
  shown = { umap, curve, cells: cellsOf(umap), strokes: strokesOf(umap) };
  back.hidden = window === WINDOW;
  drawLegend(umap);
  drawMap();
  says.value = `${umap.omega.length} × ${umap.clearance.length} points, ${umap.motions.length} motions,`
    + ` computed by this service ${stored ? "before" : `in ${((performance.now() - began) / 1000).toFixed(1)} s`}.`;
}

async function showMotion(omega, clearance) {
  const number = ++asked;
  says.value = "Computing a trajectory …";
  const request = { omega, clearance, ...PERIODS, samples_per_period: 200 };
  const { result: path } = await compute(number, "trajectories", request);
  motion.hidden = false;
  const pen = motion.getContext("2d"), [start, end] = ends(path.time), values = path.displacement[0];
  const bottom = motion.height - MARGIN.bottom, high = 1.1 * clearance;
  const x = (t) => MARGIN.left + (t - start) / (end - start) * inner.width;
  const y = (value) => MARGIN.top + (high - value) / (2 * high) * (bottom - MARGIN.top);
  pen.clearRect(0, 0, motion.width, motion.height);
  pen.fillStyle = palette.kinds.unresolved;
  for (const stop of [-clearance, clearance]) pen.fillRect(MARGIN.left, y(stop) - 1.5, inner.width, 3);
  pen.strokeStyle = palette.motions["1-2r-3l"];
  pen.lineWidth = 2;
  pen.beginPath();
  path.time.forEach((t, i) => pen.lineTo(x(t), y(values[i])));
  pen.stroke();
  axis(pen, motion, [-clearance, clearance], y, false, "displacement x₁");
  axis(pen, motion, [start, end], x, true, "time t");
  says.value = `At ω = ${omega.toPrecision(5)}, b = ${clearance.toPrecision(5)} the motion from rest is `
    + `${path.motion.label ?? path.motion.kind}${path.motion.reason ? `: ${path.motion.reason}` : "."}`;
}

function report(error) {
  if (error !== SUPERSEDED) says.value = error.message;
}

// Canvas coordinates of a pointer, inside the axes.
function place(event) {
  const box = map.getBoundingClientRect(), within = (value, low, size) => Math.min(low + size, Math.max(low, value));
  return [
    within((event.clientX - box.left) * map.width / box.width, MARGIN.left, inner.width),
    within((event.clientY - box.top) * map.height / box.height, MARGIN.top, inner.height),
  ];
}

let from = null;
map.addEventListener("pointerdown", (event) => {
  if (!shown) return;
  from = place(event);
  map.setPointerCapture(event.pointerId);
});
map.addEventListener("pointermove", (event) => {
  if (!shown) return;
  const [x, y] = place(event), { umap } = shown, scale = scales(umap);
  if (from) drawMap([Math.min(x, from[0]), Math.min(y, from[1]), Math.abs(x - from[0]), Math.abs(y - from[1])]);
  const nearest = (value, name, [first, last] = ends(umap[name])) =>
    Math.round((value - first) / (last - first) * (umap[name].length - 1));
  const row = nearest(scale.clearance(y), "clearance"), column = nearest(scale.omega(x), "omega");
  map.title = `ω = ${umap.omega[column].toPrecision(5)}, b = ${umap.clearance[row].toPrecision(5)}: ${motionAt(umap, row, column).label}`
    + (isSensitive(umap, row, column) ? ", sensitive" : "");
});
map.addEventListener("pointerup", (event) => {
  if (!from) return;
  const [x, y] = place(event), scale = scales(shown.umap), [x0, y0] = from;
  from = null;
  if (Math.abs(x - x0) < 5 || Math.abs(y - y0) < 5) {
    showMotion(scale.omega(x), scale.clearance(y)).catch(report);
    return;
  }
  const between = (one, other) => ({ start: Math.min(one, other), stop: Math.max(one, other) });
  showMap({
    omega: between(scale.omega(x0), scale.omega(x)),
    clearance: between(scale.clearance(y0), scale.clearance(y)),
  }).catch(report);
});
map.addEventListener("pointercancel", () => {
  from = null;
  if (shown) drawMap();
});
back.addEventListener("click", () => showMap(WINDOW).catch(report));
document.getElementById("address").textContent = new URL(".", location.href).href.replace(/\/$/, "");
showMap(WINDOW).catch(report);
