// The view as text behind the # of the address, so that it can be copied, sent and opened again.

const rounded = (values) => values.map((v) => +v.toPrecision(5)).join(",");
const three = (text) => (text ?? "").split(",").map(Number);
const able = (values) => values.length === 3 && values.every(Number.isFinite);

// number: which of the pictures of the page. Colours are named, since pages differ in what they have.
export function written(viewer, number) {
  const { state, camera, controls, data, frame } = viewer;
  const view = new URLSearchParams({
    view: number,
    snapshot: frame,
    colour: data.quantities[state.quantity]?.label ?? "",
    show: state.show,
    eye: rounded(camera.position.clone().sub(controls.target).normalize().toArray()),
    up: rounded(camera.up.toArray()),
    middle: rounded(controls.target.toArray()),
    zoom: +camera.zoom.toPrecision(4),
  });
  if (state.plane !== "none") view.set("cut", `${state.plane},${state.share}`);
  if (viewer.run) view.set("run", viewer.run); // of a sweep
  if (state.picked >= 0) view.set("particle", state.picked);
  return view.toString();
}

// The number of the picture that a text is about, and its URLSearchParams; null of any other text.
export function read(hash) {
  const view = new URLSearchParams(hash.replace(/^#/, ""));
  return view.has("view") ? [Number(view.get("view")), view] : null;
}

// What a text says of a picture; what cannot be used of it is left as it is.
export function apply(viewer, view) {
  const { state, data } = viewer;
  const colour = data.quantities.findIndex((q) => q.label === view.get("colour"));
  if (colour >= 0) state.quantity = colour;
  if (viewer.shows.some(([name]) => name === view.get("show"))) state.show = view.get("show");
  const [plane, share] = (view.get("cut") ?? "none,0.5").split(",");
  if (["none", "x", "y", "z"].includes(plane)) state.plane = plane;
  if (share >= 0 && share <= 1) state.share = Number(share);
  const picked = Number(view.get("particle") ?? -1);
  state.picked = Number.isInteger(picked) && picked < data.count ? picked : -1;
  const [eye, up, middle] = ["eye", "up", "middle"].map((name) => three(view.get(name)));
  if (able(eye) && able(up) && able(middle)) viewer.lookAlong(eye, up, middle, Number(view.get("zoom")) || 1);
  const frame = Number(view.get("snapshot") ?? viewer.frame);
  viewer.go(Number.isInteger(frame) ? frame : viewer.frame);
}
