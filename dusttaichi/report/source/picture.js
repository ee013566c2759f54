// The picture of a viewer as a PNG: the particles, what is written over them, and the legend.

const PAD = 12;

export function paint(viewer) {
  viewer.render();
  const { canvas } = viewer, ratio = canvas.width / canvas.clientWidth;
  const legend = viewer.panel.legendForPicture();
  const foot = legend ? 34 * ratio : 0;
  const sheet = document.createElement("canvas");
  sheet.width = canvas.width;
  sheet.height = canvas.height + foot;
  const pen = sheet.getContext("2d");
  const style = getComputedStyle(viewer.canvas.parentElement);
  pen.fillStyle = style.backgroundColor;
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.drawImage(canvas, 0, 0);
  pen.scale(ratio, ratio);
  pen.fillStyle = pen.strokeStyle = style.color;
  pen.font = `14px ${style.fontFamily}`;
  pen.textBaseline = "top";
  pen.fillText(viewer.data.said[viewer.frame], PAD, PAD);
  const bar = viewer.panel.bar, low = canvas.clientHeight - PAD;
  pen.fillRect(PAD, low - 3, bar.width, 3);
  pen.textBaseline = "bottom";
  pen.fillText(bar.text, PAD, low - 6);
  if (legend) paintLegend(pen, legend, canvas.clientHeight);
  return sheet;
}

// legend: {label, stops, low, high} of numbers, or {label, classes: [[name, colour]]}
function paintLegend(pen, legend, top) {
  const ink = pen.fillStyle, middle = top + 17;
  let x = PAD;
  const write = (text) => {
    pen.fillStyle = ink;
    pen.fillText(text, x, middle);
    x += pen.measureText(text).width + 8;
  };
  pen.textBaseline = "middle";
  write(`${legend.label}:`);
  for (const [name, colour] of legend.classes ?? []) {
    pen.fillStyle = colour;
    pen.fillRect(x, middle - 6, 12, 12);
    x += 17;
    write(name);
  }
  if (!legend.stops) return;
  write(legend.low);
  const ramp = pen.createLinearGradient(x, 0, x + 140, 0);
  legend.stops.forEach((colour, k) => ramp.addColorStop(k / (legend.stops.length - 1), colour));
  pen.fillStyle = ramp;
  pen.fillRect(x, middle - 5, 140, 10);
  x += 148;
  write(legend.high);
}

export async function save(viewer, name) {
  const blob = await new Promise((done) => paint(viewer).toBlob(done, "image/png"));
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
