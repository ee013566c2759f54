"""Random numbers by counters: of a seed, a particle and a step, the same in any thread."""

from math import pi

from dusttaichi.compute.engine import ti

FULL = 2.0**-32


@ti.func
def mix(word):
    """Hash of 32 bits whose bits depend on all of them (lowbias32 of C. Wellons)."""
    h = ti.cast(word, ti.u32)
    h = (h ^ (h >> 16)) * ti.u32(0x7FEB352D)
    h = (h ^ (h >> 15)) * ti.u32(0x846CA68B)
    return h ^ (h >> 16)


@ti.func
def uniform(seed, number, step, draw):
    """A number between 0 and 1, both excluded; draw: which one of several."""
    h = mix(ti.cast(seed, ti.u32) + ti.cast(draw, ti.u32) * ti.u32(0x9E3779B9))
    h = mix(h ^ ti.cast(number, ti.u32))
    h = mix(h ^ ti.cast(step, ti.u32))
    h = mix(h ^ ti.cast(step >> 32, ti.u32))
    return FULL * (ti.cast(h, ti.f64) + 0.5)


@ti.func
def normal_vector(seed, number, step):
    """Three independent normal numbers of variance 1 (Box & Muller 1958)."""
    first = ti.sqrt(-2.0 * ti.log(uniform(seed, number, step, 0)))
    second = ti.sqrt(-2.0 * ti.log(uniform(seed, number, step, 1)))
    angle = 2.0 * pi * uniform(seed, number, step, 2)
    third = ti.cos(2.0 * pi * uniform(seed, number, step, 3))
    return ti.Vector([first * ti.cos(angle), first * ti.sin(angle), second * third])
