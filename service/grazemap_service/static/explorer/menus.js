// The menus of the header: a press elsewhere or Escape closes the one that is open.

export function closeMenus() {
  const open = () => document.querySelector("details.menu[open]");
  addEventListener(
    "pointerdown",
    ({ target }) => {
      const menu = open();
      if (menu && !menu.contains(target)) menu.open = false;
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
