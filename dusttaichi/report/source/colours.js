// Colours of numbers and of classes, both told apart by colour-blind eyes.

// viridis, from matplotlib, at nine places
const VIRIDIS = [
  [68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
  [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37],
];

// Okabe & Ito 2008
const CLASSES = ["56b4e9", "e69f00", "009e73", "cc79a7", "f0e442", "0072b2", "d55e00", "999999"].map(
  (hex) => packed(...[0, 2, 4].map((k) => parseInt(hex.slice(k, k + 2), 16))),
);

// Colours as one number of four bytes, as the buffers of the graphics card have them.
export function packed(red, green, blue) {
  return ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}

const STEPS = Uint32Array.from({ length: 256 }, (_, n) => {
  const x = (n / 255) * (VIRIDIS.length - 1);
  const k = Math.min(Math.floor(x), VIRIDIS.length - 2);
  const [a, b] = [VIRIDIS[k], VIRIDIS[k + 1]];
  return packed(...a.map((v, c) => Math.round(v + (x - k) * (b[c] - v))));
});

export const ofNumber = (share) => STEPS[Math.round(255 * Math.min(Math.max(share, 0), 1))];
export const ofClass = (number) => CLASSES[number % CLASSES.length];
export const css = (colour) => `rgb(${colour & 255},${(colour >> 8) & 255},${(colour >> 16) & 255})`;

// what has no colour of its own
export const GREY = packed(184, 184, 189), PICKED = packed(255, 26, 26), RIGID = packed(140, 148, 158);
// contacts: without their forces, that push grains apart, that pull them together
export const ROD = packed(112, 112, 126), PUSHED = packed(205, 58, 40), PULLED = packed(58, 128, 214);

// Width of a rod in radii of the smaller grain: of a contact, of one that bears a share of the
// largest force that the legend names.
export const rodWidth = (share) => (share < 0 ? 0.13 : 0.06 + 0.6 * Math.sqrt(Math.min(share, 1)));
