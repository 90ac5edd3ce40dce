"""Base classes of Terraglue modules in Python; needs Python 3.8 and the standard library alone.

A module is one file. Its docstring holds, from the line `[module]` on, a TOML block with its kind, its description and the
parameters it takes; the host reads it without running the file. Below it stands one class derived from `Subsystem`.
The host runs the file in a process of its own with your interpreter and packages, and exchanges arrays with it through
shared memory: `memoryview`s of doubles, which `numpy.frombuffer` takes as they are. Everything handed to a call is borrowed:
copy what is to outlive it.

SI units. Packed vectors hold one entry per carried component (n, t1, t2, mn, mt1, mt2) of every port; port p owns
`port.first` onwards. T is the wrench on side 1 (the body); side 2 (the soil) feels -T.
"""
import array
import math
import struct

# Capabilities of an instance beyond `advance`: their sum is `Subsystem.can`.
FORCE, MOTION, ESTIMATE, SOLVE, DERIVATIVES, RETRY = 1, 2, 8, 16, 32, 64
SUBCYCLES, FEEDTHROUGH, SEES, HIDES = 512, 1024, 8192, 16384
# Roles of a variable, the effects of a change, and the types of its elements.
PARAMETER, INPUT, OUTPUT, LOCAL = range(4)
LIVE, NEEDS_RESET, READ_ONLY = range(3)
F64, F32, I8, I16, I32, I64, U8, U16, U32, U64, BOOL, STRING, BINARY, ENUMERATION = range(14)
# Levels of a derivative, and bits of `Response.flags`.
POSITION, VELOCITY, ACCELERATION = range(3)
EVENT, TERMINATE, YIELDED = 1, 2, 4
# Severities of a line of the log.
ERROR, WARNING, INFO, DEBUG = 1, 2, 3, 4
INFINITY, NAN = math.inf, math.nan


class Unsupported(Exception):
    """This call, this kind of input or this level is not offered."""


class Refused(Exception):
    """A value, name or argument is not acceptable; the instance is unchanged and usable."""


class Discard(Exception):
    """The step is too long: `Discard(reached_s)`; the host repeats it up to that time."""

    def __init__(self, reached):
        super().__init__(reached)
        self.reached = float(reached)


class Law:
    """t_min <= T_n <= t_max (N), |T_t| <= mu T_n, compliance of the glue (m/N)."""

    __slots__ = ("t_min", "t_max", "mu", "compliance")

    def __init__(self, t_min, t_max, mu, compliance):
        self.t_min, self.t_max, self.mu, self.compliance = t_min, t_max, mu, compliance


class Port:
    """Where two subsystems are glued: key, kind (0 contact, 1 joint, 2 named), side (+1: T acts here, -1: -T does),
    mask of carried components, first place in packed vectors, body, shape, nodes below the shape, origin (m, world), axes
    n, t1, t2 (world), extent (m), law."""

    __slots__ = ("key", "kind", "side", "mask", "first", "body", "shape", "first_node", "node_count", "origin", "axes",
                 "extent", "law", "components")

    def __init__(self, v):
        (self.key, self.kind, self.side, self.mask, self.first, self.body, self.shape, self.first_node,
         self.node_count) = v[:9]
        self.origin, self.axes, self.extent = v[9:12], (v[12:15], v[15:18], v[18:21]), v[21:23]
        self.law = Law(*v[23:27])
        carried = [c for c in range(6) if self.mask >> c & 1]
        #: (place in packed vectors, component 0 ... 5, its direction in the world) of all that is carried.
        self.components = [(self.first + i, c, self.axes[c % 3]) for i, c in enumerate(carried)]


class Node:
    """A lattice node of the ground below a shape: i, j, covered area (m^2), height of the underside (m), its slopes."""

    __slots__ = ("i", "j", "area", "lower", "slope")

    def __init__(self, i, j, area, lower, slope_x, slope_y):
        self.i, self.j, self.area, self.lower, self.slope = i, j, area, lower, (slope_x, slope_y)


class Step:
    """From t to t + h (s): index of the step, number of the trial, length n of packed vectors."""

    __slots__ = ("t", "h", "index", "trial", "n", "ports", "nodes")


class Motion:
    """Of the other side at t + h: x (m, rad) from the origin of each port, v (m/s, rad/s)."""

    __slots__ = ("x", "v")

    def __init__(self, x, v):
        self.x, self.v = x, v


class Force:
    """Input: the wrench t; `motion` of the other side where it is known, else None."""

    __slots__ = ("t", "motion")


class Response:
    """To be filled: x, v, a, t; comes as NaN with `reached` = t + h and no `flags`."""

    __slots__ = ("x", "v", "a", "t", "reached", "flags")


class Estimate:
    """Of rigid contact: t_star, x_free, g = dX/d(wrench on itself), n x n column by column; active per port; unique."""

    __slots__ = ("t_star", "x_free", "g", "active", "unique")


class PressureNodes:
    """Nodes below a contact of size b (m) in a step of h (s): depth (m); for a law with STATE_DOUBLES also permanent, the
    depth of the unloaded surface (m), slip (m) and the committed state, node after node."""

    __slots__ = ("b", "h", "depth", "permanent", "slip", "state")


class PressureAnswer:
    """To be filled by a law: pressure (Pa), slope (Pa/m), with STATE_DOUBLES also permanent and state; longest step (s)."""

    __slots__ = ("pressure", "slope", "permanent", "state", "longest")


class ShearNodes:
    """Nodes that slide in a step of h (s): pressure (Pa), slip (m) since the contact began, the committed state."""

    __slots__ = ("h", "pressure", "slip", "state")


class ShearAnswer:
    """To be filled by a law: largest stress (Pa) and its derivatives by_pressure and by_slip (Pa/m); longest step (s)."""

    __slots__ = ("stress", "by_pressure", "by_slip", "longest")


class Variable:
    """A named, typed value with a unit. `get` and `set` reach it as `state[name]`, else as an attribute of that name with
    its dots as underscores."""

    def __init__(self, name, unit="", causality=LOCAL, help="", low=-INFINITY, high=INFINITY, type=F64, dims=(),
                 enumeration=(), effect=None):
        self.name, self.unit, self.causality, self.help = name, unit, causality, help
        self.low, self.high, self.type = low, high, ENUMERATION if enumeration else type
        self.dims, self.enumeration = tuple(dims), tuple(enumeration)
        self.effect = (LIVE if causality in (PARAMETER, INPUT) else READ_ONLY) if effect is None else effect
        self.count = math.prod(self.dims)


class Shape:
    """A shape on a body. kind and size: "sphere" (radius,), "box" half lengths, "capsule" and "cylinder" (half length,
    radius) along z, "mesh" (points, triangles), "cone" (half length, radius at -z, radius at z), "ellipsoid" half lengths,
    "sheet" (points, triangles), which is seen only. position and orientation (w, x, y, z) in the frame of the body. material
    (class, reflectance, transmittance): 0 unknown, 1 metal, 2 rock, 3 soil, 4 wood, 5 foliage, 6 glass, 7 water."""

    KINDS = ("sphere", "box", "capsule", "cylinder", "mesh", "cone", "ellipsoid", "sheet")

    def __init__(self, body, kind, size, name="", position=(0.0, 0.0, 0.0), orientation=(1.0, 0.0, 0.0, 0.0), collides=True,
                 material=(0, 0.5, 0.0)):
        self.body, self.kind, self.size, self.name = body, self.KINDS.index(kind), tuple(size), name
        self.position, self.orientation, self.material = position, orientation, tuple(material)
        self.collides = collides and kind != "sheet"


class Joint:
    """A joint between two bodies, by their places in `bodies`; parent None: the world. Pose in the parent where it stands at
    zero, axis in its own frame; limits (rad or m). variables: names by "position", "velocity", "torque", "torque_limit" and
    "blocked"; break_action: the action that breaks it."""

    KINDS = ("revolute", "continuous", "prismatic", "spherical", "planar", "fixed", "closure", "cylindrical",
             "universal")

    def __init__(self, name, parent, child, kind="revolute", position=(0.0, 0.0, 0.0), orientation=(1.0, 0.0, 0.0, 0.0),
                 axis=(0.0, 0.0, 1.0), limits=(-INFINITY, INFINITY), variables=None, break_action=""):
        self.name, self.parent, self.child, self.kind = name, parent, child, self.KINDS.index(kind)
        self.position, self.orientation, self.axis, self.limits = position, orientation, axis, limits
        self.variables, self.break_action = dict(variables or {}), break_action


class Stream:
    """A stream of messages: schema ("foxglove.PointCloud", ...), encoding ("protobuf", "json", ...), most messages per second
    (0: whenever something happens), most bytes of a message."""

    def __init__(self, name, schema, encoding="json", rate_hz=0.0, most_bytes=1 << 20, help=""):
        self.name, self.schema, self.encoding = name, schema, encoding
        self.rate_hz, self.most_bytes, self.help = float(rate_hz), most_bytes, help


class Overlay:
    """Shown with the bodies in a layer. figure: "lines", "points", "arrows" (data: points; size: width), "ellipse" (data:
    position, orientation, half lengths) or "text" (data: position, text; size: height); frame: place of a body, None: world, MOUNT: the body that the
    parameter `mount` names."""

    MOUNT = 0xFFFFFFFE
    FIGURES = ("lines", "points", "arrows", "ellipse", "text")

    def __init__(self, layer, figure, data, size=0.01, colour=(1.0, 1.0, 1.0, 1.0), frame=None):
        self.layer, self.figure, self.data, self.size = layer, self.FIGURES.index(figure), data, float(size)
        self.colour, self.frame = colour, frame


class Field:
    """Values over the ground, x fastest; the one named `height` is what feet touch. Change them by `put`, or change
    `values` and call `changed`."""

    def __init__(self, name, unit, origin, spacing, size, values=None):
        self.name, self.unit, self.origin, self.spacing, self.size = name, unit, tuple(origin), spacing, tuple(size)
        self.edge, nodes = 32, size[0] * size[1]
        self.values = array.array("d", bytes(8 * nodes) if values is None else values)
        self._across = -(-size[0] // self.edge)
        self.changed()

    def changed(self):
        """All of it."""
        self._new = set(range(self._across * -(-self.size[1] // self.edge)))

    def put(self, i, j, value):
        """A new value of node (i, j)."""
        self.values[j * self.size[0] + i] = value
        self._new.add((j // self.edge) * self._across + i // self.edge)

    def _tile(self, k):
        nx, ny = self.size
        i0, j0 = self.edge * (k % self._across), self.edge * (k // self._across)
        wide, out = min(self.edge, nx - i0), array.array("d", bytes(8 * self.edge * self.edge))
        for row in range(min(self.edge, ny - j0)):
            at = (j0 + row) * nx + i0
            out[row * self.edge:row * self.edge + wide] = self.values[at:at + wide]
        return out


class Terrain:
    """Ground at the start: node (i, j) at origin + (i, j) spacing, `heights` (m) with x fastest."""

    def __init__(self, origin, spacing, size, heights):
        self.origin, self.spacing, self.size, self.heights = origin, spacing, size, heights

    def height(self, x, y):
        """Height (m) at a place, bilinear between nodes, outside as at the edge."""
        at, low = [], []
        for a, place in enumerate((x, y)):
            u = min(max((place - self.origin[a]) / self.spacing, 0.0), self.size[a] - 1.0)
            low.append(max(min(int(u), self.size[a] - 2), 0))
            at.append(u - low[a])
        nx = self.size[0]
        right, up = min(1, nx - 1), nx * min(1, self.size[1] - 1)
        k, h = low[1] * nx + low[0], self.heights
        near = h[k] + at[0] * (h[k + right] - h[k])
        far = h[k + up] + at[0] * (h[k + up + right] - h[k + up])
        return near + at[1] * (far - near)


class Host:
    """Name of the instance, seed, folder of relative paths, slots, max_nodes, gravity (m/s^2), terrain (or None)."""

    def __init__(self, start, terrain, lines):
        self.name, self.seed, self.folder, self.slots = start["name"], start["seed"], start["folder"], start["slots"]
        self.max_nodes, self.gravity, self.terrain = start["max_nodes"], tuple(start["gravity"]), terrain
        self._lines = lines

    def log(self, text, level=INFO):
        """A line for the log of the run."""
        if len(self._lines) < 1000:
            self._lines.append((level, str(text)[:10000]))


class Hits:
    """Hits of rays, one each: distance (m; infinite: nothing), normal, subsystem, body, shape (GROUND: the ground), material
    class, reflectance, transmittance. `raw` takes `numpy.frombuffer(hits.raw, Hits.NUMPY)`."""

    FORM = struct.Struct("<4d4I2f")
    NUMPY = [("distance", "<f8"), ("normal", "<f8", 3), ("subsystem", "<u4"), ("body", "<u4"), ("shape", "<u4"),
             ("material", "<u4"), ("reflectance", "<f4"), ("transmittance", "<f4")]

    def __init__(self, raw):
        self.raw = raw

    def __len__(self):
        return len(self.raw) // self.FORM.size

    def __getitem__(self, k):
        if not -len(self) <= k < len(self):
            raise IndexError(k)
        d, x, y, z, *rest = self.FORM.unpack_from(self.raw, self.FORM.size * (k % len(self)))
        return (d, (x, y, z), *rest)

    def distances(self):
        """Of all rays, m."""
        return [hit[0] for hit in self.FORM.iter_unpack(self.raw)]


#: `body` and `shape` of a hit on the ground.
GROUND = 0xFFFFFFFF
#: Bits of `sees`.
SHAPES, THE_GROUND = 1, 2


class World:
    """The committed world of the step [start, time], valid during `observe`: every answer is for the time that the
    question names within it, interpolated between the committed states; nothing of what comes after is known. Subsystems are
    numbered by their place in `subsystems`, bodies are pairs (subsystem, body). `skip` is a body that rays pass by."""

    def __init__(self, ask, start, time, subsystems):
        self._ask, self.start, self.time, self.subsystems = ask, start, time, subsystems

    def cast_rays(self, rays, skip=None, sees=SHAPES | THE_GROUND, classes=0xFFFFFFFF):
        """rays: eight doubles each, origin, direction (unit), time (s), range (m), as a list of tuples or one array (a buffer of
        doubles); `Hits`, one for each."""
        flat = rays if not isinstance(rays, (list, tuple)) else array.array("d", [x for ray in rays for x in ray])
        data = memoryview(flat).cast("B")
        out, part = [], 64 << 18
        for at in range(0, len(data), part):
            piece = data[at:at + part]
            mask = struct.pack("<4I", sees, classes, *(skip or (GROUND, GROUND)))
            out.append(self._ask(5, mask + struct.pack("<I", len(piece) // 64), piece).bytes_of(Hits.FORM.size))
        return Hits(b"".join(out))

    def ground_heights(self, points):
        """Heights (m) at pairs (x, y); NAN where there is no ground."""
        flat = array.array("d", [x for point in points for x in point])
        return list(self._ask(6, struct.pack("<I", len(flat) // 2), flat.tobytes()).doubles())

    def overlap(self, centre, radius, skip=None, sees=SHAPES | THE_GROUND, classes=0xFFFFFFFF):
        """Triples (subsystem, body, shape) of the shapes that a sphere touches."""
        mask = struct.pack("<4I", sees, classes, *(skip or (GROUND, GROUND)))
        raw = self._ask(7, mask + struct.pack("<4d", *centre, radius)).bytes_of(12)
        return list(struct.iter_unpack("<3I", raw))

    def body(self, subsystem, name):
        """A body by its names; None: there is none."""
        if subsystem not in self.subsystems:
            return None
        number = self.subsystems.index(subsystem)
        names = [n for n, _ in self.bodies(number)]
        return (number, names.index(name)) if name in names else None

    def bodies(self, subsystem):
        """Pairs of name and mass (kg) of the bodies of a subsystem."""
        return self._ask(2, struct.pack("<I", subsystem)).scene_bodies()

    def pose(self, body, time):
        """(position, orientation w x y z, velocity, angular velocity) of a body at a time; None: there is none."""
        answer = self._ask(4, struct.pack("<2Id", *body, time))
        if not answer.u8():
            return None
        v = answer.take(struct.Struct("<13d"))
        return v[:3], v[3:7], v[7:10], v[10:]

    def is_visible(self, subsystem, body, shape):
        """Whether a shape is there and not hidden."""
        return bool(self._ask(3, struct.pack("<3I", subsystem, body, shape)).u8())


class Subsystem:
    """An instance: derive from it, set `can`, override what the module offers. Everything to be remembered from step to step
    lies in `self.state` (numbers, texts, lists, tuples, dictionaries, arrays): it is saved, restored and written as bytes
    for you. A trial (`advance`, `solve_compatibility`, `estimate_forces`) leaves it alone; `commit` changes it."""

    can = FORCE | RETRY
    state = None
    variables = ()
    actions = ()
    bodies = ()
    shapes = ()
    fields = ()
    joints = ()
    streams = ()

    def __init__(self, host, config):
        """`config`: the parameters, each with a value or its default; tables are dictionaries."""

    def set_ports(self, step, laws, now):
        """Paper, step 1: the ports of this step; answers with the committed x, v and, a soil, with t; may narrow laws."""
        for vector in (now.x, now.v, now.a, now.t):
            fill(vector, 0.0)

    def advance(self, step, input, out):
        """Paper, steps 3 and 4: a trial from the committed state under Force or Motion."""
        raise Unsupported

    def estimate_forces(self, step, partner, out):
        """Paper, step 2: the wrenches if the other side were rigid."""
        raise Unsupported

    def solve_compatibility(self, step, estimate, out):
        """Paper, step 3: the wrenches given that estimate."""
        raise Unsupported

    def interface_jacobian(self, step, level, out):
        """Derivative at the last trial, n x n, column by column."""
        raise Unsupported

    def commit(self, step, t, partner):
        """Paper, step 5: the last trial is accepted under t; the other side moved to `partner`."""

    def observe(self, step, world):
        """With SEES in `can`: the committed world, once per step after all have committed; observations belong to the state
        at t + h. At the start of a run step.h = 0."""

    def shape_visibility(self):
        """With HIDES in `can`: for each of `shapes` whether it is shown; None: all are."""
        return None

    def stream(self, k):
        """(time, bytes) of the message that the last step made on stream k; None: it made none."""
        return None

    def overlays(self):
        """A list of `Overlay` to show with the bodies; called only when they are displayed or recorded."""
        return []

    def restored(self):
        """Called after `state` was put back, to rebuild values that follow from it."""

    def migrate(self, state):
        """The state of an earlier version of this code, whose keys differ, as one of this code."""
        raise Refused("there is no method `migrate`")

    def act(self, action, arguments):
        """Does one of `actions`, which are pairs (name, help)."""
        raise Refused(f"there is no action `{action}`")

    def body_states(self):
        """Per body of `bodies` (pairs of name and mass): (position, orientation w x y z, velocity, angular velocity)."""
        return []

    def energy(self):
        """(kinetic, potential, dissipated, port work, actuator work, electrical), J; NAN: unknown."""
        return (NAN,) * 6

    def next_event_time(self):
        """Time of the next event known beforehand, s."""
        return INFINITY

    def close(self):
        """The end of the instance."""

    def get_value(self, variable):
        """Value of a variable."""
        if isinstance(self.state, dict) and variable.name in self.state:
            return self.state[variable.name]
        return getattr(self, variable.name.replace(".", "_"))

    def set_value(self, variable, value):
        """A new value, of the right type and range."""
        if isinstance(self.state, dict) and variable.name in self.state:
            self.state[variable.name] = value
        else:
            setattr(self, variable.name.replace(".", "_"), value)


def dot(a, b):
    """Of two vectors of three."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def fill(view, value):
    """The same number everywhere."""
    for k in range(len(view)):
        view[k] = value
