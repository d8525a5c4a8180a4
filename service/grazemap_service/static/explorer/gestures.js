// Turns pointers, the wheel and keys on the plane into new windows and picked points.

const CLICK_PIXELS = 4;
const SMALLEST_BOX = 12;
const WHEEL_STEP = 0.0015;
const KEY_ZOOM = 1.5;
const KEY_PAN = 0.125;

export class Gestures {
  #pointers = new Map();
  #gesture = null;

  // `act` is that of the plane.
  constructor(plane, act) {
    this.plane = plane;
    this.act = act;
    const on = (name, handler, options) => plane.canvas.addEventListener(name, handler, options);
    on("pointerdown", (event) => this.#down(event));
    on("pointermove", (event) => this.#move(event));
    on("pointerup", (event) => this.#up(event));
    for (const name of ["pointercancel", "lostpointercapture"])
      on(name, (event) => this.#pointers.has(event.pointerId) && this.#end(event));
    // what a finger has tapped is read until the next tap
    on("pointerleave", ({ pointerType }) => pointerType !== "touch" && act.point(null));
    on("wheel", (event) => this.#wheel(event), { passive: false });
    on("keydown", (event) => this.#key(event));
  }

  #place(event) {
    const box = this.plane.canvas.getBoundingClientRect();
    return { px: event.clientX - box.left, py: event.clientY - box.top };
  }

  #down(event) {
    if (event.button) return;
    const place = this.#place(event);
    this.plane.canvas.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, place);
    if (this.#pointers.size === 1)
      this.#gesture = { kind: event.shiftKey ? "box" : "pan", from: place, last: place, moved: false };
    else this.#gesture = { kind: "pinch", distance: this.#distance() };
  }

  #distance() {
    const [pointer, other] = [...this.#pointers.values()];
    return Math.max(1, Math.hypot(pointer.px - other.px, pointer.py - other.py));
  }

  #move(event) {
    const place = this.#place(event);
    const gesture = this.#gesture;
    this.act.point(this.plane.inside(place) ? place : null);
    if (!this.#pointers.has(event.pointerId)) return;
    this.#pointers.set(event.pointerId, place);
    if (gesture.kind === "pinch") {
      const distance = this.#distance();
      const [pointer, other] = [...this.#pointers.values()];
      this.plane.zoom(
        distance / gesture.distance,
        this.plane.value({ px: (pointer.px + other.px) / 2, py: (pointer.py + other.py) / 2 }),
      );
      gesture.distance = distance;
      return;
    }
    gesture.moved ||= Math.hypot(place.px - gesture.from.px, place.py - gesture.from.py) > CLICK_PIXELS;
    if (!gesture.moved) return;
    if (gesture.kind === "pan")
      this.plane.pan((gesture.last.px - place.px) / this.plane.width, (place.py - gesture.last.py) / this.plane.height);
    gesture.last = place;
    if (gesture.kind === "box") this.plane.box = { from: gesture.from, to: place };
    this.plane.draw();
  }

  #up(event) {
    const gesture = this.#gesture;
    const place = this.#place(event);
    this.#end(event);
    if (!gesture || gesture.kind === "pinch") return;
    if (!gesture.moved) {
      if (!this.plane.inside(place) || !this.plane.view) return;
      this.act.point(place);
      this.act.pick(this.plane.value(place));
    } else if (gesture.kind === "box") this.#showBox(gesture.from, place);
  }

  #end(event) {
    this.#pointers.delete(event.pointerId);
    const [left, other] = this.#pointers.values(); // a finger that stays after two have pinched moves the plane
    if (other) this.#gesture = { kind: "pinch", distance: this.#distance() };
    else this.#gesture = left ? { kind: "pan", from: left, last: left, moved: true } : null;
    this.plane.box = null;
    this.plane.draw();
  }

  #showBox(from, to) {
    if (Math.abs(from.px - to.px) < SMALLEST_BOX || Math.abs(from.py - to.py) < SMALLEST_BOX || !this.act.mayZoomIn())
      return;
    const corner = this.plane.value(from);
    const other = this.plane.value(to);
    const sorted = (a, b) => [Math.min(a, b), Math.max(a, b)];
    this.plane.go({ x: sorted(corner.x, other.x), y: sorted(corner.y, other.y) }, { now: true });
  }

  #wheel(event) {
    if (!this.plane.view || !this.act.takesWheel()) return;
    event.preventDefault();
    const place = this.#place(event);
    const lines = event.deltaMode === 1 ? 16 : 1;
    if (this.plane.inside(place))
      this.plane.zoom(Math.exp(-event.deltaY * lines * WHEEL_STEP), this.plane.value(place));
  }

  #key(event) {
    const step = event.shiftKey ? 4 * KEY_PAN : KEY_PAN;
    const keys = {
      ArrowLeft: () => this.plane.pan(-step, 0),
      ArrowRight: () => this.plane.pan(step, 0),
      ArrowUp: () => this.plane.pan(0, step),
      ArrowDown: () => this.plane.pan(0, -step),
      "+": () => this.plane.zoom(KEY_ZOOM),
      "=": () => this.plane.zoom(KEY_ZOOM),
      "-": () => this.plane.zoom(1 / KEY_ZOOM),
      Home: () => this.act.home(),
      Enter: () => this.act.pick(this.plane.centre, { byKey: true }),
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key] || !this.plane.view) return;
    event.preventDefault();
    this.act.point(this.plane.middle);
    keys[event.key]();
  }
}
