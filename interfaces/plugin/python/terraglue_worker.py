"""The process of a module in Python: makes one instance and answers the host until it receives quit or its host is gone.
The module's `state` is saved, restored and written as bytes here."""
import array
import copy
import json
import os
import signal
import struct
import sys
import threading
import traceback
import types
import zlib

from terraglue import (BOOL, ENUMERATION, GROUND, INFINITY, INFO, NEEDS_RESET, READ_ONLY, STRING, U32, WARNING, Discard, Estimate, Force,
                       Host, Law, Motion, Node, Port, PressureAnswer, PressureNodes, Refused, Response, ShearAnswer,
                       ShearNodes, Step, Subsystem, Terrain, Unsupported, World)
from terraglue_wire import AREA, BODY, END, LAW, NODE, OUTCOME, PORT, START, STEP, Call, Reply, Segment

_STATE, _SERIALIZE = 128, 256
ONE, TWO = struct.Struct("<d"), struct.Struct("<2d")
_HEAD = b"terraglue python state 1\n"


def _plain(x):
    """As JSON that keeps the kind of each collection."""
    if x is None or isinstance(x, (bool, int, float, str)):
        return x
    if isinstance(x, list):
        return [_plain(y) for y in x]
    if isinstance(x, tuple):
        return {"tuple": [_plain(y) for y in x]}
    if isinstance(x, dict):
        return {"dict": [[_plain(k), _plain(v)] for k, v in x.items()]}
    if isinstance(x, (bytes, bytearray)):
        return {"raw": x.hex(), "mutable": isinstance(x, bytearray)}
    if isinstance(x, array.array):
        return {"array": x.typecode, "values": x.tolist()}
    if hasattr(x, "dtype") and hasattr(x, "tobytes"):
        return {"numpy": str(x.dtype), "shape": list(x.shape), "bytes": x.tobytes().hex()}
    raise TypeError(f"the state holds a {type(x).__name__}; numbers, texts, bytes, lists, tuples, dictionaries and arrays can be kept")


def _rich(x):
    if isinstance(x, list):
        return [_rich(y) for y in x]
    if not isinstance(x, dict):
        return x
    if "tuple" in x:
        return tuple(_rich(y) for y in x["tuple"])
    if "dict" in x:
        return {_rich(k): _rich(v) for k, v in x["dict"]}
    if "raw" in x:
        return (bytearray if x["mutable"] else bytes).fromhex(x["raw"])
    if "array" in x:
        return array.array(x["array"], x["values"])
    import numpy
    return numpy.frombuffer(bytes.fromhex(x["bytes"]), x["numpy"]).reshape(x["shape"]).copy()


def _packed_state(subsystem):
    text = json.dumps([_plain(subsystem.state), [[f.name, f.values.tobytes().hex()] for f in subsystem.fields]]).encode()
    return _HEAD + struct.pack("<I", zlib.crc32(text)) + text


def _unpacked_state(subsystem, data):
    text = data[len(_HEAD) + 4:]
    if data[:len(_HEAD)] != _HEAD or data[len(_HEAD):len(_HEAD) + 4] != struct.pack("<I", zlib.crc32(text)):
        raise Refused("these bytes are no state of a module in Python, or they were changed")
    state, fields = json.loads(text)
    fields = [array.array("d", bytes.fromhex(values)) for _, values in fields]
    if [len(f) for f in fields] != [len(f.values) for f in subsystem.fields]:
        raise Refused("the state has other fields")
    state = _rich(state)
    keys = [_names(state), subsystem._names]
    if keys[0] != keys[1]:
        try:
            state = subsystem.migrate(state)
        except Refused as e:
            raise Refused(f"the state holds {keys[0]}; that of this code holds {keys[1]}, and {e}") from None
    _put_back(subsystem, (state, fields))


def _names(state):
    """The mark of states of the same code: the texts among the keys of a dictionary, else the type."""
    if not isinstance(state, dict):
        return type(state).__name__
    return ", ".join(sorted(k for k in state if isinstance(k, str))) or "no names"


def _kept(subsystem):
    return copy.deepcopy(subsystem.state), [f.values[:] for f in subsystem.fields]


def _put_back(subsystem, kept):
    subsystem.state = copy.deepcopy(kept[0])
    for field, values in zip(subsystem.fields, kept[1]):
        field.values[:] = values
        field.changed()
    subsystem.restored()


class Worker:
    """Makes one instance and answers its calls."""

    NAMES = ("", "start", "set_ports", "estimate", "solve", "advance", "jacobian", "commit", "save", "restore", "serialize",
             "deserialize", "get", "set", "act", "next_event", "body_states", "energy", "pressure", "shear", "quit", "advance_batch",
             "observe", "answer", "visibility", "overlays")

    def __init__(self):
        self.subsystem, self.law, self.lines, self.slots, self.begun = None, None, [], {}, False
        self.ports_seen, self.ports, self.nodes = None, [], []
        self.generation = 0
        self.file = ""
        self.segment, self.revision, self.others = None, None, []
        # streams of which a message was too long
        self.left_out = set()
        self.calls = [getattr(self, "_" + name, None) for name in self.NAMES]

    def answer(self, request, length, memory):
        """Does one call and writes its answer; the length."""
        reply, failure = Reply(memory), None
        try:
            self.calls[request[0]](Call(request, length), reply)
        except Unsupported:
            failure = (1, None)
        except Discard as e:
            failure = (2, e.reached)
        except Refused as e:
            failure = (3, str(e))
        except (struct.error, ValueError) as e:
            too_long = reply.at > AREA - 64 or "slice" in str(e) and reply.at + 64 > len(memory)
            failure = (4, "the answer does not fit into the shared memory" if too_long else self.told())
        except BaseException:
            failure = (4, self.told())
        sys.stdout.flush()
        sys.stderr.flush()
        if failure is None and not self.lines:
            OUTCOME.pack_into(memory, 0, 0, 0)
            return reply.at
        return self.outcome(failure, memory, reply.at)

    def outcome(self, failure, memory, end):
        body = b"" if failure else bytes(memory[OUTCOME.size:end])
        reply = Reply(memory)
        reply.at = 0
        reply.u32(len(self.lines))
        for level, text in self.lines:
            reply.u32(level)
            reply.text(text)
        self.lines.clear()
        status, what = failure or (0, None)
        reply.u8(status)
        if status == 2:
            reply.numbers(what)
        elif what is not None:
            reply.text(what)
        reply.bytes(body)
        return reply.at

    def told(self):
        """The exception with its traceback, without the frames of this file."""
        kind, error, trace = sys.exc_info()
        while trace is not None and trace.tb_frame.f_code.co_filename == __file__:
            trace = trace.tb_next
        lines = [line.rstrip("\n") for line in traceback.format_exception(kind, error, trace)]
        last = lines.pop() if lines else repr(error)
        if isinstance(error, SystemExit):
            last = f"it called sys.exit({error.code!r})"
        return "\n".join([last, *lines])

    # --- calls, in the order of their numbers

    def _start(self, call, reply):
        start = json.loads(call.text())
        terrain = None
        if call.u8():
            origin, (spacing,) = call.take(struct.Struct("<2d")), call.take(struct.Struct("<d"))
            size = call.take(struct.Struct("<2I"))
            terrain = Terrain(origin, spacing, size, array.array("d", call.doubles()))
        _confine(start["memory_bytes"])
        if "Law" in start["what"]:
            return self._start_law(start["what"]["Law"], reply)
        what = start["what"]["Python"]
        cls = _subsystem(what["path"])
        self.host = Host(start, terrain, self.lines)
        subsystem = cls(self.host, what["config"])
        self.subsystem, self.fields = subsystem, list(subsystem.fields)
        subsystem._names = _names(subsystem.state)
        self.variables = list(subsystem.variables)
        can = subsystem.can | (_STATE | _SERIALIZE if subsystem.state is not None else 0)
        reply.u32(can)
        self._describe(reply)

    def _start_law(self, what, reply):
        # Started again it gets other numbers.
        self.law = module = self.law or _load(what["path"])
        self.numbers = types.SimpleNamespace(**what["numbers"])
        self.pressure, self.shear = [getattr(module, name, None) for name in ("pressure", "shear")]
        if not (callable(self.pressure) or callable(self.shear)):
            raise Refused(f"{what['path']} must hold a function pressure(law, nodes, out), shear(law, nodes, out) or both")
        reply.u32(int(getattr(module, "STATE_DOUBLES", 0)))
        reply.u8(callable(self.pressure))
        reply.u8(callable(self.shear))

    def _pressure(self, call, reply):
        nodes, out = PressureNodes(), PressureAnswer()
        nodes.b, nodes.h = call.take(TWO)
        nodes.depth, nodes.permanent, nodes.slip, nodes.state = [call.doubles() for _ in range(4)]
        n, kept = len(nodes.depth), len(nodes.permanent)
        out.pressure, out.slope, out.permanent, out.state = [reply.doubles(k) for k in (n, n, kept, len(nodes.state))]
        out.longest = INFINITY
        self.pressure(self.numbers, nodes, out)
        reply.put(ONE, out.longest)

    def _shear(self, call, reply):
        nodes, out = ShearNodes(), ShearAnswer()
        nodes.h, = call.take(ONE)
        nodes.pressure, nodes.slip, nodes.state = [call.doubles() for _ in range(3)]
        out.stress, out.by_pressure, out.by_slip = [reply.doubles(len(nodes.pressure)) for _ in range(3)]
        out.longest = INFINITY
        self.shear(self.numbers, nodes, out)
        reply.put(ONE, out.longest)

    def _describe(self, reply):
        subsystem = self.subsystem
        reply.u32(len(self.variables))
        for k, v in enumerate(self.variables):
            reply.u32(k)
            reply.text(v.name)
            for number in (v.type, v.causality, v.effect):
                reply.u32(number)
            reply.text(v.unit)
            reply.text(v.help)
            reply.numbers(v.low, v.high)
            reply.values(U32, v.dims)
            reply.values(STRING, v.enumeration)
        reply.u32(len(subsystem.actions))
        for name, help in subsystem.actions:
            reply.text(name)
            reply.text(help)
        reply.u32(len(subsystem.bodies))
        for name, mass in subsystem.bodies:
            reply.text(name)
            reply.numbers(mass)
        reply.u32(len(subsystem.shapes))
        for k, s in enumerate(subsystem.shapes):
            reply.u32(k)
            reply.u32(s.body)
            reply.text(s.name or subsystem.bodies[s.body][0])
            reply.u8(s.kind)
            if s.kind in (4, 7):
                points, triangles = s.size
                reply.u32(len(points))
                for p in points:
                    reply.numbers(*p)
                reply.u32(len(triangles))
                for t in triangles:
                    reply.put(struct.Struct("<3I"), *t)
            else:
                reply.numbers(*s.size)
            reply.numbers(*s.position, *s.orientation)
            reply.u8(bool(s.collides))
            reply.put(struct.Struct("<I2f"), *s.material)
        self._joints(reply)
        reply.u32(len(self.fields))
        for f in self.fields:
            reply.text(f.name)
            reply.text(f.unit)
            reply.numbers(*f.origin, f.spacing)
            reply.put(struct.Struct("<3I"), *f.size, f.edge)
        reply.u32(len(subsystem.streams))
        for s in subsystem.streams:
            for text in (s.name, s.schema, s.encoding):
                reply.text(text)
            reply.numbers(s.rate_hz)
            reply.u32(s.most_bytes)
            reply.text(s.help)
        reply.u8(1)
        self._tiles(reply)

    def _joints(self, reply):
        numbers = {v.name: k for k, v in enumerate(self.variables)}
        reply.u32(len(self.subsystem.joints))
        for j in self.subsystem.joints:
            unknown = [name for name in j.variables.values() if name not in numbers]
            if unknown:
                raise Refused(f"the joint `{j.name}` names the variable `{unknown[0]}`, which there is not")
            reply.text(j.name)
            reply.u32(GROUND if j.parent is None else j.parent)
            reply.u32(j.child)
            reply.numbers(*j.position, *j.orientation, *j.axis)
            reply.u32(j.kind)
            reply.numbers(*j.limits)
            for role in ("position", "velocity", "torque", "torque_limit", "blocked"):
                reply.u32(numbers.get(j.variables.get(role), GROUND))
            reply.text(j.break_action)

    def _messages(self, reply):
        """The messages of the last step on the streams."""
        for k, info in enumerate(self.subsystem.streams):
            try:
                message = self.subsystem.stream(k)
            except Exception as e:  # the host reports it as the failure of `stream`
                reply.u8(2)
                reply.text(str(e) or type(e).__name__)
                continue
            try:
                time, data = (0.0, b"") if message is None else (float(message[0]), memoryview(message[1]).tobytes())
            except (TypeError, ValueError, IndexError):
                reply.u8(2)
                reply.text(f"stream `{info.name}`: a message is None or (time, bytes), and not a {type(message).__name__} such as {message!r:.50}")
                continue
            # room for the beginnings of the others, and for the log
            fits = reply.at + len(data) + 65536 < len(reply.memory)
            if not fits and k not in self.left_out:
                self.left_out.add(k)
                self.host.log(f"stream `{info.name}`: a message of {len(data)} bytes is left out: those of a step have room for {len(reply.memory)}", WARNING)
            reply.u8(message is not None and fits)
            if message is not None and fits:
                reply.numbers(time)
                reply.text(data)

    def _ask(self, question, *parts):
        """Asks the host while it waits for the end of `observe`; its answer."""
        reply = Reply(self.segment.answer)
        OUTCOME.pack_into(self.segment.answer, 0, 0, 0)
        reply.u8(question)
        for part in parts:
            reply.bytes(part)
        self.segment.post(reply.at)
        length = self.segment.next()
        if self.NAMES[self.segment.call[0]] != "answer":
            raise RuntimeError("the host has stopped to answer")
        return Call(self.segment.call, length)

    def _observe(self, call, reply):
        step = self._step(call)
        start, end = call.take(TWO)
        revision, = call.take(struct.Struct("<Q"))
        if revision != self.revision:
            answer = self._ask(1)
            self.others = [answer.text() for _ in range(answer.u32())]
            self.revision = revision
        self.subsystem.observe(step, World(self._ask, start, end, self.others))
        reply.u8(0)
        self._messages(reply)

    def _visibility(self, call, reply):
        shown = self.subsystem.shape_visibility()
        shown = [True] * len(self.subsystem.shapes) if shown is None else shown
        reply.text(bytes(map(bool, shown)))

    def _overlays(self, call, reply):
        shown = self.subsystem.overlays()
        reply.u32(len(shown))
        for o in shown:
            reply.text(o.layer)
            reply.u32(GROUND if o.frame is None else o.frame)
            reply.put(struct.Struct("<4f"), *o.colour)
            reply.u8(o.figure)
            if o.figure < 3:
                reply.u32(len(o.data))
                for point in o.data:
                    reply.numbers(*point)
                reply.numbers(o.size)
            elif o.figure == 3:
                position, orientation, half = o.data
                reply.numbers(*position, *orientation, *half)
            else:
                position, text = o.data
                reply.numbers(*position, o.size)
                reply.text(text)

    def _tiles(self, reply):
        """The tiles of fields that are new."""
        self.generation += 1
        for number, field in enumerate(self.fields):
            for k in sorted(field._new):
                reply.u8(1)
                reply.put(struct.Struct("<IIQB"), number, k, self.generation, 1)
                tile = field._tile(k)
                reply.doubles(len(tile))[:] = tile
            field._new.clear()
        reply.u8(0)

    def _step(self, call):
        step = Step()
        step.t, step.h, step.index, step.trial, step.n = call.take(STEP)
        at = call.at
        ports = call.u32()
        call.at += ports * PORT.size
        nodes = call.u32()
        call.at += nodes * NODE.size
        raw = call.memory[at:call.at]
        # Between trials of a step the ports stay: they are read once.
        if raw != self.ports_seen:
            self.ports_seen = bytes(raw)
            raw = raw[4:]
            self.ports = [Port(v) for v in PORT.iter_unpack(raw[:ports * PORT.size])]
            self.nodes = [Node(*v) for v in NODE.iter_unpack(raw[ports * PORT.size + 4:])]
        step.ports, step.nodes = self.ports, self.nodes
        return step

    def _responded(self, step, reply, run):
        out, n = Response(), step.n
        out.x, out.v, out.a, out.t = [reply.doubles(n) for _ in range(4)]
        out.reached, out.flags = step.t + step.h, 0
        run(out)
        reply.put(END, out.reached, out.flags)

    def _set_ports(self, call, reply):
        step = self._step(call)
        laws = [Law(*call.take(LAW)) for _ in range(call.u32())]
        at = reply.at
        reply.at += 4 + LAW.size * len(laws)
        self._responded(step, reply, lambda out: self.subsystem.set_ports(step, laws, out))
        end, reply.at = reply.at, at
        reply.u32(len(laws))
        for law in laws:
            reply.put(LAW, law.t_min, law.t_max, law.mu, law.compliance)
        reply.at = end

    def _estimate(self, call, reply):
        step = self._step(call)
        partner, out = Motion(call.doubles(), call.doubles()), Estimate()
        out.t_star, out.x_free, out.g = reply.doubles(step.n), reply.doubles(step.n), reply.doubles(step.n * step.n)
        out.active, out.unique = [0] * len(step.ports), False
        self.subsystem.estimate_forces(step, partner, out)
        reply.text(bytes(map(bool, out.active)))
        reply.u8(bool(out.unique))

    def _solve(self, call, reply):
        step, estimate = self._step(call), Estimate()
        estimate.t_star, estimate.x_free, estimate.g = call.doubles(), call.doubles(), call.doubles()
        estimate.active, estimate.unique = list(call.bytes()), bool(call.u8())
        self._responded(step, reply, lambda out: self.subsystem.solve_compatibility(step, estimate, out))

    def _advance(self, call, reply):
        step, kind = self._step(call), call.u8()
        if kind < 2:
            given = Force()
            given.t = call.doubles()
            given.motion = Motion(call.doubles(), call.doubles()) if kind else None
        else:
            given = Motion(call.doubles(), call.doubles())
        self._responded(step, reply, lambda out: self.subsystem.advance(step, given, out))

    def _jacobian(self, call, reply):
        step, level = self._step(call), call.u32()
        self.subsystem.interface_jacobian(step, level, reply.doubles(step.n * step.n))

    def _commit(self, call, reply):
        step = self._step(call)
        self.subsystem.commit(step, call.doubles(), Motion(call.doubles(), call.doubles()))
        self.begun = True
        self._tiles(reply)
        self._messages(reply)

    def _slot(self, call):
        slot = call.u32()
        if self.subsystem.state is None:
            raise Unsupported
        if slot >= self.host.slots:
            raise Refused(f"there is no slot {slot}")
        return slot

    def _save(self, call, reply):
        self.slots[self._slot(call)] = _kept(self.subsystem)

    def _restore(self, call, reply):
        slot = self._slot(call)
        if slot not in self.slots:
            raise Refused(f"nothing was saved in slot {slot}")
        _put_back(self.subsystem, self.slots[slot])
        self._tiles(reply)
        self._messages(reply)

    def _serialize(self, call, reply):
        if self.subsystem.state is None:
            raise Unsupported
        reply.text(_packed_state(self.subsystem))

    def _deserialize(self, call, reply):
        if self.subsystem.state is None:
            raise Unsupported
        _unpacked_state(self.subsystem, call.bytes())
        self._tiles(reply)
        self._messages(reply)

    def _variable(self, number, kind):
        if number >= len(self.variables):
            raise Refused(f"there is no variable {number}")
        variable = self.variables[number]
        if variable.type != kind:
            raise Refused(f"`{variable.name}` has another type")
        return variable

    def _get(self, call, reply):
        ids = call.values(U32)
        kind, count = call.u32(), call.u32()
        values = []
        for number in ids:
            variable = self._variable(number, kind)
            value = self.subsystem.get_value(variable)
            values.extend(value) if variable.dims else values.append(value)
        if len(values) != count:
            raise Refused(f"{len(values)} values, but room for {count}")
        reply.values(kind, values)

    def _set(self, call, reply):
        ids = call.values(U32)
        kind = call.u32()
        values, at, todo = call.values(kind), 0, []
        for number in ids:
            variable = self._variable(number, kind)
            part = values[at:at + variable.count]
            at += variable.count
            self._acceptable(variable, part)
            todo.append((variable, list(part) if variable.dims else part[0]))
        for variable, value in todo:
            self.subsystem.set_value(variable, value)

    def _acceptable(self, variable, values):
        if variable.effect == READ_ONLY:
            raise Refused(f"`{variable.name}` cannot be set")
        if variable.effect == NEEDS_RESET and self.begun:
            raise Refused(f"`{variable.name}` can be set before the first step only")
        if len(values) != variable.count:
            raise Refused(f"`{variable.name}` takes {variable.count} values")
        if variable.type < BOOL and not all(variable.low <= x <= variable.high for x in values):
            raise Refused(f"`{variable.name}` takes {variable.low} to {variable.high}")
        if variable.type == ENUMERATION and not all(0 <= x < len(variable.enumeration) for x in values):
            raise Refused(f"`{variable.name}` takes one of {', '.join(variable.enumeration)}")

    def _act(self, call, reply):
        action, arguments = call.text(), call.text()
        if action not in [name for name, _ in self.subsystem.actions]:
            raise Refused(f"there is no action `{action}`")
        self.subsystem.act(action, json.loads(arguments or "{}"))
        self._tiles(reply)
        self._messages(reply)

    def _next_event(self, call, reply):
        reply.numbers(self.subsystem.next_event_time())

    def _body_states(self, call, reply):
        states = self.subsystem.body_states()
        reply.u32(len(states))
        for position, orientation, velocity, turning in states:
            reply.put(BODY, *position, *orientation, *velocity, *turning)

    def _energy(self, call, reply):
        reply.numbers(*self.subsystem.energy())

    def _quit(self, call, reply):
        subsystem, self.subsystem = self.subsystem, None
        if subsystem is not None:
            subsystem.close()


class _Print:
    """The module's output goes to the log of the run, line by line."""

    encoding = "utf-8"

    def __init__(self, lines, level):
        self.lines, self.level, self.rest = lines, level, ""

    def write(self, text):
        *whole, self.rest = (self.rest + text).split("\n")
        for line in whole:
            if len(self.lines) < 1000:
                self.lines.append((self.level, line[:10000]))
        return len(text)

    def flush(self):
        pass

    def isatty(self):
        return False


def _load(path):
    """The file as a module. It is read afresh, and no compiled copy is left next to it."""
    sys.path.insert(1, os.path.dirname(path))
    with open(path, encoding="utf-8") as file:
        text = file.read()
    module = types.ModuleType(os.path.splitext(os.path.basename(path))[0])
    module.__file__ = path
    sys.modules[module.__name__] = module
    exec(compile(text, path, "exec"), module.__dict__)
    return module


def _subsystem(path):
    """The class of a module."""
    module = _load(path)
    found = [c for c in vars(module).values()
             if isinstance(c, type) and issubclass(c, Subsystem) and c.__module__ == module.__name__]
    if len(found) != 1:
        names = ", ".join(c.__name__ for c in found) or "none"
        raise Refused(f"{path} must hold one class derived from terraglue.Subsystem; it holds {names}")
    return found[0]


def _confine(memory_bytes):
    import resource
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    most = memory_bytes + START + 2 * AREA
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _follow_the_host():
    """An orphan ends with all that it has started: the host holds the other end of standard input."""
    while os.read(0, 64):
        pass
    os.killpg(0, signal.SIGKILL)


def serve(path):
    """Serves the host that made the segment at `path`."""
    import faulthandler
    faulthandler.enable(sys.__stderr__)
    # The host asks where a module hangs.
    faulthandler.register(signal.SIGUSR1, sys.__stderr__, all_threads=False)
    segment, worker = Segment(path), Worker()
    worker.segment = segment
    threading.Thread(target=_follow_the_host, daemon=True).start()
    sys.stdout, sys.stderr = _Print(worker.lines, INFO), _Print(worker.lines, WARNING)
    while True:
        length = segment.next()
        number = segment.call[0]
        segment.post(worker.answer(segment.call, length, segment.answer))
        if number == Worker.NAMES.index("quit"):
            # The host ends the whole group; nothing of the module runs any more.
            signal.pause()
