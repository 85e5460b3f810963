"""Collects what rigwatch needs to run, and nothing else, into a folder that becomes an image.

    python -m tools.image.collect ENVIRONMENT IMAGE LOCK [MORE ...]

    python -m tools.image.collect /opt/rigwatch /image requirements/lock.txt /opt/rigwatch/configs

Taken are the Python that a virtual environment was made with, its standard library, the locked
packages, the shared libraries that these need, and the system's certificates and time zones. No
shell, package manager or other interpreter gets in: a program that is not on the list is an error.
"""

import os
import re
import ssl
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Sequence
from importlib import metadata
from pathlib import Path

from tools.image.elf import read_elf
from tools.image.tree import Tree

PROGRAMS = (r"python3\.\d+", r"rerun")
"""Programs of the image: the interpreter, and the viewer of the dashboard."""
NOT_OF_THE_LIBRARY = re.compile(
    r"test|idlelib|tkinter|_tkinter\..*|turtledemo|turtle\.py|ensurepip|lib2to3|config-.*"
    r"|site-packages|dist-packages"
)
"""Parts of the standard library: tests, windows, and what installs packages or compiles C."""
LOADED_BY_NAME = ("libgcc_s.so.1", "libnss_files.so.2", "libnss_dns.so.2", "libresolv.so.2")
"""Libraries that the C library loads when a thread ends or a host is looked up."""
SYSTEM = (
    "/etc/nsswitch.conf", "/etc/services", "/etc/protocols", "/etc/os-release", "/etc/ld.so.cache",
    "/etc/localtime", "/etc/timezone", "/usr/share/zoneinfo",
)  # fmt: skip
COMMAND = USER = "rigwatch"
NUMBER, STATE = 10001, "/var/lib/rigwatch"
SERIAL_LINES = 20
"""Number of the group dialout, to which serial lines belong."""


def collect(environment: Path, root: Path, lock: Path, *more: Path) -> Tree:
    """Collect the image's files.

    Args:
        environment: virtual environment with the locked packages and rigwatch.
        root: empty folder for them.
        lock: file of the locked packages.
        more: further files and folders.

    Raises:
        FileNotFoundError: a locked package or one of its files is missing.
        PermissionError: a program would get in that is not on the list.
    """
    tree = Tree(root)
    _place_python(tree, environment)
    _place_packages(tree, environment, [*_names(lock), COMMAND])
    _place_system(tree)
    for path in more:
        tree.place(path)
    programs = place_libraries(tree)
    if found := [str(one) for one in programs if not re.fullmatch("|".join(PROGRAMS), one.name)]:
        raise PermissionError(f"not on the list of programs: {', '.join(found)}")
    return tree


def _place_python(tree: Tree, environment: Path) -> None:
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    for name in ("python", "python3", f"python{version}"):
        tree.place(environment / "bin" / name)
    tree.place(environment / "pyvenv.cfg")
    library = Path(sysconfig.get_path("stdlib", vars={"installed_base": sys.base_prefix}))
    tree.place(library, lambda path: not NOT_OF_THE_LIBRARY.fullmatch(path.name))


def _names(lock: Path) -> list[str]:
    """Names of the locked packages."""
    return re.findall(r"^([\w.-]+)==", lock.read_text(encoding="utf-8"), re.MULTILINE)


def _place_packages(tree: Tree, environment: Path, names: Sequence[str]) -> None:
    (site,) = environment.glob("lib/python3.*/site-packages")
    found = {_plain(one.name): one for one in metadata.distributions(path=[str(site)])}
    for name in names:
        if _plain(name) not in found:
            raise FileNotFoundError(f"{environment}: {name} is not installed")
        for path in _files(found[_plain(name)]):
            tree.place(path)


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _files(package: metadata.Distribution) -> Iterator[Path]:
    """The files that a package has installed, of its commands only that of rigwatch."""
    for entry in package.files or ():
        path = Path(os.path.normpath(str(package.locate_file(entry))))
        inside = "site-packages" in path.parts or path.name == COMMAND
        if inside and (path.suffix != ".pyc" or path.exists()):
            yield path


def place_libraries(tree: Tree) -> list[Path]:
    """Place the shared libraries that what is in the tree needs, and those that these need.

    Returns:
        the programs in the tree. A script is none: of all interpreters only Python is there.
    """
    known, programs = _libraries_of_the_system(), []
    for name in filter(known.__contains__, LOADED_BY_NAME):
        tree.place(known[name])
    for path in tree.files:  # which grows meanwhile
        if (elf := read_elf(path)) is None:
            continue
        if elf.is_program:
            programs.append(path)
        for name in elf.needed:
            beside = next((at / name for at in elf.folders if (at / name).exists()), None)
            # What is not found is missing here too: a package has modules for libraries that only
            # some machines have.
            if place := beside or known.get(name):
                tree.place(place)
        if elf.loader:
            tree.place(Path(elf.loader))
    return programs


def _libraries_of_the_system() -> dict[str, Path]:
    """Where the loader finds each shared library."""
    listed = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True)
    listed_at = re.compile(r"^\s+(\S+) \(.*(?:x86-64|AArch64).*\) => (\S+)$", re.MULTILINE)
    return {name: Path(path) for name, path in reversed(listed_at.findall(listed.stdout))}


def _place_system(tree: Tree) -> None:
    paths = ssl.get_default_verify_paths()
    certificates = (paths.openssl_cafile, paths.openssl_capath)
    for path in map(Path, (*SYSTEM, *certificates)):
        if path.exists():
            tree.place(path)
    tree.write(Path("/etc/passwd"), f"root:x:0:0::/:\n{USER}:x:{NUMBER}:{NUMBER}::{STATE}:\n")
    tree.write(Path("/etc/hosts"), "127.0.0.1 localhost\n::1 localhost\n")
    groups = f"root:x:0:\ndialout:x:{SERIAL_LINES}:{USER}\n{USER}:x:{NUMBER}:\n"
    tree.write(Path("/etc/group"), groups)
    tree.make(Path("/tmp"), 0o1777)
    tree.make(Path(STATE).parent)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(f"collect: found {len(sys.argv) - 1} words, expected ENVIRONMENT IMAGE LOCK")
    try:
        made = collect(*map(Path, sys.argv[1:]))
    except (OSError, subprocess.CalledProcessError) as error:
        sys.exit(f"collect: {error}")
    print(f"collect: {len(made.files)} files in {made.root}")
