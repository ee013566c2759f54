"""Run-time arguments of the kernels of a scene, beside the numbers of the material."""

from dusttaichi.compute.engine import ti


def numbers_type(dimension):
    """The struct of the numbers of a step [SI]; a change of their values compiles nothing."""
    return ti.types.struct(
        count=ti.i32,  # particles without ghosts
        bodies=ti.i32,
        output_step=ti.f64,  # length of an output step
        h=ti.f64,
        inv_h=ti.f64,
        scale=ti.f64,  # of the kernel
        courant=ti.f64,
        contact=ti.f64,  # viscosity: at contacts, in the bulk, quadratic, on grid noise
        bulk=ti.f64,
        quadratic=ti.f64,
        grid=ti.f64,
        limiter=ti.f64,  # 1: Balsara's, 0: none
        share=ti.f64,  # of the trace of the strain rate that leaves the deviator: 1/3, or 1/2
        over_return=ti.f64,  # 0: radial return, 1: the one of Benz & Asphaug
        tension=ti.f64,  # artificial stress: share, exponent, 1/shape of the kernel at the spacing
        exponent=ti.f64,
        at_spacing=ti.f64,
        hourglass=ti.f64,  # stiffness against hourglass modes, 1: that of longitudinal waves
        way2=ti.f64,  # square of the way after which a search is due
        period=ti.types.vector(
            dimension, ti.f64
        ),  # of repeating axes, and one over it; 0 of others
        inv_period=ti.types.vector(dimension, ti.f64),
        gravity=ti.types.vector(dimension, ti.f64),
        longest=ti.f64,  # step that forces from outside allow
        attraction=ti.f64,  # constant of gravity [m^3/(kg s^2)], square of the softening [m^2]
        soft2=ti.f64,
    )
