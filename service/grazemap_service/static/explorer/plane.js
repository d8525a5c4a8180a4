// The canvas of the plane: the window that it shows, and its picture of tiles, curves, marks and axes.
import { layout, paintAxes } from "./axes.js";
import { isPhone } from "./dom.js";
import { PALE } from "./layers.js";

const STRIP_ALPHA = 0.8;
const PREVIEW_ALPHA = 0.75;
const NEAR = 4; // pixels between places that are one for a pointer
const REACH = 6; // pixels within which a pointer is at a line
const MARK = 10; // pixels within which marks cover one another, and a pointer is at one
const SETTLED_AFTER = 250; // milliseconds without a further step, after which a window is a place in the history

// How lines and marks are drawn, here and in pictures: widths, what their rims add to these, and half the size of a mark.
export const DRAWN = { line: 1.75, thin: 1, rim: { line: 2.25, thin: 1.5 }, circle: 6, diamond: 7.2 };

// Strokes a path in a colour, with a rim that tells it from what is below: so much wider in white.
function rimmed(pen, width, colour, rim) {
  for (const [wide, stroke] of [
    [width + rim, "#FFFFFF"],
    [width, colour],
  ]) {
    pen.lineWidth = wide;
    pen.strokeStyle = stroke;
    pen.stroke();
  }
}

export class Plane {
  spot = null; // a place on the canvas that is marked
  box = null; // the rectangle that is being dragged, { from, to }
  #edges = { side: 0, strip: 0, font: 12 }; // the strips with the axes, over the picture, and the size of letters there
  #ratio = 1; // pixels of the screen in one of CSS
  #settling = null;
  #drawing = null;

  // `act` has moved(view), resized(), settled(), pick(point), point(place on the canvas or null), home(),
  // takesWheel() and mayZoomIn().
  constructor(canvas, act) {
    this.canvas = canvas;
    this.act = act;
    this.view = null;
    this.scene = { lines: [], marks: [] };
    this.domains = null;
    new ResizeObserver(() => {
      this.#resize();
      if (this.view) act.resized();
    }).observe(canvas);
    this.#resize();
    const follow = () =>
      matchMedia(`(resolution: ${this.#ratio}dppx)`).addEventListener(
        "change",
        () => {
          this.#resize(); // on a screen of another density the canvas may have the same size
          follow();
        },
        { once: true },
      );
    follow();
  }

  #resize() {
    this.#ratio = globalThis.devicePixelRatio || 1;
    const { clientWidth, clientHeight } = this.canvas;
    this.canvas.width = Math.round(clientWidth * this.#ratio);
    this.canvas.height = Math.round(clientHeight * this.#ratio);
    this.width = Math.max(1, clientWidth);
    this.height = Math.max(1, clientHeight);
    const style = getComputedStyle(this.canvas);
    const [side, strip] = ["--side", "--strip"].map((name) => parseFloat(style.getPropertyValue(name)));
    this.#edges = { side, strip, font: isPhone() ? 10 : 12 };
    this.draw();
  }

  get centre() {
    const middle = ([low, high]) => (low + high) / 2;
    return { x: middle(this.view.x), y: middle(this.view.y) };
  }

  // The middle of the plane on the canvas.
  get middle() {
    return { px: this.width / 2, py: this.height / 2 };
  }

  // Lengths on the canvas of values, and back.
  #px(x) {
    return ((x - this.view.x[0]) / (this.view.x[1] - this.view.x[0])) * this.width;
  }
  #py(y) {
    return ((this.view.y[1] - y) / (this.view.y[1] - this.view.y[0])) * this.height;
  }
  place({ x, y }) {
    return { px: this.#px(x), py: this.#py(y) };
  }
  value({ px, py }) {
    const { x, y } = this.view;
    return {
      x: x[0] + (px / this.width) * (x[1] - x[0]),
      y: y[1] - (py / this.height) * (y[1] - y[0]),
    };
  }

  inside({ px, py }) {
    return px >= 0 && px <= this.width && py >= 0 && py <= this.height;
  }

  holds({ x, y }) {
    const within = (value, [least, most]) => least < value && value < most;
    return within(x, this.domains.x) && within(y, this.domains.y);
  }

  // Shows another window; settles after a while unless another one follows.
  go(view, { now = false } = {}) {
    this.view = view;
    this.draw();
    this.act.moved(view);
    clearTimeout(this.#settling);
    if (now) this.act.settled();
    else this.#settling = setTimeout(() => this.act.settled(), SETTLED_AFTER);
  }

  // Shows a window whole beside the strips of the axes.
  fit({ x, y }) {
    const { side, strip } = this.#edges;
    const wider = ([low, high], size, covered, least) => [
      Math.max(least, high - ((high - low) * size) / (size - covered)),
      high,
    ];
    this.go(
      {
        x: wider(x, this.width, side, this.domains.x[0]),
        y: wider(y, this.height, strip, this.domains.y[0]),
      },
      { now: true },
    );
  }

  // The window beside the strips of the axes.
  /** @returns {View} */
  get beside() {
    const { side, strip } = this.#edges;
    const { x, y } = this.value({ px: side, py: this.height - strip });
    return { x: [x, this.view.x[1]], y: [y, this.view.y[1]] };
  }

  // Lifts the canvas so that a point is above a height of the page; null: no longer.
  reveal(point, height = 0) {
    const py = point ? this.place(point).py : 0;
    this.canvas.style.translate = py > height ? `0 ${Math.round(height / 2 - py)}px` : "";
  }

  pan(dx, dy) {
    if (!this.view) return; // the first window is not there yet
    const shifted = ([low, high], by, [least, most]) => {
      const step = Math.min(Math.max(least - low, by * (high - low)), Math.max(0, most - high));
      return [low + step, high + step];
    };
    this.go({ x: shifted(this.view.x, dx, this.domains.x), y: shifted(this.view.y, dy, this.domains.y) });
  }

  // Zooms so that the point at a place, or the middle, stays where it is; a factor above 1 shows less.
  zoom(factor, place = null) {
    if (!this.view || (factor > 1 && !this.act.mayZoomIn())) return;
    const centre = place ?? this.centre;
    const about = ([low, high], middle, [least, most]) => [
      Math.max(least, middle - (middle - low) / factor),
      Math.min(most, middle + (high - middle) / factor),
    ];
    this.go({ x: about(this.view.x, centre.x, this.domains.x), y: about(this.view.y, centre.y, this.domains.y) });
  }

  draw() {
    this.#drawing ??= requestAnimationFrame(() => {
      this.#drawing = null;
      if (this.view) this.#paint();
    });
  }

  #paint() {
    const pen = this.canvas.getContext("2d");
    const style = getComputedStyle(this.canvas);
    const ink = style.color;
    pen.setTransform(this.#ratio, 0, 0, this.#ratio, 0, 0);
    pen.fillStyle = style.backgroundColor;
    pen.fillRect(0, 0, this.canvas.clientWidth, this.canvas.clientHeight);
    this.#paintTiles(pen);
    pen.fillStyle = `rgb(0 0 0 / ${style.getPropertyValue("--shade")})`;
    pen.fillRect(0, 0, this.width, this.height);
    for (const line of this.scene.lines ?? []) this.#paintLine(pen, line);
    for (const { mark } of this.#apart()) this.#paintMark(pen, mark);
    if (this.spot) this.#paintSpot(pen, this.spot);
    if (this.scene.at) this.#paintCross(pen, this.scene.at);
    if (this.box) this.#paintBox(pen);
    pen.fillStyle = style.backgroundColor;
    this.#paintAxes(pen, ink);
  }

  // The tiles alone, as a canvas of the plane beside the strips of the axes.
  image() {
    const { side, strip } = this.#edges;
    const pixels = (length) => Math.round(length * this.#ratio);
    const canvas = new OffscreenCanvas(pixels(this.width - side), pixels(this.height - strip));
    const pen = canvas.getContext("2d");
    pen.scale(this.#ratio, this.#ratio);
    pen.translate(-side, 0);
    pen.fillStyle = "#FFFFFF";
    pen.fillRect(0, 0, this.width, this.height);
    this.#paintTiles(pen);
    return canvas;
  }

  // The marks that are drawn: those that do not cover one another.
  get marksApart() {
    return this.#apart().map(({ mark }) => mark);
  }

  // The place of a tile on the canvas, in whole pixels: there are no seams.
  #rectangle(x, y) {
    const whole = (length) => Math.round(length * this.#ratio) / this.#ratio;
    const left = whole(this.#px(x[0]));
    const top = whole(this.#py(y[1]));
    return [left, top, whole(this.#px(x[1])) - left, whole(this.#py(y[0])) - top];
  }

  #paintTiles(pen) {
    pen.imageSmoothingEnabled = false;
    for (const { image, x, y } of this.scene.below ?? []) {
      const place = this.#rectangle(x, y);
      pen.fillRect(...place);
      pen.globalAlpha = PALE;
      pen.drawImage(image, ...place);
      pen.globalAlpha = 1;
    }
    for (const { image, x, y, preview } of this.scene.tiles ?? []) {
      const place = this.#rectangle(x, y);
      pen.fillRect(...place); // a point without a colour does not show the coarser tile below
      pen.globalAlpha = preview ? PREVIEW_ALPHA : 1; // of previews nothing is verified
      pen.drawImage(image, ...place);
      pen.globalAlpha = 1;
    }
  }

  #paintLine(pen, { x, y, colour, dashed, thin }) {
    pen.beginPath();
    let goesOn = false; // a null is a gap
    x.forEach((value, k) => {
      if (y[k] === null) goesOn = false;
      else {
        pen[goesOn ? "lineTo" : "moveTo"](this.#px(value), this.#py(y[k]));
        goesOn = true;
      }
    });
    pen.setLineDash(dashed ? [6, 4] : []);
    const kind = thin ? "thin" : "line";
    rimmed(pen, DRAWN[kind], colour, DRAWN.rim[kind]);
    pen.setLineDash([]);
  }

  #paintMark(pen, { x, y, shape, colour }) {
    const px = this.#px(x);
    const py = this.#py(y);
    pen.beginPath();
    if (shape === "circle") pen.arc(px, py, DRAWN.circle, 0, 2 * Math.PI);
    else
      for (const [dx, dy] of [
        [0, -1],
        [1, 0],
        [0, 1],
        [-1, 0],
      ])
        pen.lineTo(px + DRAWN.diamond * dx, py + DRAWN.diamond * dy);
    pen.closePath();
    pen.fillStyle = colour;
    pen.strokeStyle = "#FFFFFF";
    pen.lineWidth = 2;
    pen.fill();
    pen.stroke();
  }

  // Marks the place whose machine is shown while no pointer is there.
  #paintSpot(pen, { px, py }) {
    pen.beginPath();
    pen.arc(px, py, 5, 0, 2 * Math.PI);
    rimmed(pen, 2, "#000000", 2);
  }

  #paintCross(pen, { x, y }) {
    const px = this.#px(x);
    const py = this.#py(y);
    pen.beginPath();
    for (const [dx, dy] of [
      [1, 0],
      [-1, 0],
      [0, 1],
      [0, -1],
    ]) {
      pen.moveTo(px + 4 * dx, py + 4 * dy);
      pen.lineTo(px + 14 * dx, py + 14 * dy);
    }
    rimmed(pen, 2, "#000000", 3);
  }

  #paintBox(pen) {
    const { from, to } = this.box;
    pen.strokeStyle = "#000000";
    pen.fillStyle = "#FFFFFF55";
    pen.lineWidth = 1.5;
    pen.fillRect(from.px, from.py, to.px - from.px, to.py - from.py);
    pen.strokeRect(from.px, from.py, to.px - from.px, to.py - from.py);
  }

  // The axes, on strips over the left and the lower edge of the picture.
  #paintAxes(pen, ink) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { side, strip, font } = this.#edges;
    const { names } = this.scene;
    const bottom = height - strip;
    pen.globalAlpha = STRIP_ALPHA;
    pen.fillRect(0, 0, side, height);
    pen.fillRect(side, bottom, width - side, strip);
    pen.globalAlpha = 1;
    pen.fillStyle = ink;
    pen.font = `${font}px system-ui, sans-serif`;
    const line = strip / 2 + 1;
    paintAxes(
      pen,
      layout({
        view: this.scene.inUnits?.(this.view) ?? this.view,
        frame: { left: 0, right: this.width, top: 0, bottom: this.height },
        clear: { left: side, bottom },
        names: names ?? { x: "", y: "" },
        suffix: " →",
        places: { x: { x: width - 10, y: bottom + line, anchor: "end" }, y: { x: font / 2 + 2, y: bottom / 2 } },
        gaps: { x: line, y: 7 },
        most: { x: Math.max(4, width / 110), y: Math.max(2, height / 60) },
        font,
        measure: (text) => pen.measureText(text).width,
      }),
    );
  }

  #distance(point, other) {
    return Math.hypot(this.#px(point.x) - this.#px(other.x), this.#py(point.y) - this.#py(other.y));
  }

  // The marks that do not cover one another, with the number of those that they stand for: [{ mark, others }].
  #apart() {
    const groups = [];
    for (const mark of this.scene.marks ?? []) {
      const over = groups.find((group) => this.#distance(group.mark, mark) < MARK);
      if (over) over.others += 1;
      else groups.push({ mark, others: 0 });
    }
    return groups;
  }

  areNear(point, other) {
    return this.#distance(point, other) < NEAR;
  }

  #nearest(point) {
    const [nearest] = this.#apart()
      .filter(({ mark }) => this.#distance(mark, point) < MARK)
      .sort((group, other) => this.#distance(group.mark, point) - this.#distance(other.mark, point));
    return nearest ?? null;
  }

  // The mark within reach of a point of the plane; null: none.
  markAt(point) {
    return this.#nearest(point)?.mark ?? null;
  }

  // What that mark says.
  markText(point) {
    const nearest = this.#nearest(point);
    if (!nearest) return null;
    const { mark, others } = nearest;
    return others ? `${mark.text} ${others} more here: zoom in.` : mark.text;
  }

  // The nearest line that passes within reach of a point of the plane; null: none.
  nearestLine(point) {
    const px = this.#px(point.x);
    const py = this.#py(point.y);
    const distance = ({ x, y }) =>
      x.reduce((least, value, k) => {
        if (!k || y[k] === null || y[k - 1] === null) return least;
        const [ax, ay, bx, by] = [this.#px(x[k - 1]), this.#py(y[k - 1]), this.#px(value), this.#py(y[k])];
        const length = (bx - ax) ** 2 + (by - ay) ** 2;
        const t = length ? Math.min(1, Math.max(0, ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / length)) : 0;
        return Math.min(least, Math.hypot(ax + t * (bx - ax) - px, ay + t * (by - ay) - py));
      }, Infinity);
    let [nearest, least] = [null, REACH];
    for (const line of this.scene.lines ?? []) {
      const apart = distance(line);
      if (apart < least) [nearest, least] = [line, apart];
    }
    return nearest;
  }
}
