"""Calls and answers as bytes in the memory that a worker shares with its host: the segment, and the data read and written
there. The other side is `coordinator/host/src/isolation`."""
import array
import ctypes
import mmap
import os
import struct

from terraglue import BINARY, ENUMERATION, I64, NAN, STRING

AREA, START = 64 << 20, 4096
ONE, U32_FORM, OUTCOME, STEP = struct.Struct("<d"), struct.Struct("<I"), struct.Struct("<IB"), struct.Struct("<ddQQQ")
PORT, NODE, LAW, BODY, END = (struct.Struct(f) for f in ("<QIiIIIIII18d", "<ii4d", "<4d", "<13d", "<dI"))
_TYPES = "dfbhiqBHIQ?"
_SIZES = [struct.calcsize("<" + c) for c in _TYPES]
_EMPTY = memoryview(array.array("d"))
_NANS = memoryview(array.array("d", [NAN]) * 4096).cast("B")


class Segment:
    """Shared memory: at its start call, answer, call_length, answer_length, cancel as 32-bit words."""

    WAIT, WAKE = 0, 1
    # Looks at the counter before it sleeps (some 150 us, longer than it takes to wake the host), and how many waits go
    # without after looks in vain.
    LOOKS, PAUSE = 3000, 256

    def __init__(self, path):
        with open(path, "r+b") as file:
            self.memory = mmap.mmap(file.fileno(), START + 2 * AREA)
        whole = memoryview(self.memory)
        self.head = whole[:64].cast("I")
        self.call = whole[START:START + AREA].toreadonly()
        self.answer = whole[START + AREA:]
        self.last = 0
        self._luck = 1 if (os.cpu_count() or 1) > 1 else -(1 << 62)
        word = ctypes.addressof(ctypes.c_char.from_buffer(self.memory))
        machine = os.uname().machine
        number = ctypes.c_long({"x86_64": 202}.get(machine, 98))
        self._weak = machine != "x86_64"
        system = ctypes.CDLL(None).syscall
        system.argtypes = [ctypes.c_long, ctypes.c_void_p, ctypes.c_int, ctypes.c_uint32, ctypes.c_void_p]
        self._system, self._number = system, number
        self._call, self._answer = ctypes.c_void_p(word), ctypes.c_void_p(word + 4)
        self._one = ctypes.c_uint32(1)

    def next(self):
        """Sleeps until there is a call; its length."""
        head, last = self.head, self.last
        if self._luck > 0:
            for _ in range(self.LOOKS):
                if head[0] != last:
                    self._luck = min(self._luck + 1, 8)
                    break
            else:
                self._luck = self._luck - 4 if self._luck > 4 else -self.PAUSE
        else:
            self._luck += 1
        while head[0] == last:
            self._system(self._number, self._call, self.WAIT, last, None)
        self.last = head[0]
        return min(head[2], AREA)

    def post(self, length):
        """The answer is written."""
        self.head[3] = length
        if self._weak:
            # A call of the kernel orders earlier writes before the counter.
            self._system(self._number, self._answer, self.WAKE, self._one, None)
        self.head[1] = self.last
        self._system(self._number, self._answer, self.WAKE, self._one, None)


class Call:
    """A request that is read from its start on."""

    def __init__(self, memory, length):
        self.memory, self.at, self.end = memory, 1, length

    def take(self, form):
        at = self.at
        self.at = at + form.size
        return form.unpack_from(self.memory, at)

    def u8(self):
        self.at += 1
        return self.memory[self.at - 1]

    def u32(self):
        self.at += 4
        return U32_FORM.unpack_from(self.memory, self.at - 4)[0]

    def bytes(self):
        count = self.u32()
        self.at += count
        return bytes(self.memory[self.at - count:self.at])

    def text(self):
        return self.bytes().decode(errors="replace")

    def doubles(self):
        at = self.at + 4
        count = U32_FORM.unpack_from(self.memory, self.at)[0]
        self.at = end = at + 8 * count
        return self.memory[at:end].cast("d") if count else _EMPTY

    def bytes_of(self, size):
        """The bytes of a counted row of structures of this size."""
        count = size * self.u32()
        self.at += count
        return bytes(self.memory[self.at - count:self.at])

    def scene_bodies(self):
        """Names and masses at the start of a scene; none where there is no scene."""
        if not self.u8():
            return []
        return [(self.text(), *self.take(ONE)) for _ in range(self.u32())]

    def values(self, kind):
        count = self.u32()
        if kind in (STRING, BINARY):
            return [self.text() if kind == STRING else self.bytes() for _ in range(count)]
        kind = I64 if kind == ENUMERATION else kind
        at = self.at
        self.at += count * _SIZES[kind]
        return struct.unpack_from(f"<{count}{_TYPES[kind]}", self.memory, at)


class Reply:
    """An answer that grows behind its outcome. No line of the log stands before it; they are put in afterwards."""

    def __init__(self, memory):
        self.memory, self.at = memory, OUTCOME.size

    def put(self, form, *values):
        form.pack_into(self.memory, self.at, *values)
        self.at += form.size

    def bytes(self, data):
        self.memory[self.at:self.at + len(data)] = data
        self.at += len(data)

    def u8(self, value):
        self.memory[self.at] = value
        self.at += 1

    def u32(self, value):
        U32_FORM.pack_into(self.memory, self.at, value)
        self.at += 4

    def text(self, text):
        data = text if isinstance(text, bytes) else str(text).encode(errors="replace")
        self.u32(len(data))
        self.bytes(data)

    def doubles(self, count):
        """Room for that many doubles, filled with NaN."""
        at = self.at + 4
        U32_FORM.pack_into(self.memory, self.at, count)
        self.at = end = at + 8 * count
        if not count:
            return _EMPTY
        view = self.memory[at:end]
        for k in range(0, 8 * count, len(_NANS)):
            part = view[k:k + len(_NANS)]
            part[:] = _NANS[:len(part)]
        return view.cast("d")

    def numbers(self, *values):
        self.put(struct.Struct(f"<{len(values)}d"), *values)

    def values(self, kind, values):
        self.u32(len(values))
        if kind in (STRING, BINARY):
            for value in values:
                self.text(value)
            return
        kind = I64 if kind == ENUMERATION else kind
        self.put(struct.Struct(f"<{len(values)}{_TYPES[kind]}"), *values)
