"""Kick and drift of particles, faces and rigid bodies, their ghosts, and the length of a step.

Velocities are half a step behind: a kick by (dt of the last step + dt of this one)/2 is the second
half of the one and the first half of the other. At the start the last step has length 0.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.compute.loops import STUCK
from dusttaichi.compute.scan import count_blocks
from dusttaichi.continuum.kernels.outside import Outside
from dusttaichi.continuum.kernels.store import (
    APART,
    COLUMN,
    DT,
    FACES,
    LEFT,
    OLD,
    PARTS,
    SUBSTEPS,
    TIME,
    WANT,
    declare,
)
from dusttaichi.results.roles import DUST, ELASTIC

GROWTH = 1.1  # of a step over the one before
MOST_STEPS = 1e4  # in an output step; more are a fault of the scene
ROUNDING = 1e-9  # of an output step, below which the rest counts as zero


@ti.data_oriented
class Motion:
    """Motion of particles and bodies.

    fields, lists: see store.place; layout: store.Layout; rigid: kernels.rigid.Rigid; images:
    images.Images or None; attraction: attraction.Attraction or None.
    """

    def __init__(self, fields, lists, layout, *, rigid, images, attraction):
        self.f, self.lists, self.layout, self.rigid = fields, lists, layout, rigid
        self.images = images
        self.attraction = attraction
        self.outside = Outside(fields, lists, layout, rigid) if layout.forces else None
        self.n = layout.dimension
        answer_variables = (v for v in declare(layout) if v.answers)
        self.answers = [(getattr(fields, v.name), v.element[1]) for v in answer_variables]

    # -- particles -------------------------------------------------------------------------------

    @ti.func
    def kick_and_drift(self, i, numbers: ti.template()):
        """Advance particle i and its ghosts; returns 1 where a search is due because of it."""
        dt, half = self.f.clock[DT], 0.5 * (self.f.clock[OLD] + self.f.clock[DT])
        x, v, group, role = self.f.x[i], self.f.v[i], self.f.group[i], self.f.role[i]
        new_velocity = v
        if role == DUST or role == ELASTIC:
            new_velocity = v + (half / self.f.mass[i]) * self.f.force[i]
            if ti.static(bool(self.layout.forces)):
                new_velocity += self.outside.kick(i, new_velocity - v, half)
            x += dt * new_velocity
            self.f.volume[i] = self.f.mass[i] / self.f.density[i]
        elif group < FACES:
            new_velocity = self.rigid.flat(self.rigid.vector(group, COLUMN.speed))
            x += dt * new_velocity
        else:
            arm = self.rigid.rotate(group, self.rigid.raise_to_space(self.f.arm[i]), 1.0)
            x = self.rigid.flat(self.rigid.vector(group, COLUMN.centre) + arm)
            new_velocity = self.rigid.motion(group, arm)
        mean = (0.5 * half) * (v + new_velocity)
        by_noise = 0.75 * half * self.f.noise_power[i] - self.f.grid_force[i].dot(mean)
        lost = ti.Vector([-self.f.viscous[i].dot(mean), by_noise])
        self.f.loss[i] = self.f.loss[i] + lost  # `+=` would be an atomic one
        if ti.static(self.layout.artificial):
            self.f.taken[i] -= self.f.pushing[i].dot(mean)
        if ti.static(self.layout.heat):
            self.f.warmed[i] += half * self.f.heating[i]
        self.f.x[i], self.f.v[i] = x, new_velocity
        if ti.static(self.layout.bodies):
            self.f.clearance[i] = self.images.clearance(i, numbers)
        self.move_ghosts(i, numbers)
        return ti.cast((x - self.f.x_search[i]).norm_sqr() > numbers.way2, ti.i32)

    @ti.func
    def move_ghosts(self, i, numbers: ti.template()):
        """Position, velocity and volume of the images of particle i."""
        if ti.static(self.layout.ghosts):
            for g in range(self.lists.ghost_first[i], self.lists.ghost_first[i + 1]):
                self.move_ghost(i, g, numbers.count + g)

    @ti.func
    def move_ghost(self, i, g, image):
        """Position, velocity and volume of image number g of particle i, particle `image`."""
        for a in ti.static(range(self.n)):
            sign = self.lists.ghost_sign[g, a]
            self.f.x[image][a] = sign * self.f.x[i][a] + self.lists.ghost_shift[g, a]
            self.f.v[image][a] = sign * self.f.v[i][a]
        self.f.volume[image] = self.f.volume[i]

    @ti.func
    def show_others(self, i, numbers: ti.template()):
        """Publish the variables of particle i that others read in the second pass."""
        if ti.static(self.layout.ghosts):
            for g in range(self.lists.ghost_first[i], self.lists.ghost_first[i + 1]):
                self.answer_ghost(i, g, numbers.count + g)
        if ti.static(self.layout.self_gravity):
            self.attraction.note(i)

    @ti.func
    def answer_ghost(self, i, ghost, image):
        """Copy the results of the first pass to image number g of particle i, particle `image`."""
        n, sign = ti.static(self.n, self.lists.ghost_sign)
        for field, length in ti.static(self.answers):
            if ti.static(length == 0):
                field[image] = field[i]
            for k in ti.static(range(length)):
                if ti.static(length == n):
                    field[image][k] = sign[ghost, k] * field[i][k]
                else:
                    field[image][k] = sign[ghost, k // n] * sign[ghost, k % n] * field[i][k]

    # -- faces and rigid bodies ------------------------------------------------------------------

    @ti.func
    def move_bodies(self, numbers: ti.template()):
        """Kick and drift of faces and rigid bodies.

        Returns 1 where a search is due because of one.
        """
        is_due = 0
        for b in range(FACES + numbers.bodies):
            is_due = ti.max(is_due, self.move_body(b, numbers))
        return is_due

    @ti.func
    def move_body(self, row, numbers: ti.template()):
        """Kick and drift of face or rigid body b; impulse, and work of the faces.

        Returns 1 where a search is due because of it.

        The spin of a body follows from its angular momentum, which is kicked; it turns by a
        quaternion.
        """
        dt, half = self.f.clock[DT], 0.5 * (self.f.clock[OLD] + self.f.clock[DT])
        force, speed = self.rigid.vector(row, COLUMN.force), self.rigid.vector(row, COLUMN.speed)
        self.rigid.put(row, COLUMN.impulse, self.rigid.vector(row, COLUMN.impulse) + half * force)
        speed_before, spin = speed, self.rigid.vector(row, COLUMN.spin)
        turned = spin
        if row < FACES:
            self.f.rigid[row, COLUMN.work] = self.f.rigid[row, COLUMN.work] - half * force.dot(
                speed
            )
        else:
            speed += (half / self.f.rigid[row, COLUMN.mass]) * force
            torque = self.rigid.vector(row, COLUMN.torque)
            momentum = self.rigid.vector(row, COLUMN.momentum) + half * torque
            self.rigid.put(row, COLUMN.speed, speed)
            self.rigid.put(row, COLUMN.momentum, momentum)
            turned = self.spin(row, momentum)
            self.turn(row, turned * dt)
            self.rigid.put(row, COLUMN.spin, self.spin(row, momentum))
        for component in ti.static(range(2)):
            drag = self.rigid.vector(row, COLUMN.drags + 6 * component)
            turning = self.rigid.vector(row, COLUMN.drags + 6 * component + 3)
            power = drag.dot(speed_before + speed) + turning.dot(spin + turned)
            loss = self.f.rigid[row, COLUMN.loss + component] - 0.5 * half * power
            self.f.rigid[row, COLUMN.loss + component] = loss
        centre = self.rigid.vector(row, COLUMN.centre) + dt * speed
        self.rigid.put(row, COLUMN.centre, centre)
        gone = (centre - self.rigid.vector(row, COLUMN.searched)).norm_sqr()
        return ti.cast(gone > numbers.way2, ti.i32)

    @ti.func
    def spin(self, b, momentum):
        """R I^-1 R^T L of body b, with the inverse of its inertia in its own frame."""
        body_momentum = self.rigid.rotate(b, momentum, -1.0)
        out = ti.Vector.zero(ti.f64, 3)
        for a, c in ti.static(ti.ndrange(3, 3)):
            out[a] += self.f.rigid[b, COLUMN.inertia + 3 * a + c] * body_momentum[c]
        return self.rigid.rotate(b, out, 1.0)

    @ti.func
    def turn(self, b, angle):
        """Turn body b by a small vector: q <- (1, angle/2) q, made a unit again."""
        axis = 0.5 * angle
        w, u = self.f.rigid[b, COLUMN.turn], self.rigid.vector(b, COLUMN.turn + 1)
        scalar = w - axis.dot(u)
        imaginary = u + w * axis + axis.cross(u)
        length = ti.sqrt(scalar * scalar + imaginary.norm_sqr())
        self.f.rigid[b, COLUMN.turn] = scalar / length
        self.rigid.put(b, COLUMN.turn + 1, imaginary / length)

    # -- the end of a step -----------------------------------------------------------------------

    @ti.func
    def add_up(self, numbers: ti.template()):
        """Sum forces and torques on faces and rigid bodies.

        Over the contacts with their surfaces in a fixed order, and gravity.
        """
        for row in range(FACES + numbers.bodies):
            self.clear_load(row, numbers)
        if ti.static(self.layout.rigid):
            for e in range(self.lists.touch_first[numbers.count]):
                row = self.lists.touch_row[e]
                for c in ti.static(range(6)):
                    # force and torque in succession, as in `touch`
                    of_pairs, of_noise = self.lists.touch[e, 6 + c], self.lists.touch[e, 12 + c]
                    total = self.lists.touch[e, c]
                    total += of_pairs + of_noise
                    free = self.f.rigid[row, COLUMN.freedom + c]
                    # `+=` would be an atomic one, which takes three times as long
                    self.add_number(row, COLUMN.force + c, free * total)
                    self.add_number(row, COLUMN.drags + c, of_pairs)
                    self.add_number(row, COLUMN.drags + 6 + c, of_noise)

    @ti.func
    def add_number(self, row, column, value):
        """Add to a number of a face or rigid body, of which one thread alone forms the sum."""
        self.f.rigid[row, column] = self.f.rigid[row, column] + value

    @ti.func
    def clear_load(self, row, numbers: ti.template()):
        """Reset the load of a face or rigid body to its weight."""
        self.rigid.put(row, COLUMN.force, ti.Vector.zero(ti.f64, 3))
        self.rigid.put(row, COLUMN.torque, ti.Vector.zero(ti.f64, 3))
        for c in range(COLUMN.drags, COLUMN.loss):
            self.f.rigid[row, c] = 0.0
        if row >= FACES:
            weight = self.f.rigid[row, COLUMN.mass] * numbers.gravity
            self.rigid.put(row, COLUMN.force, self.rigid.raise_to_space(weight))

    @ti.func
    def share_of_load(self, row, thread, threads, numbers: ti.template()):
        """Load on a surface from the contacts of one of a block of threads.

        Force and torque, then the parts of pairs and of grid noise, 6 numbers each.
        """
        out = ti.Vector.zero(ti.f64, PARTS)
        touches = self.lists.touch_first[numbers.count]
        for n in range(count_blocks(touches, threads)):
            e = n * threads + thread
            if e < touches:
                if self.lists.touch_row[e] == row:
                    for c in ti.static(range(6)):
                        of_pairs, of_noise = self.lists.touch[e, 6 + c], self.lists.touch[e, 12 + c]
                        out[c] += self.lists.touch[e, c] + of_pairs + of_noise
                        out[6 + c] += of_pairs
                        out[12 + c] += of_noise
        return out

    @ti.func
    def add_load(self, row, component, total):
        """Add number `component` of a sum of those shares to the load of a surface."""
        if component < 6:
            free = self.f.rigid[row, COLUMN.freedom + component]
            self.add_number(row, COLUMN.force + component, free * total)
        elif component < PARTS:
            self.add_number(row, COLUMN.drags + component - 6, total)

    @ti.func
    def next_step(self, present, numbers: ti.template()):
        """Choose the length of the next step; returns 1 where this one ends an output step.

        Sets sync[STUCK] where the next steps would be too many or of no length.

        C h over the fastest signal of any particle, C h/2 over its viscosity, at most 10 % longer
        than before; the rest of an output step is divided evenly.
        """
        fastest = 0.0
        for w in range(present):
            fastest = ti.max(fastest, self.lists.most[APART * w])
        dt = self.f.clock[DT]
        time_left = self.f.clock[LEFT] - dt
        is_over = ti.cast(time_left <= ROUNDING * numbers.output_step, ti.i32)
        if is_over == 1:
            time_left = numbers.output_step
        want = ti.min(GROWTH * self.f.clock[WANT], numbers.courant * numbers.h / fastest)
        if ti.static(bool(self.layout.forces)):
            want = ti.min(want, numbers.longest)
            self.f.clock[TIME] += self.f.clock[DT]
        if dt > 0.0 and not (time_left < MOST_STEPS * want):
            self.lists.sync[STUCK] = 1
            want = time_left
        self.f.clock[WANT] = want
        self.f.clock[OLD] = dt
        self.f.clock[LEFT] = time_left
        self.f.clock[DT] = time_left / ti.ceil(time_left / want)
        self.f.clock[SUBSTEPS] += 1.0
        return is_over
