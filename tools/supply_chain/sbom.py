"""Writes the software bill of materials (CycloneDX 1.6, JSON) of what rigwatch installs and ships.

    python -m tools.supply_chain.sbom OUT.json

Packages, versions and hashes are those of requirements/lock.txt, so the same lock gives the same
bytes.
"""

import json
import sys
import tomllib
import uuid
from importlib import metadata
from pathlib import Path
from typing import Any

from tools.supply_chain.licences import ALLOWED, ROOT, Locked, licence_of, locked

UPLOT = ROOT / "rigwatch" / "browser" / "server" / "static" / "vendor" / "uPlot.js"
_NAMESPACE = uuid.UUID("6f0d7c2e-6d0f-5d0e-9f43-0c1f3b6a9a11")


def bill() -> dict[str, Any]:
    """The document."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    packages = locked("lock")
    components = [_component(one) for one in packages]
    own = f"pkg:pypi/{project['name']}@{project['version']}"
    document: dict[str, Any] = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application",
                "bom-ref": own,
                "name": project["name"],
                "version": project["version"],
                "purl": own,
                "licenses": [{"license": {"id": project["license"]}}],
            }
        },
        "components": [*components, _uplot()],
        "dependencies": _dependencies(own, packages),
    }
    text = json.dumps(document, sort_keys=True)
    return {"serialNumber": f"urn:uuid:{uuid.uuid5(_NAMESPACE, text)}", **document}


def _component(one: Locked) -> dict[str, Any]:
    purl = _purl(one)
    return {
        "type": "library",
        "bom-ref": purl,
        "name": one.name,
        "version": one.version,
        "purl": purl,
        "licenses": _licences(licence_of(one.name)),
        # A package has a file for each platform: each may be the one installed.
        "externalReferences": [
            {
                "type": "distribution",
                "url": f"https://pypi.org/project/{one.name}/{one.version}/",
                "hashes": [{"alg": "SHA-256", "content": digest} for digest in one.hashes],
            }
        ],
    }


def _licences(expression: str) -> list[dict[str, Any]]:
    if " " in expression:
        return [{"expression": expression}]
    # "BSD" is what old packages declare, without saying which of the BSD licences.
    known = expression in ALLOWED and expression != "BSD"
    return [{"license": {"id" if known else "name": expression}}]


def _purl(one: Locked) -> str:
    return f"pkg:pypi/{one.name.lower().replace('_', '-')}@{one.version}"


def _uplot() -> dict[str, Any]:
    version = UPLOT.read_text(encoding="utf-8").partition("(v")[2].partition(")")[0]
    purl = f"pkg:npm/uplot@{version}" if version else "pkg:npm/uplot"
    return {
        "type": "library",
        "bom-ref": purl,
        "name": "uPlot",
        "version": version,
        "purl": purl,
        "licenses": [{"license": {"id": "MIT"}}],
    }


def _dependencies(own: str, packages: list[Locked]) -> list[dict[str, Any]]:
    """What each package requires of the others, as they declare it."""
    refs = {one.name.lower().replace("_", "-"): _purl(one) for one in packages}
    found = [{"ref": own, "dependsOn": sorted(refs.values())}]
    for one in packages:
        required = metadata.requires(one.name) or []
        names = {_name(text) for text in required if "extra ==" not in text}
        found.append({
            "ref": _purl(one), "dependsOn": sorted(refs[name] for name in names if name in refs)
        })  # fmt: skip
    return found


def _name(requirement: str) -> str:
    head = requirement
    for mark in "<>=!~;[( ":
        head = head.partition(mark)[0]
    return head.lower().replace("_", "-")


def main(arguments: list[str]) -> int:
    """Write the bill to the file named."""
    if len(arguments) != 1:
        print("sbom: expected the file to write", file=sys.stderr)
        return 2
    path = Path(arguments[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(bill(), indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
