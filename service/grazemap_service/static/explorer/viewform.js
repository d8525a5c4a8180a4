// The controls of the view: its layer of colours, where motions start, units, and the curves over it.
import { byId, element } from "./dom.js";
import { LAYERS, hasLayer } from "./layers.js";
import { STARTS } from "./starts.js";
import { UNITS, isSI } from "./units.js";

const ABSENT = { right: "left", left: "right" }; // the stop that a machine with one stop does not have
const option = (value, text, title = "") => element("option", { value, textContent: text, title });

// `changed(part)` is called with what of the state was chosen.
export class ViewForm {
  constructor(changed) {
    byId("layer").append(
      ...Object.entries(LAYERS).map(([name, { text, description }]) => option(name, text, description)),
    );
    byId("policy").append(...Object.entries(STARTS).map(([name, { text, means }]) => option(name, text, means)));
    for (const [quantity, units] of Object.entries(UNITS)) {
      byId(`unit-${quantity}`).append(...Object.keys(units).map((unit) => option(unit, unit)));
      byId(`unit-${quantity}`).addEventListener("change", ({ target }) =>
        changed({ units: { ...this.state.units, [quantity]: target.value } }),
      );
    }
    byId("layer").addEventListener("change", ({ target }) => changed({ layer: target.value }));
    byId("policy").addEventListener("change", ({ target: { value: policy } }) => {
      const layer = hasLayer(policy, LAYERS[this.state.layer]) ? this.state.layer : "motion";
      changed({ policy, layer });
    });
    byId("curves").addEventListener("change", ({ target }) => changed({ curves: target.checked ? "all" : "grazing" }));
    byId("borders").addEventListener("change", ({ target }) => changed({ borders: target.checked }));
  }

  /** @param {State} state */
  show(state) {
    this.state = state;
    byId("layer").value = state.layer;
    for (const choice of byId("layer").options) {
      const layer = LAYERS[choice.value];
      choice.disabled = !hasLayer(state.policy, layer);
      choice.hidden = choice.value.endsWith(`_${ABSENT[state.machine.stops]}`);
      choice.textContent = choice.disabled ? `${layer.text} (of ${STARTS[layer.policy].text})` : layer.text;
    }
    byId("policy").value = state.policy;
    byId("curves").checked = state.curves === "all";
    byId("borders").checked = state.borders;
    byId("units").hidden = !isSI(state.machine);
    for (const [quantity, unit] of Object.entries(state.units)) byId(`unit-${quantity}`).value = unit;
  }
}
