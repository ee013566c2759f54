"""Work and losses of forces from outside, from the change of the sums of a method."""


def split_work(model, change):
    """(work by law, losses by channel) of a ForceModel.

    change: of the potential energies, then energies by `ForceModel.powers`.
    """
    works = dict.fromkeys(range(len(model.laws)), 0.0)
    losses = dict.fromkeys(model.channels, 0.0)
    for k, n in enumerate(model.potentials):
        works[n] = -change[k]
    for k, (n, of_flow) in enumerate(model.powers, len(model.potentials)):
        channel = getattr(model.laws[n], "CHANNEL", None)
        if of_flow or channel is None:
            works[n] += change[k]
        if channel is not None:
            losses[channel] += change[k] if of_flow else -change[k]
    return works, losses
