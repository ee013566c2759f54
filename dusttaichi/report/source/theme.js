// Light or dark: what the system prefers until the reader chooses; always light on paper.

const DARK = window.matchMedia("(prefers-color-scheme: dark)");
const KEY = "dusttaichi-theme";
const listeners = new Set();
let chosen = remembered();
let printing = false;

function remembered() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null; // a page in a frame has no storage
  }
}

export const isDark = () => !printing && (chosen ? chosen === "dark" : DARK.matches);

// act() is called after each change; returns a function that ends this.
export function onTheme(act) {
  listeners.add(act);
  return () => listeners.delete(act);
}

function changed() {
  document.documentElement.dataset.theme = isDark() ? "dark" : "light";
  for (const act of listeners) act();
}

export function toggle() {
  chosen = isDark() ? "light" : "dark";
  try {
    localStorage.setItem(KEY, chosen);
  } catch {
    // it holds until the page is closed
  }
  changed();
}

DARK.addEventListener("change", changed);
for (const [name, value] of [["beforeprint", true], ["afterprint", false]]) {
  window.addEventListener(name, () => {
    printing = value;
    changed();
  });
}
changed();
