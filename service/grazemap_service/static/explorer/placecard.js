// What there is to see at a place of the gallery that was opened.
import { byId } from "./dom.js";

// Shows the words of a place until it is closed, or until another view is followed.
export class PlaceCard {
  #hash = null; // of the place

  constructor() {
    this.card = byId("place");
    byId("place-close").addEventListener("click", () => {
      this.hide();
      byId("plane").focus();
    });
    byId("place-back").addEventListener("click", () => history.back());
  }

  show({ text, says }, hash) {
    this.#hash = hash;
    byId("place-title").textContent = text;
    byId("place-says").textContent = says;
    this.card.hidden = false;
  }

  hide() {
    this.card.hidden = true;
  }

  // An address was followed.
  followed(hash) {
    if (hash !== this.#hash) this.hide();
  }
}
