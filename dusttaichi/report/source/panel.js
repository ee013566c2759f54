// The controls beside the particles: slider, colours, what is shown, the cut, numbers of one.

import { PULLED, PUSHED, ROD, css, ofClass, ofNumber, rodWidth } from "./colours.js";
import { written } from "./link.js";
import { save } from "./picture.js";

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

export function short(v) {
  return v === 0 || (Math.abs(v) >= 0.01 && Math.abs(v) < 1e4) ? `${+v.toPrecision(3)}` : v.toExponential(1);
}

const NICE = [1, 2, 5];

export function panel(viewer) {
  const { data, state } = viewer;
  const said = make("div", { class: "viewer-said" });
  const rule = make("div", { class: "viewer-scale" });
  const bar = { width: 0, text: "" }; // of a round length, as it is shown
  viewer.canvas.parentElement.append(said, rule);
  const slider = make("input", {
    type: "range", min: 0, max: data.frames - 1, value: viewer.frame, "aria-label": "snapshot",
    oninput: (e) => viewer.go(Number(e.target.value)),
  });
  const button = make("button", { type: "button", onclick: () => viewer.play() }, "play");
  const legend = make("div", { class: "viewer-legend" });
  const rodLegend = make("div", { class: "viewer-legend" });
  const share = make("input", {
    type: "range", min: 0, max: 1, step: 0.002, value: state.share, "aria-label": "place of the cut",
    oninput: (e) => {
      state.share = Number(e.target.value);
      viewer.draw();
    },
  });
  const picked = make("table", { class: "numbers" });
  const set = (key) => (value) => {
    state[key] = key === "quantity" ? Number(value) : value;
    viewer.update();
  };
  const colour = data.quantities.map((q, k) => [k, q.label]);
  const choices = {
    quantity: choice("colour", colour, state.quantity, set("quantity")),
    show: choice("show", viewer.shows, state.show, set("show")),
    plane: choice("cut across", ["none", "x", "y", "z"].map((v) => [v, v]), state.plane, set("plane")),
  };
  const rows = [
    make("div", { class: "viewer-time" }, button, slider),
    choices.quantity,
    legend,
    choices.show,
    rodLegend,
    choice("look from", [..."oblique front side top bottom".split(" ")].map((v) => [v, v]), data.view,
      (view) => viewer.look(view)),
    choices.plane,
    share,
    keeping(viewer),
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
    share.value = state.share;
    showLegend(legend, data.quantities[state.quantity]);
    showRods(rodLegend, state.show === "forces" ? data.pairs : null);
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
    Object.assign(bar, { width: length / perPixel, text: `${+length.toPrecision(3)} ${data.length_unit}` });
    rule.style.width = `${bar.width}px`;
    rule.textContent = bar.text;
  }

  return { refresh, scale, bar, legendForPicture: () => legendOf(data.quantities[state.quantity]) };
}

// Buttons that keep what is seen: as a picture, as an address.
function keeping(viewer) {
  const copy = make("button", {
    type: "button", title: "the address of this page with this view",
    onclick: async () => {
      window.location.hash = written(viewer, window.dust.viewers.indexOf(viewer));
      let text = "copied";
      try {
        await navigator.clipboard.writeText(window.location.href);
      } catch {
        text = "in the address bar"; // the browser allows no more
      }
      copy.textContent = text;
      setTimeout(() => (copy.textContent = "copy view"), 1500);
    },
  }, "copy view");
  const name = () => `${document.title.replace(/[^\w.-]+/g, "_")}_${viewer.frame}.png`;
  const keep = make("button", { type: "button", onclick: () => save(viewer, name()) }, "save picture");
  const framed = window.self !== window.top; // in a notebook there is no address to copy
  return make("div", { class: "viewer-keep" }, keep, ...(framed ? [] : [copy]));
}

// What the colours mean: {label, classes: [[name, colour]]} or {label, stops, low, high}.
function legendOf(about) {
  if (!about) return null;
  if (about.kind === "class") {
    const classes = Object.entries(about.names || {}).map(([n, name]) => [`${name}`, css(ofClass(Number(n)))]);
    return { label: about.label, classes };
  }
  const [low, high] = about.range.map(short);
  const stops = Array.from({ length: 9 }, (_, k) => css(ofNumber(k / 8)));
  return { label: about.label, stops, low, high: `${high} ${about.unit || ""}`.trim() };
}

function showLegend(legend, about) {
  const found = legendOf(about);
  legend.replaceChildren();
  for (const [name, colour] of found?.classes ?? []) {
    legend.append(make("span", {}, make("i", { style: `background:${colour}` }), name));
  }
  if (!found?.stops) return;
  const ramp = `background:linear-gradient(to right,${found.stops.join(",")})`;
  legend.append(make("span", {}, found.low), make("b", { style: ramp }), make("span", {}, found.high));
}

const SHARES = [0.01, 0.1, 1]; // of the largest force, whose rods the legend shows

// Colours of force chains, and the forces of rods of some widths. pairs: null where there are none.
function showRods(legend, pairs) {
  legend.replaceChildren();
  if (!pairs) return;
  for (const [name, colour] of [["pushed apart", PUSHED], ["pulled together", PULLED]]) {
    legend.append(make("span", {}, make("i", { style: `background:${css(colour)}` }), name));
  }
  for (const share of SHARES) {
    const thick = `height:${(16 * rodWidth(share)).toFixed(1)}px;background:${css(ROD)}`;
    const most = share === 1 ? "≥ " : "";
    const text = `${most}${short(share * pairs.largest)} nN`;
    legend.append(make("span", {}, make("u", { style: thick }), text));
  }
}
