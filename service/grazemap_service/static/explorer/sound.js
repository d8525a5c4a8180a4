// The sound of impacts.

const LASTS = 0.09; // seconds
let context = null;

// A knock; `share` is the speed of the impact over the fastest one. A browser allows it after a press only.
export function knock(share) {
  context ??= new AudioContext();
  const now = context.currentTime;
  const tone = context.createOscillator();
  const loudness = context.createGain();
  tone.type = "triangle";
  tone.frequency.setValueAtTime(240 + 500 * share, now);
  tone.frequency.exponentialRampToValueAtTime(90, now + LASTS);
  loudness.gain.setValueAtTime(0.05 + 0.25 * share, now);
  loudness.gain.exponentialRampToValueAtTime(1e-4, now + LASTS);
  tone.connect(loudness).connect(context.destination);
  tone.start(now);
  tone.stop(now + LASTS);
}
