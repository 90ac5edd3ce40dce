"""An interpreter that has loaded the imports of every worker, and waits. A host that asks gets a worker that is a copy of it (fork):
that takes a millisecond, a start some fifty. `terraglue check-module` keeps a few, because most of its tests make workers.

Hosts ask over a socket, which is standard input here, with three lines: segment, folder, and where the standard input of the
worker is. They are answered with the number of its process and, when it has ended, with its status (as of waitpid). A worker
ends with the connection."""
import faulthandler  # noqa: F401 (for the workers, as resource)
import gc
import os
import resource  # noqa: F401
import select
import signal
import socket
import sys
import traceback

import terraglue_wire
import terraglue_worker


class _Worker:
    """A worker and the connection to its host."""

    def __init__(self, host):
        self.host, self.process, self.told = host, 0, False
        lines = b""
        while lines.count(b"\n") < 3:
            part = host.recv(4096)
            if not part:
                raise OSError("a host that went away")
            lines += part
        self.segment, self.folder, stdin = lines.decode().splitlines()
        write = os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        self.files = [os.open(stdin, os.O_RDONLY), os.open(os.devnull, os.O_WRONLY),
                      os.open(os.path.join(self.folder, "stderr.txt"), write, 0o600)]

    def start(self, others):
        self.process = os.fork()
        if self.process == 0:
            self._live(others)
        os.setpgid(self.process, self.process)
        for file in self.files:
            os.close(file)
        self.host.sendall(b"%d\n" % self.process)

    def _live(self, others):
        """The worker's own life."""
        try:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            os.setpgid(0, 0)
            for to, file in enumerate(self.files):
                os.dup2(file, to)
                os.close(file)
            for other in others:
                other.close()
            self.host.close()
            os.environ["TMPDIR"] = self.folder
            sys.argv[1:] = [self.folder, self.segment]
            terraglue_worker.serve(self.segment)
        except BaseException:
            traceback.print_exc(file=sys.__stderr__)
        finally:
            os._exit(1)

    def tell(self):
        """Notifies the host when the process has ended. Its number stays taken until the host has let go of it."""
        if self.told:
            return
        ended = os.waitid(os.P_PID, self.process, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        if ended is not None:
            self.told = True
            status = ended.si_status << 8 if ended.si_code == os.CLD_EXITED else ended.si_status
            try:
                self.host.sendall(b"%d\n" % status)
            except OSError:
                pass  # A host that is gone is seen at its connection.

    def end(self):
        try:
            os.killpg(self.process, signal.SIGKILL)
        except ProcessLookupError:
            pass
        os.waitpid(self.process, 0)
        self.host.close()


def serve():
    """Serves hosts until the program that started this interpreter is gone: it holds the other end of standard output."""
    listener = socket.socket(fileno=os.dup(0))
    ended, wake = os.pipe()
    os.set_blocking(ended, False)
    os.set_blocking(wake, False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    # Several tests run at a time: who waits leaves the processor to others.
    terraglue_wire.Segment.LOOKS = 0
    poll, workers = select.poll(), {}
    for file, what in ((listener.fileno(), select.POLLIN), (1, 0), (ended, select.POLLIN)):
        poll.register(file, what)
    gc.collect()
    gc.freeze()
    while True:
        for file, _ in poll.poll():
            if file == 1:
                return
            if file == ended:
                try:
                    os.read(ended, 4096)
                except BlockingIOError:
                    pass
                for worker in workers.values():
                    worker.tell()
            elif file == listener.fileno():
                host, _ = listener.accept()
                try:
                    worker = _Worker(host)
                except (OSError, ValueError):
                    host.close()
                    continue
                workers[host.fileno()] = worker
                poll.register(host.fileno(), select.POLLIN)
                others = [listener] + [w.host for w in workers.values() if w is not worker]
                try:
                    worker.start(others)
                except OSError:
                    _leave(worker, poll, workers)
            elif file in workers:
                # The host has closed its end.
                _leave(workers[file], poll, workers)


def _leave(worker, poll, workers):
    file = worker.host.fileno()
    poll.unregister(file)
    del workers[file]
    if worker.process:
        worker.end()
    else:
        worker.host.close()
