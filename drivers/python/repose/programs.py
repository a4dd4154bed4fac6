"""The programs of Repose, and the environment in which mpirun starts them."""

import os
import pathlib
import shutil
import subprocess

FILE = pathlib.Path(__file__).resolve()


def find_program(name="repose-live"):
    """The absolute path of a program of Repose: of the build folder REPOSE_BUILD, else installed with this file, built
    in the project of this file, or on the PATH; REPOSE_LIVE names repose-live. FileNotFoundError without it."""
    if name == "repose-live" and os.environ.get("REPOSE_LIVE"):
        return absolute_program(os.environ["REPOSE_LIVE"], "set REPOSE_LIVE to repose-live")
    if build := os.environ.get("REPOSE_BUILD"):
        return absolute_program(os.path.join(build, "bin", name), "set REPOSE_BUILD to the folder that Repose is built in")
    top = FILE.parents[3]  # the project, or share of an installation
    folders = [top.parent / "bin", *sorted(top.glob("build*/bin")), os.environ.get("PATH", os.defpath)]
    return absolute_program(name, "build or install Repose, or set REPOSE_BUILD", os.pathsep.join(map(str, folders)))


def absolute_program(name, remedy, path=None):
    """The absolute path of a program, as it is started in another folder; FileNotFoundError without it."""
    found = shutil.which(name, path=path)
    if not found:
        raise FileNotFoundError(f"{name}: no such program; {remedy}")
    return os.path.abspath(found)


def mpi_environment(environment):
    """An environment with what drivers/setup.sh gives mpirun, where that is; what the user has set stays."""
    setup = FILE.parents[2] / "setup.sh"
    if not setup.is_file():
        return dict(environment)  # the package alone is installed
    printed = subprocess.check_output(["bash", "-c", '. "$0" && mpi_environment && env -0', setup], env=environment,
                                      stdin=subprocess.DEVNULL)
    return {**dict(entry.split("=", 1) for entry in os.fsdecode(printed).split("\0") if entry), **environment}
