// A figure of Python (dusttaichi/report/interactive.py) as plotly.js draws it in a place of a given
// width: columns of axes below one another where they would be too narrow, the legend below them in
// as many rows as it needs, and all of it in light colours on a dark page.

const NARROW = 560; // pixels, below which columns of axes are put below one another
const PANEL = 230; // pixels of height of each of them then
const LETTER = 6.6, KEY = 52; // pixels of a letter of the legend, and of the line before a name
const ROW = 19; // pixels of a row of the legend
const INK = "#e3e7ee", LINE = "#8b94a3", GRID = "#2c323c";

const axesOf = (layout, which) =>
  Object.keys(layout).filter((name) => name.startsWith(`${which}axis`)).map((name) => layout[name]);

// -> {data, layout} for Plotly.react. width: pixels; dark: of the page. figure.more: pixels by which
// it is taller than it would be.
export function arranged(figure, width, dark) {
  const data = structuredClone(figure.data), layout = structuredClone(figure.layout);
  const narrow = width < NARROW;
  let height = figure.height;
  if (narrow) height = stack(layout) ?? (rowsOf(layout) > 1 ? height : Math.min(height, 360));
  if (narrow) Object.assign(layout, { dragmode: false }); // a finger scrolls the page
  const rows = legend([...data, ...layout.shapes], width - layout.margin.l - layout.margin.r);
  layout.margin.b += rows * ROW + (rows ? 8 : 0);
  Object.assign(layout, { width, height: height + rows * ROW + (figure.more ?? 0) });
  if (dark) darken(data, layout);
  return { data, layout };
}

const rowsOf = (layout) => new Set(axesOf(layout, "y").map((axis) => axis.domain[0].toFixed(2))).size;

// One column in place of several; the height it takes, or undefined where there is one already.
function stack(layout) {
  const across = axesOf(layout, "x"), up = axesOf(layout, "y");
  if (new Set(across.map((axis) => axis.domain[0].toFixed(2))).size < 2) return undefined;
  const order = across.map((_, k) => k).sort((a, b) =>
    up[b].domain[1] - up[a].domain[1] || across[a].domain[0] - across[b].domain[0],
  );
  const titles = across.find((axis) => axis.title?.text)?.title;
  const share = 1 / order.length, gap = 0.28 * share;
  order.forEach((panel, row) => {
    across[panel].domain = [0, 1];
    up[panel].domain = [Math.max(1 - (row + 1) * share + (row + 1 < order.length ? gap : 0), 0), 1 - row * share];
    for (const axis of [across[panel], up[panel]]) axis.showticklabels = true;
    if (row + 1 === order.length && titles && !across[panel].title?.text) across[panel].title = titles;
  });
  return order.length * PANEL + layout.margin.t + layout.margin.b;
}

// Breaks names that are longer than the legend is wide; returns the rows that it takes.
function legend(entries, width) {
  const most = Math.max(Math.floor((width - KEY) / LETTER), 12);
  const named = new Map();
  for (const entry of entries.filter((one) => one.showlegend && one.name)) {
    entry.name = broken(entry.name, most);
    const lines = entry.name.split("<br>");
    named.set(entry.name, [lines.length, Math.max(...lines.map((line) => plain(line).length))]);
  }
  if (!named.size) return 0;
  const sizes = [...named.values()];
  const widest = KEY + LETTER * Math.max(...sizes.map(([, letters]) => letters));
  const abreast = Math.max(1, Math.floor(width / widest));
  const lines = Math.max(...sizes.map(([count]) => count));
  return Math.ceil(sizes.length / abreast) * lines;
}

const plain = (text) => text.replace(/<[^>]*>/g, "").replace(/&lt;/g, "<");

function broken(text, most) {
  if (plain(text).length <= most) return text;
  const lines = [""];
  for (const word of text.split(" ")) {
    const longer = lines.at(-1) ? `${lines.at(-1)} ${word}` : word;
    if (plain(longer).length <= most || !lines.at(-1)) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines.join("<br>");
}

// -- dark -----------------------------------------------------------------------------------------

function parsed(colour) {
  if (/^#[0-9a-f]{6}$/i.test(colour)) return [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)).concat(1);
  if (/^#[0-9a-f]{3}$/i.test(colour)) return [1, 2, 3].map((k) => 17 * parseInt(colour[k], 16)).concat(1);
  const found = /^rgba?\(([^)]*)\)$/.exec(colour);
  return found ? [...found[1].split(",").map(Number), 1].slice(0, 4) : null;
}

// A colour that was meant for white paper, for a dark page: greys are turned round, what is too dark
// to be seen becomes lighter, and everything else stays.
export function nightly(colour) {
  const found = typeof colour === "string" ? parsed(colour) : null;
  if (!found) return colour;
  let [r, g, b] = found;
  const alpha = found[3];
  if (Math.max(r, g, b) - Math.min(r, g, b) < 20) {
    [r, g, b] = [r, g, b].map((v) => 230 - 0.85 * v);
  } else {
    const seen = (0.2126 * r + 0.7152 * g + 0.0722 * b) / 255;
    const more = Math.min(Math.max((0.45 - seen) * 1.1, 0), 0.5);
    [r, g, b] = [r, g, b].map((v) => v + more * (255 - v));
  }
  return `rgba(${Math.round(r)},${Math.round(g)},${Math.round(b)},${alpha})`;
}

function darken(data, layout) {
  layout.font = { ...layout.font, color: INK };
  layout.plot_bgcolor = layout.paper_bgcolor = "rgba(0,0,0,0)";
  layout.legend = { ...layout.legend, bgcolor: "rgba(0,0,0,0)" };
  layout.hoverlabel = { font: { color: INK }, bgcolor: "#1f242c" };
  layout.modebar = { color: LINE, activecolor: INK, bgcolor: "rgba(0,0,0,0)" };
  for (const axis of [...axesOf(layout, "x"), ...axesOf(layout, "y")]) {
    Object.assign(axis, { linecolor: LINE, tickcolor: LINE, gridcolor: GRID });
  }
  for (const note of layout.annotations) note.font = { ...note.font, color: INK };
  for (const part of [...data, ...layout.shapes]) turnColours(part);
}

function turnColours(part) {
  if (part.fillcolor) part.fillcolor = nightly(part.fillcolor);
  for (const own of [part.line, part.marker, part.marker?.line]) {
    if (!own?.color) continue;
    own.color = Array.isArray(own.color) ? own.color.map(nightly) : nightly(own.color);
  }
}
