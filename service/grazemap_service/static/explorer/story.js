// The story of the first visit: a small card says three things, while the machine moves to places of the plane that
// show them. It ends when someone presses or moves the plane, and is not shown again unless asked for.
import { byId, isPhone } from "./dom.js";
import { forBrowser } from "./kept.js";
import { isFree } from "./labels.js";
import { besideLine, insides } from "./storyplaces.js";

const SEEN = "grazemap-story";
const STAYS = 2600; // milliseconds at a place
const MOTIONS = 3;
// As shares of the window: where the curve is pointed at, how far from it points are, and the part that is free of what
// floats, with room for the machine beside a point.
const WIDE = { across: 0.4, apart: 0.12, part: { x: [0.28, 0.54], y: [0.4, 0.92] } };
const PHONE = { across: 0.3, apart: 0.06, part: { x: [0.16, 0.36], y: [0.4, 0.85] } };
const free = () => (isPhone() ? PHONE : WIDE);

// A motion that repeats, with impacts.
const hasRhythm = (label) => label !== null && /^\d/.test(label) && !isFree(label);

const YOURS = "Drag, zoom, click: it is yours.";

// What a step says, and then, and the points that it shows of a scene as `look` has it; null: what it needs has not come.
const STORY = [
  {
    says: "This is a machine. It is shaken, and one of its masses moves between two stops.",
    points: ({ centre }) => [centre],
  },
  {
    says: "Above this line it can move without touching its stops. Below it, it must hit them.",
    tag: "this line",
    points: ({ line, window }) => {
      const beside = line && besideLine(line, window, free());
      return beside && [beside.above, beside.below];
    },
  },
  {
    says: "These colours are its rhythms. Each point of the plane is one machine, its colour the rhythm of its impacts.",
    then: YOURS,
    points: ({ labelAt, window }) => {
      const rhythmAt = (x, y) => {
        const label = labelAt(x, y);
        return hasRhythm(label) ? label : null;
      };
      const points = insides(rhythmAt, window, free().part, MOTIONS);
      return points.length === MOTIONS ? points : null;
    },
  },
];

export class Story {
  #step = null; // its number; null: there is no story
  #points = null; // of the step; null: not yet known
  #shown = 0; // which of them
  #timer = null;
  #scene = null;

  // `changed()` is called when the place of the machine has changed.
  constructor({ changed }) {
    this.changed = changed;
    byId("story-next").addEventListener("click", () => this.#go(this.#step + 1));
    byId("story-skip").addEventListener("click", () => this.end());
    addEventListener("keydown", ({ key }) => key === "Escape" && this.end());
  }

  static get wasSeen() {
    return forBrowser.get(SEEN) !== null;
  }

  get #isTold() {
    return this.#step !== null;
  }

  // The point of the plane whose machine is shown; null: none.
  get point() {
    return this.#points?.[this.#shown] ?? null;
  }

  begin() {
    byId("story").hidden = false;
    this.#go(0);
  }

  end() {
    if (!this.#isTold) return;
    forBrowser.set(SEEN, "seen");
    this.forget();
    if (byId("story").contains(document.activeElement)) byId("plane").focus();
    byId("story").hidden = true;
    this.#step = null;
    this.#mark();
    this.changed();
  }

  // Takes note of what the page shows: { window, centre, line, labelAt(x, y), placeOf(point) }.
  look(scene) {
    this.#scene = scene;
    if (!this.#isTold) return;
    this.#find();
    this.#mark();
  }

  #go(step) {
    this.forget();
    if (step === STORY.length) return this.end();
    this.#step = step;
    byId("story-says").textContent = STORY[step].says;
    byId("story-step").textContent = `${step + 1} of ${STORY.length}`;
    byId("story-next").textContent = step + 1 < STORY.length ? "Next" : "Done";
    byId("story-skip").hidden = step + 1 === STORY.length;
    if (this.#scene) this.#find();
    return this.changed();
  }

  // Forgets the points of the step.
  forget() {
    clearTimeout(this.#timer);
    this.#points = this.#timer = null;
    this.#shown = 0;
  }

  // Looks for the points of the step, and stays at one from when its motion is known.
  #find() {
    this.#points ??= STORY[this.#step].points(this.#scene);
    const { point } = this;
    if (!point || this.#timer || this.#scene.labelAt(point.x, point.y) === null) return;
    this.#timer = setTimeout(() => {
      const { says, then } = STORY[this.#step];
      if (this.#shown + 1 === this.#points.length) {
        if (then) byId("story-says").textContent = `${says} ${then}`;
        return;
      }
      this.#timer = null;
      this.#shown += 1;
      this.changed();
    }, STAYS);
  }

  // Draws a ring about the point, and says of the curve that it is the one.
  #mark() {
    const tag = STORY[this.#step]?.tag;
    const { line, window, placeOf } = this.#scene ?? {};
    const on = tag && line && besideLine(line, window, free())?.on;
    const put = (id, point) => {
      const mark = byId(id);
      mark.hidden = !point;
      if (!point) return;
      const { px, py } = placeOf(point);
      Object.assign(mark.style, { left: `${px}px`, top: `${py}px` });
    };
    put("story-ring", this.point);
    put("story-tag", on);
    if (on) byId("story-tag").textContent = tag;
  }
}
