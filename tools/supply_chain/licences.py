"""Licences of the locked packages, from what they declare, checked against an allow-list.

python -m tools.supply_chain.licences      # one line per package; 1 if one is not allowed
"""

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).parents[2]
LOCKS = ("lock", "build", "dev")
ALLOWED = frozenset({
    "0BSD", "Apache-2.0", "BSD", "BSD-2-Clause", "BSD-3-Clause", "CC0-1.0", "EPL-2.0", "ISC",
    "MIT", "MIT-0", "MIT-CMU", "MPL-2.0", "PSF-2.0", "Zlib", "Apache-2.0 WITH LLVM-exception",
})  # fmt: skip
"""Permissive licences, and those whose copyleft ends at their own files (MPL, EPL)."""
TEST_TOOLS = {"libfaketime": "GNU General Public License v2 (GPLv2)"}
"""Programs of the lock `dev` alone that tests start; rigwatch neither imports nor ships them."""
_CLASSIFIERS = {
    "Apache Software License": "Apache-2.0",
    "BSD License": "BSD",
    "Eclipse Public License 2.0 (EPL-2.0)": "EPL-2.0",
    "ISC License (ISCL)": "ISC",
    "MIT License": "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
}
_TEXTS = {
    "3-Clause BSD License": "BSD-3-Clause",
    "BSD 3-Clause": "BSD-3-Clause",
    "BSD 2-Clause License": "BSD-2-Clause",
    "Apache 2.0": "Apache-2.0",
}
LOCKED = re.compile(r"^([A-Za-z0-9][A-Za-z0-9._-]*)==([^ \\;\n]+)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Locked:
    """A package in a lock file: name, version, and the SHA-256 of its files."""

    name: str
    version: str
    hashes: tuple[str, ...]


def locked(lock: str) -> list[Locked]:
    """The packages of requirements/<lock>.txt."""
    text = (ROOT / "requirements" / f"{lock}.txt").read_text(encoding="utf-8")
    found = list(LOCKED.finditer(text))
    ends = [one.start() for one in found[1:]] + [len(text)]
    return [
        Locked(one[1], one[2], tuple(re.findall(r"sha256:([0-9a-f]{64})", text[one.end() : end])))
        for one, end in zip(found, ends, strict=True)
    ]


def licence_of(name: str) -> str:
    """The licence of an installed package as an SPDX expression, "" if it declares none."""
    declared = metadata.metadata(name)
    if expression := declared.get("License-Expression"):
        return str(expression)
    text = (declared.get("License") or "").strip()
    known = {*ALLOWED, *_TEXTS}
    terms = [term for term in re.split(r" (?:OR|AND) ", text) if term]
    if terms and all(term in known for term in terms):
        return _TEXTS.get(text, text)
    classifiers = [one.split(" :: ")[-1] for one in declared.get_all("Classifier") or ()
                   if one.startswith("License ::")]  # fmt: skip
    return " OR ".join(_CLASSIFIERS.get(one, one) for one in classifiers) or text


def is_allowed(expression: str) -> bool:
    """Whether every part of an SPDX expression, or one alternative of it, is allowed."""
    expression = expression.strip()
    if len(alternatives := _split(expression, " OR ")) > 1:
        return any(map(is_allowed, alternatives))
    if len(parts := _split(expression, " AND ")) > 1:
        return all(map(is_allowed, parts))
    if expression.startswith("(") and expression.endswith(")"):
        return is_allowed(expression[1:-1])
    return expression in ALLOWED


def _split(expression: str, word: str) -> list[str]:
    """The parts between `word` outside parentheses."""
    parts, depth, begin = [], 0, 0
    for at, letter in enumerate(expression):
        depth += (letter == "(") - (letter == ")")
        if depth == 0 and expression.startswith(word, at):
            parts.append(expression[begin:at])
            begin = at + len(word)
    return [*parts, expression[begin:]]


def refused() -> Iterator[str]:
    """A line for each locked and installed package whose licence is not allowed."""
    shipped = {one.name for lock in ("lock", "build") for one in locked(lock)}
    for name, version in {(p.name, p.version) for lock in LOCKS for p in locked(lock)}:
        try:
            licence = licence_of(name)
        except metadata.PackageNotFoundError:
            yield f"{name} {version}: is not installed"
            continue
        if name not in shipped and TEST_TOOLS.get(name) == licence:
            continue
        if not is_allowed(licence):
            yield f"{name} {version}: found licence {licence!r}, expected one of the allowed"


def main() -> int:
    """Print every package and what is refused."""
    for lock in LOCKS:
        for one in locked(lock):
            print(f"{lock:5} {one.name} {one.version}: {licence_of(one.name)}")
    found = sorted(refused())
    print("\n".join(found), file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
