// The menus of the header: they open inside the window, and a press elsewhere or Escape closes the one that is open.

const EDGE = 8; // pixels from the edge of the window

function keepInside(menu) {
  const card = menu.querySelector(".card");
  card.style.translate = "";
  const beyond = card.getBoundingClientRect().right + EDGE - innerWidth;
  if (beyond > 0) card.style.translate = `${-beyond}px`;
}

export function arrangeMenus() {
  /** @type {() => HTMLDetailsElement | null} */
  const open = () => document.querySelector("details.menu[open]");
  for (const menu of document.querySelectorAll(/** @type {"details"} */ ("details.menu")))
    menu.addEventListener("toggle", () => menu.open && keepInside(menu));
  addEventListener("resize", () => open() && keepInside(open()));
  addEventListener(
    "pointerdown",
    ({ target }) => {
      const menu = open();
      if (menu && !menu.contains(/** @type {Node} */ (target))) menu.open = false;
    },
    { capture: true },
  );
  addEventListener("keydown", ({ key }) => {
    const menu = open();
    if (key !== "Escape" || !menu) return;
    if (menu.contains(document.activeElement)) menu.querySelector("summary").focus();
    menu.open = false;
  });
}
