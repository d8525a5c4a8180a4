// What the browser keeps for this page. It may refuse to, as in a frame of another site: then nothing is kept.

const storage = (name) => {
  try {
    return globalThis[name];
  } catch {
    return null;
  }
};

class Kept {
  #storage;

  constructor(name) {
    this.#storage = storage(name);
  }

  get(key) {
    return this.#storage?.getItem(key) ?? null;
  }

  set(key, value) {
    try {
      this.#storage?.setItem(key, value);
    } catch {
      // no room is left
    }
  }
}

export const forTab = new Kept("sessionStorage");
export const forBrowser = new Kept("localStorage");
