// Puts a page together from its data: tables, figures, particles; and lets it grow while a run does.

import { arranged } from "./figures.js";
import { apply, read } from "./link.js";
import { make } from "./panel.js";
import { isDark, onTheme, toggle } from "./theme.js";
import { Viewer } from "./viewer.js";

const CONFIG = {
  displaylogo: false,
  modeBarButtonsToRemove: ["sendChartToCloud", "lasso2d", "select2d"], // nothing leaves the page
  toImageButtonOptions: { format: "svg" },
};
const problems = [];
window.addEventListener("error", (e) => problems.push(e.message));
window.addEventListener("unhandledrejection", (e) => problems.push(`${e.reason}`));

// what each place shows, and how wide it was when it was drawn
const shown = new Map();

// a figure is as wide as its place, also when a scroll bar comes or a column goes
const fitting = new ResizeObserver((seen) => requestAnimationFrame(() => {
  for (const { target } of seen) if (target.offsetParent) draw(target, shown.get(target)?.figure); // it is still there
}));
onTheme(() => shown.forEach((_, place) => (place.isConnected ? draw(place, null, true) : shown.delete(place))));

const LONG = 24; // letters from which the text of a cell is broken into lines

function table(rows, heads) {
  const cell = (text, k) => make(k ? "td" : "th", text.length > LONG ? { class: "long" } : {}, text);
  const body = rows.map((row) => make("tr", {}, ...row.map(cell)));
  const head = heads ? [make("tr", {}, ...heads.map((h) => make("th", {}, h)))] : [];
  return make("table", { class: "numbers" }, make("thead", {}, ...head), make("tbody", {}, ...body));
}

// of one run, beside the literature where it has something
function numbersOf(run) {
  const heads = ["", "run", ...(run.table.some((row) => row[2]) ? ["literature"] : [])];
  return table(run.table.map((row) => row.slice(0, heads.length)), heads);
}

// of many columns, in which long texts alone are broken
function wide(made) {
  made.classList.add("wide");
  return made;
}

function section(title, ...inside) {
  return make("section", {}, make("h2", {}, title), ...inside);
}

// Figures in two columns where there is room, and below them those of several columns of axes and
// pictures, as wide as the page. The shorter column is stretched: there are no holes.
function figures(list) {
  const grid = make("div", { class: "figures" });
  const entries = list.map((figure) => {
    const place = make("div", { class: figure.image ? "picture" : "figure", id: `figure-${figure.name}` });
    if (figure.image) place.append(picture(figure));
    const entry = { figure, place, element: make("figure", {}, make("figcaption", {}, figure.title), place) };
    return { ...entry, wide: Boolean(figure.wide || figure.image) };
  });
  let abreast = 0;
  const arrange = () => {
    const count = grid.clientWidth < TWO_COLUMNS ? 1 : 2;
    if (!grid.clientWidth || count === abreast) return;
    abreast = count;
    const columns = inColumns(entries, count, grid.clientWidth / count - GAP);
    const wide = count > 1 ? entries.filter((entry) => entry.wide) : [];
    const parts = columns.map((column) => make("div", {}, ...column.map((entry) => entry.element)));
    grid.replaceChildren(make("div", { class: "columns" }, ...parts), ...wide.map((entry) => entry.element));
    for (const { figure, place } of entries) if (!figure.image) draw(place, figure, true);
  };
  new ResizeObserver(() => requestAnimationFrame(arrange)).observe(grid);
  return grid;
}

// A picture of pixels for white paper and one for a dark page.
function picture(figure) {
  const image = make("img", { alt: figure.title });
  const show = () => (image.src = isDark() ? figure.image_dark : figure.image);
  show();
  const end = onTheme(() => (image.isConnected ? show() : end()));
  return image;
}

const TWO_COLUMNS = 860, GAP = 16; // pixels: from which on there are two, and between them

// Entries that are not wide (of one column all of them, in their order) in `count` columns of about
// one height; the figures of a shorter one become taller, evenly.
function inColumns(entries, count, width) {
  const columns = Array.from({ length: count }, () => []), heights = columns.map(() => 0);
  for (const entry of entries.filter((one) => count === 1 || !one.wide)) {
    const least = heights.indexOf(Math.min(...heights));
    columns[least].push(entry);
    entry.figure.more = 0;
    if (!entry.figure.image) heights[least] += arranged(entry.figure, width, false).layout.height + TITLE;
  }
  const most = Math.max(...heights);
  columns.forEach((column, k) => {
    for (const { figure } of column) figure.more = (most - heights[k]) / column.length;
  });
  return columns;
}

const TITLE = 38; // pixels of the title of a figure, and of the gap below it

async function draw(place, figure, anyway = false) {
  const before = shown.get(place), width = place.clientWidth;
  if (before && figure && figure !== before.figure) figure.more = before.figure.more; // of a run that grows
  figure = figure ?? before.figure;
  if (!anyway && before?.figure === figure && before.width === width) return;
  shown.set(place, { figure, width });
  const { data, layout } = arranged(figure, width, isDark());
  place.style.height = `${layout.height}px`;
  await window.Plotly.react(place, data, { ...layout, uirevision: "kept" }, CONFIG);
  if (!before) fitting.observe(place);
}

// how something was made: its scene, and what made it
function origin({ scene, provenance }) {
  const folded = (what, inside) => make("details", {}, make("summary", {}, what), inside);
  return [
    section("Scene", folded("YAML with every default", make("pre", {}, scene))),
    section("Provenance", folded("version, machine, command", table(provenance))),
  ];
}

// Particles of one of several runs at a time, chosen by name.
async function showViews(main, views) {
  const stage = make("div", { class: "viewer" });
  let asked = 0;
  const linked = read(window.location.hash)?.[1].get("run");
  const first = Math.max(views.findIndex(({ name }) => name === linked), 0);
  const open = async (number) => {
    const mine = (asked += 1);
    window.dust.viewers.pop()?.close();
    stage.replaceChildren();
    const viewer = await Viewer.open(stage, views[number].particles);
    if (mine !== asked) return viewer.close(); // another was chosen meanwhile
    viewer.run = views[number].name;
    window.dust.viewers = [viewer];
  };
  const options = views.map(({ name }, k) => make("option", { value: k }, name));
  const select = make("select", { "aria-label": "run", onchange: (e) => open(Number(e.target.value)) }, ...options);
  const label = make("label", { class: "chosen" }, make("span", {}, "run"), select);
  main.append(section("Particles", label, stage));
  select.value = first;
  await open(first);
}

// An ensemble or a sweep: curves, numbers against the keys, its runs.
async function showEnsemble(main, data) {
  main.append(section("Curves and numbers", figures(data.figures)));
  const remark = data.remark ? [make("p", { class: "hint" }, data.remark)] : [];
  main.append(section("Table", wide(table(data.table.slice(1), data.table[0])), ...remark));
  if (data.views.length) await showViews(main, data.views);
  if (data.members.length) main.append(section("Runs", table(data.members.slice(1), data.members[0])));
  main.append(...origin(data));
}

async function showRun(host, run, several) {
  const parts = [];
  if (several) parts.push(make("h1", {}, run.name));
  parts.push(make("p", { class: "status" }, run.status));
  const stage = make("div", { class: "viewer" });
  if (run.particles) parts.push(section("Particles", stage));
  if (run.figures.length) parts.push(section("Figures", figures(run.figures)));
  parts.push(section("Numbers", numbersOf(run)));
  parts.push(...origin(run));
  host.replaceChildren(...parts);
  if (run.particles) window.dust.viewers.push(await Viewer.open(stage, run.particles));
}

async function show(data) {
  document.title = data.title;
  const main = document.querySelector("main");
  if (data.viewer) {
    // the particles alone, for a notebook
    const stage = make("div", { class: "viewer" });
    document.body.classList.add("bare");
    main.replaceChildren(stage);
    window.dust.viewers = [await Viewer.open(stage, data.viewer)];
    return;
  }
  const light = make("button", { type: "button", class: "theme", onclick: toggle }, "light / dark");
  main.replaceChildren(light, make("h1", {}, data.title), make("p", { class: "lead" }, data.lead));
  window.dust.viewers = [];
  if (data.views) return showEnsemble(main, data);
  if (data.table.length) main.append(section("Side by side", wide(table(data.table.slice(1), data.table[0]))));
  if (data.figures.length) main.append(section("Together", figures(data.figures)));
  for (const run of data.runs) {
    const host = make("article", {});
    main.append(host);
    await showRun(host, run, data.runs.length > 1);
  }
}

// -- a run that goes on ---------------------------------------------------------------------------

// What the reader has set stays: the page is not made anew, its parts take the new data.
async function grow(data) {
  const [run] = data.runs;
  document.querySelector(".lead").textContent = data.lead;
  document.querySelector(".status").textContent = run.status;
  const numbers = [...document.querySelectorAll("section")].find((s) => s.querySelector("h2").textContent === "Numbers");
  numbers.querySelector("table").replaceWith(numbersOf(run));
  for (const figure of run.figures) {
    const place = document.getElementById(`figure-${figure.name}`);
    if (!place || figure.image) return show(data); // a figure that was not there
    draw(place, figure);
  }
  const [viewer] = window.dust.viewers;
  if (!run.particles || viewer?.data.frames === run.particles.frames) return;
  if (!viewer) return show(data);
  const { state, frame, camera, controls } = viewer;
  const atEnd = frame === viewer.data.frames - 1;
  const host = viewer.host;
  viewer.close();
  host.replaceChildren();
  const next = await Viewer.open(host, run.particles);
  Object.assign(next.state, { ...state, playing: false });
  const eye = camera.position.clone().sub(controls.target);
  next.lookAlong(eye.toArray(), camera.up.toArray(), controls.target.toArray(), camera.zoom);
  next.go(atEnd ? run.particles.frames - 1 : frame);
  window.dust.viewers = [next];
}

async function watch(stamp) {
  for (;;) {
    await new Promise((done) => setTimeout(done, 2000));
    try {
      const answer = await fetch(`data.json?after=${stamp}`);
      if (answer.status === 204) continue;
      const data = await answer.json();
      stamp = data.stamp;
      await grow(data);
      window.dust.grown += 1;
      if (!data.live) return;
    } catch {
      document.querySelector(".lead").textContent = "The server has ended; this is the last it showed.";
      return;
    }
  }
}

// the view that the address names
function openLink() {
  const found = read(window.location.hash), viewer = window.dust.viewers[found?.[0]];
  if (!viewer) return;
  apply(viewer, found[1]);
  viewer.host.scrollIntoView({ block: "nearest" });
}

window.dust = { viewers: [], problems, ready: false, grown: 0, Viewer };
window.addEventListener("hashchange", openLink);
const place = document.getElementById("data");
if (place) {
  const data = JSON.parse(place.textContent);
  show(data)
    .then(() => openLink())
    .then(() => (window.dust.ready = true))
    .then(() => data.live && watch(data.stamp))
    .catch((error) => {
      problems.push(`${error}`);
      document.querySelector("main").prepend(make("p", { class: "problem" }, `${error}`));
    });
}
