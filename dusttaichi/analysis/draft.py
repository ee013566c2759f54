"""Drafts and runs with softened contacts, and their labels."""

from dusttaichi.scene.numerics import DRAFT


def draft_of(scene):
    """Reason why a run of a resolved scene (plain dicts) is a draft; "" for others."""
    numerics = scene.get("numerics") or {}
    scale = numerics.get("stiffness_scaling", 1.0)
    if numerics.get("accuracy") == DRAFT:
        return DRAFT
    return f"softened, {scale:g}" if isinstance(scale, (int, float)) and scale < 1.0 else ""


def named(name, scene):
    """The name of a run, of a draft with the reason in parentheses."""
    text = draft_of(scene)
    return f"{name} ({text})" if text else name


def mixture(runs):
    """A sentence where some of several Runs are drafts and others are not; else ""."""
    texts = {run.name: draft_of(run.scene) for run in runs}
    if len(set(texts.values())) < 2:
        return ""
    drafts = ", ".join(name for name, text in texts.items() if text)
    return (
        f"drafts beside others: {drafts}. Grains of a draft are heavier and softer: differences "
        "within its error, which dust check prints, say nothing about the samples"
    )
