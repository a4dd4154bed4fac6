"""What the scripts in drivers share: their arguments, refusals in one line, and how they end. Needs no
package."""

import argparse
import contextlib
import ctypes.util
import errno
import math
import os
import subprocess
import sys
import zlib


REMEDIES = {errno.ENOSPC: "free some space or choose another folder",
            errno.EFBIG: "free some space or choose another folder",
            errno.ENAMETOOLONG: "choose a shorter name"}


class Unusable(Exception):
    """Why a script cannot go on, in one line."""


def refuse(reason):
    """Ends the script with status 1 and one line."""
    line = " ".join(str(reason).splitlines())
    print(f"{os.path.basename(sys.argv[0])}: {line}", file=sys.stderr)
    sys.exit(1)


HELP = {"-h", "-help", "--help"}


def print_help(documentation):
    print(documentation.strip())
    sys.exit(0)


def refuse_missing(module, install):
    """Ends a script whose Python lacks a module; `install` says how to get it. Help needs no module."""
    if HELP & set(sys.argv[1:]):
        print_help(sys.modules["__main__"].__doc__)
    usual = "/usr/bin/python3"
    of_another = os.path.exists(usual) and not os.path.samefile(sys.executable, usual)
    run_usual = f"; packages of apt are of {usual}: {usual} {sys.argv[0]} …" if of_another else ""
    refuse(f"{module.name} is missing in {sys.executable}: {install}{run_usual}")


def run(main):
    """Runs the main function of a script. Ends the script with status 1 and one line where a file or an argument
    is unusable, with status 130 after Ctrl-C, else with the status that `main` returns, where it returns one:
    pvpython crashes at an exit once it has drawn."""
    try:
        if (status := main()):
            sys.exit(status)
    except Unusable as reason:
        refuse(reason)
    except OSError as reason:
        told = f"{reason.filename}: {reason.strerror}" if reason.filename else reason
        refuse("; ".join(filter(None, [str(told), REMEDIES.get(reason.errno)])))
    except KeyboardInterrupt:
        sys.exit(130)


def start(*command, **how):
    """Runs a program as subprocess.run does, without this script's standard input: mpirun reads all of it, also
    the lines that a loop of the shell around this script is about to read."""
    return subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, **how)


@contextlib.contextmanager
def reading(file, what):
    """Makes the failures of reading a damaged or foreign file one line that names it."""
    try:
        yield
    except OSError as reason:
        raise Unusable(f"{file}: cannot be read: {reason}") from None
    except RecursionError:
        raise Unusable(f"{file}: nested too deeply for {what}") from None
    except (ArithmeticError, AttributeError, LookupError, MemoryError, RuntimeError, SyntaxError, TypeError,
            ValueError, zlib.error) as reason:
        raise Unusable(f"{file}: damaged, or not {what}: {reason}") from None


class _Store(argparse.Action):
    """Stores the value of an argument; of an option that is given several times the last one, with a warning
    where they differ."""

    def __call__(self, parser, namespace, values, option_string=None):
        before = getattr(self, "before", values)
        if option_string and before != values:
            print(f"{parser.prog}: warning: option {option_string} is given several times: {values} is used, not "
                  f"{before}; give it once", file=sys.stderr)
        self.before = values
        setattr(namespace, self.dest, values)


class Arguments(argparse.ArgumentParser):
    """Arguments of a script. -h, -help and --help print its documentation; a wrong argument ends it with
    status 1 and one line."""

    def __init__(self, documentation):
        super().__init__(prog=os.path.basename(sys.argv[0]), description=documentation, add_help=False,
                         allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter)
        for name in (None, "store"):
            self.register("action", name, _Store)
        self.add_argument("-h", "-help", "--help", action="help", help="print this text and end")

    def error(self, message):
        refuse(f"{message}; -help lists the arguments")


def number_from(low, high, kind=int):
    """The type of an argument that is a number from `low` to `high`."""
    name = {int: "whole number", float: "number"}[kind]

    def read(text):
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text}: must be a {name} from {low:g} to {high:g}")
        return value

    return read


def own_names(files):
    """The names of results without their folders; with the folder each is in where these are alike."""
    names = [os.path.basename(file) for file in files]
    if len(set(names)) == len(names):
        return names
    return [os.path.join(os.path.basename(os.path.dirname(os.path.abspath(file))), name)
            for file, name in zip(files, names)]


def require_file(file, advice, option=""):
    """Returns the name of a file that is there. Refuses a folder, and what is not there; `advice` says what to give,
    `option` where."""
    if not os.path.isfile(file):
        refuse(f"{option}{file}: {'is a folder' if os.path.isdir(file) else 'no such file'}; {advice}")
    return file


def result_name(text):
    """The path of a result without its ending, which may be left out. Refuses one that is not there."""
    name = text[:-len(".h5")] if text.lower().endswith(".h5") else text
    there = os.path.exists(f"{name}.h5")
    if text.lower().endswith((".yaml", ".yml")) and not there:
        refuse(f"{text}: is a scene; solve it, and give its result, NAME.h5")
    require_file(text if os.path.isdir(text) and not there else f"{name}.h5",
                 "give what repose-solve writes, NAME or NAME.h5")
    return name


def words(documentation, least, most=math.inf):
    """The arguments of a script without options, `least` to `most` of them."""
    given = sys.argv[1:]
    if HELP & set(given):
        print_help(documentation)
    unknown = [word for word in given if word.startswith("-") and not is_number(word)]
    if unknown or not least <= len(given) <= most:
        usage = next(line.strip() for line in documentation.splitlines()
                     if line.startswith(("    drivers/", "    pvpython ")))
        refuse(f"{unknown[0]}: unknown; usage: {usage}" if unknown else f"usage: {usage}")
    return given


def is_number(text):
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def has_display():
    """Returns whether an X server answers at DISPLAY."""
    library = ctypes.util.find_library("X11")
    if not library or not os.environ.get("DISPLAY"):
        return False
    connect = ctypes.CDLL(library).XOpenDisplay
    connect.restype = ctypes.c_void_p
    return bool(connect(None))
