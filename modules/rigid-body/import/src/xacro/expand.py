"""Expands a xacro file by the Python package `xacro`, within bounds: python3 -c THIS FILE FOLDER...

The folders are searched for what $(find PACKAGE) names, where ROS, which knows its packages itself, is not there.
"""
import os
import resource
import signal
import sys
import types

SECONDS, BYTES = 30, 1 << 30
MISSING = 77

signal.alarm(SECONDS)
resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
try:
    import xacro
except ImportError:
    sys.exit(MISSING)

robot, folders = os.path.abspath(sys.argv[1]), sys.argv[2:]


def is_package(folder, name):
    if os.path.basename(folder) == name:
        return os.path.isdir(folder)
    try:
        with open(os.path.join(folder, "package.xml")) as text:
            return f"<name>{name}</name>" in text.read()
    except OSError:
        return False


def share(name):
    for given in folders:
        if given.startswith(name + "="):
            return given[len(name) + 1 :]
    above, around = os.path.dirname(robot), []
    while above != os.path.dirname(above):
        around += [above, os.path.join(above, name)]
        above = os.path.dirname(above)
    for folder in folders:
        around += [folder, os.path.join(folder, name)]
    found = [folder for folder in around if is_package(folder, name)]
    if not found:
        raise LookupError(f'there is no package {name} around the file; say packages = {{ {name} = "FOLDER" }}')
    return found[0]


try:
    import ament_index_python.packages  # noqa: F401
except ImportError:
    ament = types.ModuleType("ament_index_python")
    ament.packages = types.ModuleType("ament_index_python.packages")
    ament.packages.get_package_share_directory = share
    sys.modules["ament_index_python"], sys.modules["ament_index_python.packages"] = ament, ament.packages

sys.argv = ["xacro", robot]
xacro.main()
