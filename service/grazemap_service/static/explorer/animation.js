// The machine in motion: the masses of a chain, or the contact alone, between the stops.

const PERIOD_SECONDS = 3; // how long a forcing period lasts on the screen
const FLOOR = 26;

// `masses` are the displacements [mass][time] that are drawn; `stops` are [left, right], null where absent, and those of
// the first mass.
export class Animation {
  #frame = null;
  #began = 0;

  constructor(canvas) {
    this.canvas = canvas;
  }

  show({ time, masses, stops, period, colour }) {
    this.stop();
    Object.assign(this, {
      time,
      masses,
      stops,
      period,
      colour,
      scale: 0.35 / Math.max(...stops.filter((stop) => stop !== null).map(Math.abs), ...masses[0].map(Math.abs)),
    });
    this.#draw(0);
  }

  get playing() {
    return this.#frame !== null;
  }

  play() {
    this.#began = performance.now();
    const step = (now) => {
      const length = this.time[this.time.length - 1] - this.time[0];
      const at = (((now - this.#began) / 1000 / PERIOD_SECONDS) * this.period) % length;
      this.#draw(Math.min(this.time.length - 1, Math.round((at / length) * (this.time.length - 1))));
      this.#frame = requestAnimationFrame(step);
    };
    this.#frame = requestAnimationFrame(step);
  }

  stop() {
    cancelAnimationFrame(this.#frame);
    this.#frame = null;
  }

  #draw(moment) {
    const pen = this.canvas.getContext("2d");
    const { width, height } = this.canvas;
    const ink = getComputedStyle(this.canvas).color;
    const count = this.masses.length;
    const cell = (width - 20) / (count + 0.5);
    const size = Math.min(34, cell * 0.35);
    const middle = height / 2;
    const home = (k) => 10 + cell * (k + 0.5);
    const place = (k) => home(k) + this.masses[k][moment] * this.scale * cell;
    pen.clearRect(0, 0, width, height);
    pen.strokeStyle = pen.fillStyle = ink;
    pen.lineWidth = 1.5;
    for (let k = 0; k < count; k++)
      spring(pen, place(k) + size / 2, k + 1 < count ? place(k + 1) - size / 2 : width - 6, middle);
    pen.fillRect(width - 6, middle - FLOOR, 6, 2 * FLOOR);
    for (let k = 0; k < count; k++) {
      pen.fillStyle = k ? ink : this.colour;
      pen.fillRect(place(k) - size / 2, middle - size / 2, size, size);
      pen.strokeRect(place(k) - size / 2, middle - size / 2, size, size);
    }
    pen.fillStyle = ink;
    const [left, right] = this.stops;
    // The stops reach the mass from above and below, so that its spring passes between them.
    for (const [stop, side] of [
      [left, -1],
      [right, 1],
    ]) {
      if (stop === null) continue;
      const x = home(0) + stop * this.scale * cell + (side * size) / 2;
      for (const top of [middle - size, middle + size / 4]) pen.fillRect(side > 0 ? x : x - 5, top, 5, size * 0.75);
    }
  }
}

function spring(pen, from, to, y) {
  const coils = 6;
  const step = (to - from) / (coils + 2);
  pen.beginPath();
  pen.moveTo(from, y);
  pen.lineTo(from + step, y);
  for (let k = 0; k < coils; k++) pen.lineTo(from + step * (k + 1.5), y + (k % 2 ? 6 : -6));
  pen.lineTo(to - step, y);
  pen.lineTo(to, y);
  pen.stroke();
}
