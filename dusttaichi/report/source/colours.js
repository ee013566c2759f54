// Colours of numbers and of classes, both told apart by colour-blind eyes.

// viridis, from matplotlib, at nine places
const VIRIDIS = [
  [68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
  [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37],
];

// Okabe & Ito 2008
const CLASSES = ["56b4e9", "e69f00", "009e73", "cc79a7", "f0e442", "0072b2", "d55e00", "999999"].map(
  (hex) => [0, 2, 4].map((k) => parseInt(hex.slice(k, k + 2), 16)),
);

// 256 steps of it, as bytes
const STEPS = Uint8Array.from({ length: 3 * 256 }, (_, n) => {
  const x = (Math.floor(n / 3) / 255) * (VIRIDIS.length - 1);
  const k = Math.min(Math.floor(x), VIRIDIS.length - 2);
  return Math.round(VIRIDIS[k][n % 3] + (x - k) * (VIRIDIS[k + 1][n % 3] - VIRIDIS[k][n % 3]));
});

// Both write three bytes into out, from `at` on.
export function ofNumber(share, out, at) {
  const k = 3 * Math.round(255 * Math.min(Math.max(share, 0), 1));
  for (let c = 0; c < 3; c++) out[at + c] = STEPS[k + c];
}

export function ofClass(number, out, at) {
  const colour = CLASSES[number % CLASSES.length];
  for (let c = 0; c < 3; c++) out[at + c] = colour[c];
}

export function css(fill, value) {
  const rgb = [0, 0, 0];
  fill(value, rgb, 0);
  return `rgb(${rgb.join(",")})`;
}
