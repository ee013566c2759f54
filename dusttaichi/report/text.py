"""Labels and colours of matplotlib for HTML."""

import re

from matplotlib.colors import to_rgba

GREEK = {
    "phi": "φ", "Delta": "Δ", "delta": "δ", "mu": "µ", "gamma": "γ", "sigma": "σ", "xi": "ξ",
    "rho": "ρ", "eta": "η", "theta": "θ", "pi": "π", "alpha": "α", "beta": "β", "pm": "±",
    "propto": "∝", "times": "×", "cdot": "·", "leq": "≤", "geq": "≥", "approx": "≈", "sqrt": "√",
    "langle": "⟨", "rangle": "⟩", "infty": "∞", "varphi": "φ", "epsilon": "ε", "Sigma": "Σ",
    "sim": "∼", "lambda": "λ", "tau": "τ", "to": "→", "rightarrow": "→", "Phi": "Φ",
}  # fmt: skip


def html(text):
    """A label with formulas ($...$, for matplotlib) as HTML."""
    text = text.replace("<", "&lt;")
    return re.sub(r"\$([^$]*)\$", lambda found: _formula(found[1]), text)


def _formula(text):
    text = re.sub(r"\\(?:rm|mathrm|text|mathit|left|right|!)\s?", "", text)
    text = re.sub(r"\\[,; ]", " ", text)
    text = re.sub(r"\\([A-Za-z]+)", lambda m: GREEK.get(m[1], m[1]), text)
    for mark, tag in (("_", "sub"), ("\\^", "sup")):
        text = re.sub(mark + r"\{([^{}]*)\}", rf"<{tag}>\1</{tag}>", text)
        text = re.sub(mark + r"(\w)", rf"<{tag}>\1</{tag}>", text)
    return re.sub(r" +", " ", text.replace("{", "").replace("}", "").replace("-", "−")).strip()


def css(colour):
    """A colour of matplotlib for CSS; "none" is transparent."""
    if isinstance(colour, str) and colour == "none":
        return "rgba(0,0,0,0)"
    r, g, b, a = to_rgba(colour)
    return f"rgba({255 * r:.0f},{255 * g:.0f},{255 * b:.0f},{a:.3g})"
