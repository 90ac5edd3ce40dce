"""Sweeps by programs of a cluster: a Slurm array on two nodes of this host, and GNU parallel. The table has the bytes of a sweep alone."""

import os
import pathlib
import pwd
import shutil
import socket
import subprocess
import tempfile
import time

import pytest
from conftest import terraglue
from test_sweep import listed, recordings, whole  # noqa: F401

CONFIGURATION = """
ClusterName=terraglue
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/none
CredType=cred/none
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_min_interval=0
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
SlurmdParameters=config_overrides
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[1]} CPUs=1 State=UNKNOWN
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port={ports[2]} CPUs=1 State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
"""


def free_ports(count):
    held = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [own.getsockname()[1] for own in held]
    for own in held:
        own.close()
    return ports


@pytest.fixture
def slurm():
    """Environment in which `sbatch` reaches a cluster of two nodes."""
    path = os.environ["PATH"] + ":/usr/sbin"
    missing = [name for name in ("slurmctld", "slurmd", "sbatch", "sinfo") if shutil.which(name, path=path) is None]
    if missing:
        pytest.skip(f"no {missing[0]}: apt-get install slurm-wlm")
    # the names of its sockets may have 108 characters
    folder = pathlib.Path(tempfile.mkdtemp(prefix="slurm-", dir="/tmp"))
    for name in ("state", "spool-n1", "spool-n2", "cgroup"):
        (folder / name).mkdir(parents=True)
    text = CONFIGURATION.format(host=socket.gethostname().split(".")[0], user=pwd.getpwuid(os.geteuid()).pw_name, folder=folder, ports=free_ports(3))
    (folder / "slurm.conf").write_text(text)
    (folder / "cgroup.conf").write_text(f"CgroupPlugin=cgroup/v1\nCgroupMountpoint={folder}/cgroup\nCgroupAutomount=yes\n")
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf"), "PATH": path}
    start = lambda *command: subprocess.Popen([*command, "-D"], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    daemons = [start("slurmctld"), start("slurmd", "-N", "n1"), start("slurmd", "-N", "n2")]
    try:
        states, end = "", time.monotonic() + 60
        while states.split() != ["idle", "idle"]:
            if time.monotonic() > end or any(daemon.poll() is not None for daemon in daemons):
                logs = "".join(log.read_text()[-2000:] for log in sorted(folder.glob("*.log")))
                pytest.skip(f"Slurm does not start here: {states!r} {logs}")
            time.sleep(0.2)
            states = subprocess.run(["sinfo", "--noheader", "--Node", "--format=%T"], env=environment, capture_output=True, text=True).stdout
        yield environment
    finally:
        for daemon in daemons:
            daemon.terminate()
        for daemon in daemons:
            daemon.wait()
        shutil.rmtree(folder)


def test_a_slurm_array_on_two_nodes_gives_the_same_table(whole, slurm, tmp_path):  # noqa: F811
    script = listed(tmp_path, more=["--slurm"]).stdout
    done = subprocess.run(["sbatch", "--wait"], input=script, cwd=tmp_path, env=slurm, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert terraglue("sweep", "collect", "sweep", cwd=tmp_path).returncode == 0
    assert (tmp_path / "sweep/sweep.csv").read_bytes() == whole[1] and recordings(tmp_path) == recordings(whole[0])


def test_gnu_parallel_gives_the_same_table(whole, tmp_path):  # noqa: F811
    if shutil.which("parallel") is None:
        pytest.skip("no parallel: apt-get install parallel")
    commands = listed(tmp_path, more=["--commands"]).stdout
    done = subprocess.run(["parallel", "--will-cite", "-j", "2"], input=commands, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert terraglue("sweep", "collect", "sweep", cwd=tmp_path).returncode == 0
    assert (tmp_path / "sweep/sweep.csv").read_bytes() == whole[1] and recordings(tmp_path) == recordings(whole[0])
