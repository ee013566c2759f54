// The axes x, y and z as the camera sees them, in a corner of the picture.

import { Vector3 } from "three";

const SIZE = 66, LENGTH = 24; // pixels: of the corner, of an arrow that lies in the screen
const NAMES = ["x", "y", "z"];
const SVG = "http://www.w3.org/2000/svg";

function svg(tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

// Ends of the three arrows, [x, y, depth] in pixels from where they begin, y downwards.
export function arrows(camera) {
  return NAMES.map((_, axis) => {
    const way = new Vector3().setComponent(axis, 1).transformDirection(camera.matrixWorldInverse);
    return [LENGTH * way.x, -LENGTH * way.y, way.z];
  });
}

export class Triad {
  constructor(frame) {
    this.root = svg("svg", { class: "viewer-triad", width: SIZE, height: SIZE, role: "img", "aria-label": "axes" });
    this.parts = NAMES.map((name) => {
      const line = svg("line", { class: `axis-${name}`, x1: SIZE / 2, y1: SIZE / 2 });
      const text = svg("text", { class: `axis-${name}` });
      text.textContent = name;
      this.root.append(line, text);
      return { line, text };
    });
    frame.append(this.root);
  }

  show(camera) {
    arrows(camera).forEach(([x, y], axis) => {
      const { line, text } = this.parts[axis];
      const [right, down] = [SIZE / 2 + x, SIZE / 2 + y];
      line.setAttribute("x2", right);
      line.setAttribute("y2", down);
      const long = Math.hypot(x, y);
      const more = long > 4 ? 7 / long : 0; // the name stands beyond the end
      text.setAttribute("x", right + x * more);
      text.setAttribute("y", down + y * more + (more ? 0 : -7));
    });
  }
}
