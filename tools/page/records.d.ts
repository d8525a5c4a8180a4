// What the modules of the page hand to one another, for `make page-types`. The page itself loads plain JavaScript.

type Interval = [low: number, high: number];
type View = { x: Interval; y: Interval }; // of the plane
type Place = { x: number; y: number };
type PointValues = { start: number; stop: number; points?: number }; // of a range of the API

// Of the page: `oscillator` is the body of the API, null: the paper's; `left` is the clearance of the left stop where it
// is fixed.
type Machine = {
  oscillator: any | null;
  stops: "equal" | "unequal" | "right" | "left";
  left: number | null;
  periods: number;
};

// The two parameters of the axes, and what is fixed of frequency and clearance.
type PlaneAxes = { horizontal: string; vertical: string; omega: number | null; clearance: number | null };

type State = View & {
  plane: PlaneAxes;
  machine: Machine;
  layer: string;
  policy: string;
  units: { frequency: string; length: string };
  curves: string;
  borders: boolean;
  at: number[] | null; // the open point
  embed: string[] | null; // the controls of a page within another one
};

type Parameter = {
  name: string;
  text: string;
  short?: string; // of a slider
  symbol?: string;
  hint?: string;
  quantity?: string;
  domain: Interval;
  factor?: boolean;
};

// A tile, or a map that covers a window of its own: arrays by name, over the points from below and from the left.
type Tile = {
  x: Interval;
  y: Interval;
  points: number;
  labels: string[];
  motion: Uint16Array;
  verified: Uint8Array;
  preview: boolean;
  [values: string]: any;
};

// A layer of colours: `field` names its values in tiles.
type Layer = {
  text: string;
  field?: string;
  quantity?: string;
  observables?: string[];
  policy?: string;
  [how: string]: any;
};

// What is drawn over the tiles.
type Line = {
  x: number[];
  y: (number | null)[];
  colour: string;
  text?: string;
  type?: string;
  dashed?: boolean;
  thin?: boolean;
  isGraze?: boolean;
  isBorder?: boolean;
};
type Box = { left: number; right: number; top: number; bottom: number };

// How a job is asked for and followed.
type Asking = { npz?: boolean; priority?: number; signal?: AbortSignal; onJob?: (job: any) => void };
type Sending = {
  method?: string;
  headers?: Record<string, string>;
  body?: any;
  signal?: AbortSignal;
  wanted?: AbortSignal;
  keepalive?: boolean;
};

declare const SwaggerUIBundle: any; // of the page of the API, from a script of its own
