"""Kinematics of a contact: relative motion over a step, rolling and sliding displacement.

The contact pointers n1, n2 of S12 (sect. 2.1.3) are fixed in the grains and point along -n_c and
n_c but for small angles, some 1e-3. A unit vector in single precision has a rounding of 6e-8; the
displacements that follow from the pointers,

xi = R (n1 + n2)  (S12 eq 8),    zeta = r1 n1 - r2 n2 + (r1 + r2) n_c  (S12 eq 9),

have 6e-8 of themselves. So a contact keeps xi and zeta, and the pointers follow from them:

n1 = -n_c + e1,  e1 = xi/r1 + zeta/(r1 + r2);    n2 = n_c + e2,  e2 = xi/r2 - zeta/(r1 + r2).

Only the components across n_c are displacements of springs; those along n_c follow from the unit
length of the pointers. A wall is a second body of infinite radius: 1/r2 = 1/(r1 + r2) = 0, n2 = n_c
is its normal, and zeta is S12 eq 24.

Differences of large numbers are formed in double precision by the caller: the distance vector d of
the centres and the gap touch^2 - d.d. `touch` is r1 + r2; softened contacts form earlier, but their
zeta is still that of surfaces at the radii.
"""

from functools import cache

from dusttaichi.compute.engine import ti


@cache
def motion_type(dtype):
    """The struct Motion: relative motion of two bodies for all effects, in `dtype`."""
    vec3 = ti.types.vector(3, dtype)

    @ti.dataclass
    class Motion:
        overlap: dtype  # distance at first contact less the current distance (from a wall)
        distance_inverse: dtype  # one over the distance of the centres
        normal: vec3  # n_c, from the second body to the first
        turned: vec3  # change of n_c over the last step
        middle: vec3  # n_c half a step ago, when the velocities are
        speed: dtype  # rate of the distance half a step ago: its change over dt
        speed_now: dtype  # of the relative velocity along the current n_c
        speed_before: dtype  # along that of the previous step
        struck: dtype  # change of `speed` by impulses of the step before, which effects add to
        velocity: vec3  # of the first centre relative to the second
        spin_1: vec3
        spin_2: vec3
        rotation_1: vec3  # in the last step
        rotation_2: vec3
        slip: vec3  # displacement of the contact point by the translation alone
        touched_before: dtype  # 1 where the contact touched a step ago, else 0
        touches: dtype  # 1 where it touches now
        elastic_force: dtype  # of the normal law, positive where it pushes
        elastic_energy: dtype
        contact_radius: dtype  # in units of that at equilibrium
        rolling_rate: vec3  # of xi in the last step
        sliding_rate: vec3  # of zeta
        along_1: dtype  # components along n_c of the deviations of the pointers
        along_2: dtype
        pointer_1: vec3  # n1, n2 (S12 sect. 2.1.3)
        pointer_2: vec3
        lever: dtype  # (r1 n1 - r2 n2).n_c over the distance (S12 eq 13), -1 on a wall
        zeta_along: dtype  # component of r1 n1 - r2 n2 + (r1 + r2) n_c along n_c

    return Motion


@cache
def load_type(dtype):
    """The struct Load: forces and torques of the effects on the two bodies of a contact."""
    vec3 = ti.types.vector(3, dtype)

    @ti.dataclass
    class Load:
        push: dtype  # force along n_c on the first body
        force: vec3  # any other force on it, minus that on the second
        pull_1: vec3  # on the pointers: dU/dn_i, which turns grain i by pull_i x n_i
        pull_2: vec3
        torque_1: vec3  # any other torque
        torque_2: vec3

    return Load


@ti.func
def pair_motion(Motion: ti.template(), d, gap, dv, w1, w2, dt, constants):
    """Motion of two grains over the last step.

    d, dv: distance vector from the second to the first centre now and its rate half a step ago, so
    that it was d - dv dt a step ago; gap: touch^2 - d.d, negative where the grains are apart; w1,
    w2: spins.
    """
    touch = constants.touch
    length = ti.sqrt(touch * touch - gap)
    both = length + touch
    quotient = 1.0 / (length * both)  # the one division
    inverse = quotient * both
    normal = d * inverse
    slope = (d - dv * (0.5 * dt)).dot(dv) * inverse
    speed = slope * (1.0 + 0.5 * dt * slope * inverse)
    nearer = speed * dt * inverse  # 1/(distance a step ago) = inverse/(1 - nearer)
    turned = (dv - normal * speed) * (dt * inverse * (1.0 + nearer * (1.0 + nearer)))
    return Motion(
        overlap=gap * quotient * length,
        distance_inverse=inverse,
        normal=normal,
        turned=turned,
        middle=normal - 0.5 * turned,
        speed=speed,
        speed_now=dv.dot(normal),
        speed_before=dv.dot(normal - turned),
        velocity=dv,
        spin_1=w1,
        spin_2=w2,
        rotation_1=w1 * dt,
        rotation_2=w2 * dt,
        slip=(constants.r1 + constants.r2) * turned,
    )


@ti.func
def wall_motion(Motion: ti.template(), overlap, normal, dv, w1, dt):
    """Motion of a grain against a wall; normal: that of the wall, into the sample."""
    speed = dv.dot(normal)
    return Motion(
        overlap=overlap,
        normal=normal,
        middle=normal,
        speed=speed,
        speed_now=speed,
        speed_before=speed,
        velocity=dv,
        spin_1=w1,
        rotation_1=w1 * dt,
        slip=dv * dt,
    )


@ti.func
def surface_motion(Motion: ti.template(), overlap, normal, turned, speed, dv, spin_1, spin_2, dt):
    """Motion of a grain against a curved surface that may turn.

    turned: change of its normal over the last step; speed: rate of the distance half a step ago;
    dv: velocity of the grain relative to the point of the surface that it touches. The motion of
    that point by the turn of the surface is in dv: the second body has no lever.
    """
    return Motion(
        overlap=overlap,
        normal=normal,
        turned=turned,
        middle=normal - 0.5 * turned,
        speed=speed,
        speed_now=dv.dot(normal),
        speed_before=dv.dot(normal - turned),
        velocity=dv,
        spin_1=spin_1,
        spin_2=spin_2,
        rotation_1=spin_1 * dt,
        rotation_2=spin_2 * dt,
        slip=dv * dt,
    )


@ti.func
def rotation(n, angle):
    """Change of n under the rotation by the vector `angle`, to second order."""
    return angle.cross(n + 0.5 * angle.cross(n))


@ti.func
def across(a, normal):
    """The component of a across the normal."""
    return a - normal * a.dot(normal)


@ti.func
def axial_deficit(e, along):
    """1 - sqrt(1 - e.e): what a unit pointer that deviates by e across n_c falls short of 1 along.

    along: component of the deviation along n_c before, which decides the half of the turn where
    nothing keeps pointers from turning away from the line of centres.
    """
    return 1.0 + ti.select(along > 1.0, 1.0, -1.0) * ti.sqrt(ti.max(1.0 - e.dot(e), 0.0))


@ti.func
def deviations(history: ti.template(), constants):
    """e1 = n1 + n_c and e2 = n2 - n_c of the displacements xi and zeta."""
    return (
        history.xi * constants.inv_r1 + history.zeta * constants.inv_sum,
        history.xi * constants.inv_r2 - history.zeta * constants.inv_sum,
    )


@ti.func
def carry(motion: ti.template(), history: ti.template(), constants):
    """Rotate the pointers with their grains: xi and zeta become current, perpendicular to n_c."""
    previous_normal = motion.normal - motion.turned
    e1, e2 = deviations(history, constants)
    n1, n2 = e1 - previous_normal, e2 + previous_normal
    by_1, by_2 = rotation(n1, motion.rotation_1), rotation(n2, motion.rotation_2)
    motion.rolling_rate = (motion.spin_1.cross(n1) + motion.spin_2.cross(n2)) * constants.R
    motion.sliding_rate = across(
        motion.spin_1.cross(n1) * constants.r1
        - motion.spin_2.cross(n2) * constants.r2
        + motion.velocity,
        motion.normal,
    )
    motion.along_1 = (e1 + by_1 + motion.turned).dot(motion.normal)
    motion.along_2 = -(e2 + by_2 - motion.turned).dot(motion.normal)
    history.xi = across(history.xi + (by_1 + by_2) * constants.R, motion.normal)
    history.zeta = across(
        history.zeta + by_1 * constants.r1 - by_2 * constants.r2 + motion.slip, motion.normal
    )


@ti.func
def point(motion: ti.template(), history: ti.template(), constants, flat: ti.template()):
    """Pointers of the displacements across n_c: their components along it follow from unit length.

    xi includes its component; zeta is across n_c for the effects, and `zeta_along` is its component
    along n_c. flat: the second body is a wall.
    """
    e1, e2 = deviations(history, constants)
    short_1, short_2 = axial_deficit(e1, motion.along_1), axial_deficit(e2, motion.along_2)
    history.xi = history.xi + motion.normal * (constants.R * (short_1 - short_2))
    motion.lever = -1.0
    if ti.static(not flat):
        motion.zeta_along = constants.r1 * short_1 + constants.r2 * short_2
        motion.lever = (motion.zeta_along - constants.r1 - constants.r2) * motion.distance_inverse
    motion.pointer_1 = e1 + motion.normal * (short_1 - 1.0)
    motion.pointer_2 = e2 - motion.normal * (short_2 - 1.0)


@ti.func
def point_as_kept(motion: ti.template(), history: ti.template(), constants, flat: ti.template()):
    """Pointers from a stored history, whose zeta still has its component along n_c."""
    e1, e2 = deviations(history, constants)
    motion.pointer_1, motion.pointer_2 = e1 - motion.normal, e2 + motion.normal
    motion.lever = -1.0
    if ti.static(not flat):
        motion.zeta_along = history.zeta.dot(motion.normal)
        motion.lever = (motion.zeta_along - constants.r1 - constants.r2) * motion.distance_inverse
        history.zeta = history.zeta - motion.normal * motion.zeta_along
