// The controls beside the particles: slider, colours, what is shown, the cut, numbers of one.

import { css, ofClass, ofNumber } from "./colours.js";

export function make(tag, attributes = {}, ...inside) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value);
  }
  element.append(...inside);
  return element;
}

function choice(label, options, chosen, act) {
  const select = make("select", { "aria-label": label, onchange: (e) => act(e.target.value) });
  for (const [value, text] of options) select.append(make("option", { value }, text));
  select.value = chosen;
  return make("label", {}, make("span", {}, label), select);
}

function short(v) {
  return v === 0 || (Math.abs(v) >= 0.01 && Math.abs(v) < 1e4) ? `${+v.toPrecision(3)}` : v.toExponential(1);
}

const NICE = [1, 2, 5];

export function panel(viewer) {
  const { data, state } = viewer;
  const said = make("div", { class: "viewer-said" });
  const bar = make("div", { class: "viewer-scale" });
  viewer.canvas.parentElement.append(said, bar);
  const slider = make("input", {
    type: "range", min: 0, max: data.frames - 1, value: viewer.frame, "aria-label": "snapshot",
    oninput: (e) => viewer.go(Number(e.target.value)),
  });
  const button = make("button", { type: "button", onclick: () => viewer.play() }, "play");
  const legend = make("div", { class: "viewer-legend" });
  const share = make("input", {
    type: "range", min: 0, max: 1, step: 0.002, value: state.share, "aria-label": "place of the cut",
    oninput: (e) => {
      state.share = Number(e.target.value);
      viewer.draw();
    },
  });
  const picked = make("table", { class: "numbers" });
  const shown = [["particles", data.word]];
  if (data.pairs) shown.push(["contacts", "contacts"]);
  if (data.pairs?.force) shown.push(["forces", "force chains"]);
  const set = (key) => (value) => {
    state[key] = key === "quantity" ? Number(value) : value;
    viewer.update();
  };
  const colour = data.quantities.map((q, k) => [k, q.label]);
  const choices = {
    quantity: choice("colour", colour, state.quantity, set("quantity")),
    show: choice("show", shown, state.show, set("show")),
    plane: choice("cut across", ["none", "x", "y", "z"].map((v) => [v, v]), state.plane, set("plane")),
  };
  const rows = [
    make("div", { class: "viewer-time" }, button, slider),
    choices.quantity,
    legend,
    choices.show,
    choice("look from", [..."oblique front side top bottom".split(" ")].map((v) => [v, v]), data.view,
      (view) => viewer.look(view)),
    choices.plane,
    share,
    make("p", { class: "hint" }, `Drag to turn, wheel to zoom, click one of the ${data.word} for its numbers.`),
    picked,
  ];
  viewer.host.append(make("div", { class: "viewer-panel" }, ...rows));

  function refresh() {
    slider.value = viewer.frame;
    for (const [key, label] of Object.entries(choices)) label.querySelector("select").value = state[key];
    button.textContent = state.playing ? "stop" : "play";
    button.disabled = slider.disabled = data.frames < 2;
    said.textContent = data.said[viewer.frame];
    share.hidden = state.plane === "none";
    showLegend(legend, data.quantities[state.quantity]);
    picked.replaceChildren();
    if (state.picked < 0) return;
    for (const [name, value] of viewer.numbers(state.picked)) {
      picked.append(make("tr", {}, make("th", {}, name), make("td", {}, value)));
    }
  }

  function scale(perPixel) {
    // a bar of a round length, a quarter of the picture at most
    const most = 0.25 * viewer.canvas.clientWidth * perPixel;
    const ten = 10 ** Math.floor(Math.log10(most));
    const length = ten * NICE.filter((n) => n * ten <= most).at(-1);
    bar.style.width = `${length / perPixel}px`;
    bar.textContent = `${+length.toPrecision(3)} ${data.length_unit}`;
  }

  return { refresh, scale };
}

function showLegend(legend, about) {
  legend.replaceChildren();
  if (!about) return;
  if (about.kind === "class") {
    for (const [n, name] of Object.entries(about.names || {})) {
      const spot = make("i", { style: `background:${css(ofClass(Number(n)))}` });
      legend.append(make("span", {}, spot, `${name}`));
    }
    return;
  }
  const stops = Array.from({ length: 9 }, (_, k) => css(ofNumber(k / 8))).join(",");
  const [low, high] = about.range;
  legend.append(
    make("span", {}, short(low)),
    make("b", { style: `background:linear-gradient(to right,${stops})` }),
    make("span", {}, `${short(high)} ${about.unit || ""}`),
  );
}
