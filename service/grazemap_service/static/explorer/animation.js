// The machine in motion on a canvas: the masses of a chain, or the contact alone, between the stops.

const PERIOD_SECONDS = 1.6; // how long a forcing period lasts on the screen
const FLASH_SECONDS = 0.12; // how long a stop shows that it was hit

export class Animation {
  #frame = null;
  #began = 0;
  #before = 0;
  #now = 0; // the time that is drawn

  /** @param {HTMLCanvasElement} canvas  @param {{ hit?: (share: number) => void }} [act] */
  // `hit(share)` is called at each impact with its speed over the fastest one, while the animation plays.
  constructor(canvas, { hit = () => {} } = {}) {
    this.canvas = canvas;
    this.hit = hit;
  }

  // `masses` are the displacements [mass][time] that are drawn; `stops` are [left, right], null where absent, beside the
  // mass that is `struck`, on the ground or on a `bearer`, another mass. `impacts` are { time, stop, speed }. After `loop` of the motion's time it begins again.
  show({ time, masses, struck, bearer, stops, period, loop, impacts, colour }) {
    const wasPlaying = this.playing;
    this.stop();
    const sizes = [...stops.filter((stop) => stop !== null), ...masses.flat()].map(Math.abs);
    this.time = time;
    this.masses = masses;
    this.struck = struck;
    this.bearer = bearer;
    this.stops = stops;
    this.period = period;
    this.loop = loop;
    this.impacts = impacts;
    this.colour = colour;
    this.scale = 0.4 / (sizes.reduce((most, size) => Math.max(most, size), 0) || 1);
    this.fastest = impacts.reduce((most, { speed }) => Math.max(most, speed), 0) || 1;
    this.#draw(time[0]);
    if (wasPlaying) this.play();
  }

  get playing() {
    return this.#frame !== null;
  }

  play() {
    this.stop();
    this.#began = performance.now();
    this.#before = 0;
    const step = (now) => {
      const passed = (((now - this.#began) / 1000 / PERIOD_SECONDS) * this.period) % this.loop;
      this.#draw(this.time[0] + passed);
      this.#frame = requestAnimationFrame(step);
    };
    this.#frame = requestAnimationFrame(step);
  }

  stop() {
    cancelAnimationFrame(this.#frame);
    this.#frame = null;
  }

  // Draws what is shown again, unless it moves.
  redraw() {
    if (this.time && !this.playing) this.#draw(this.#now);
  }

  // The displacements at a time, between two samples.
  #places(now) {
    const { time, masses } = this;
    const step = (time[time.length - 1] - time[0]) / (time.length - 1);
    const place = Math.min(time.length - 1.001, Math.max(0, (now - time[0]) / step));
    const k = Math.floor(place);
    return masses.map((values) => values[k] + (place - k) * (values[k + 1] - values[k]));
  }

  // The stops that were hit just now.
  #hits(now) {
    const lasts = (FLASH_SECONDS / PERIOD_SECONDS) * this.period;
    const isNew = this.playing && now > this.#before;
    const recent = this.impacts.filter(({ time }) => time <= now && now < time + lasts);
    if (isNew) for (const { time, speed } of recent) if (time > this.#before) this.hit(speed / this.fastest);
    this.#before = now;
    return new Set(recent.map(({ stop }) => Math.sign(stop)));
  }

  #draw(now) {
    this.#now = now;
    const ratio = globalThis.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [across, up] = [width, height].map((length) => Math.round(length * ratio));
    if (this.canvas.width !== across) this.canvas.width = across;
    if (this.canvas.height !== up) this.canvas.height = up;
    const pen = this.canvas.getContext("2d");
    const style = getComputedStyle(this.canvas);
    const ink = style.color;
    const places = this.#places(now);
    const hits = this.#hits(now);
    const wall = 5;
    const cell = (width - wall - 6) / (places.length + 0.25);
    const size = Math.min(0.45 * height, 0.4 * cell);
    const middle = height / 2;
    const home = (k) => 6 + cell * (k + 0.5);
    const reach = Math.min(cell - size, 1.2 * height);
    const place = (k) => home(k) + places[k] * this.scale * reach;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.strokeStyle = pen.fillStyle = ink;
    pen.lineWidth = 1.5;
    const floor = 0.32 * height;
    for (let k = 0; k < places.length; k++)
      spring(pen, place(k) + size / 2, k + 1 < places.length ? place(k + 1) - size / 2 : width - wall, middle, height);
    pen.fillRect(width - wall, middle - floor, wall, 2 * floor);
    for (let k = 0; k < places.length; k++) {
      pen.fillStyle = k === this.struck ? this.colour : ink;
      pen.beginPath();
      pen.roundRect(place(k) - size / 2, middle - size / 2, size, size, 3);
      pen.fill();
      pen.stroke();
    }
    // the stops reach the mass from above and below, so that its spring passes between them
    const thick = 5;
    const ground = home(this.struck) + (this.bearer === null ? 0 : places[this.bearer] * this.scale * reach);
    this.stops.forEach((stop, k) => {
      if (stop === null) return;
      const side = k ? 1 : -1;
      const x = ground + stop * this.scale * reach + (side * size) / 2;
      if (this.bearer !== null) {
        pen.beginPath();
        pen.moveTo(place(this.bearer), middle - size / 2);
        pen.lineTo(place(this.bearer), middle - size);
        pen.lineTo(x, middle - size);
        pen.stroke();
      }
      pen.fillStyle = hits.has(side) ? style.getPropertyValue("--error") : ink;
      for (const top of [middle - size, middle + size / 4])
        pen.fillRect(side > 0 ? x : x - thick, top, thick, 0.75 * size);
    });
  }
}

function spring(pen, from, to, y, height) {
  const coils = 6;
  const step = (to - from) / (coils + 2);
  pen.beginPath();
  pen.moveTo(from, y);
  pen.lineTo(from + step, y);
  for (let k = 0; k < coils; k++) pen.lineTo(from + step * (k + 1.5), y + (k % 2 ? 1 : -1) * 0.07 * height);
  pen.lineTo(to - step, y);
  pen.lineTo(to, y);
  pen.stroke();
}
