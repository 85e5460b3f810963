"""What is shipped: allowed licences, a bill of materials, the same wheel from the same sources."""

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tools.supply_chain.licences import is_allowed, licence_of, locked, refused
from tools.supply_chain.sbom import bill

ROOT = Path(__file__).parents[2]
BUILD = "import sys; from hatchling.build import build_wheel; print(build_wheel(sys.argv[1]))"
SOURCES = ("rigwatch", "daq", "monitor", "sim_plant", "configs")
MOST_EXPOSED = 2.0


def test_every_locked_package_has_an_allowed_licence() -> None:
    assert list(refused()) == []


@pytest.mark.parametrize(
    ("expression", "allowed"),
    [
        ("MIT", True),
        ("MIT OR GPL-3.0-only", True),
        ("MIT AND GPL-3.0-only", False),
        ("GPL-3.0-only", False),
        ("(MIT OR Apache-2.0) AND BSD-3-Clause", True),
        ("(MIT OR Apache-2.0) AND GPL-3.0-only", False),
        ("MIT OR (Apache-2.0 AND GPL-3.0-only)", True),
        ("", False),
        ("MIT No Attribution", False),
    ],
)
def test_an_expression_of_licences_is_understood(expression: str, allowed: bool) -> None:
    assert is_allowed(expression) is allowed


def test_the_bill_of_materials_names_every_locked_package_with_hash_and_licence() -> None:
    made = bill()
    assert (made["bomFormat"], made["specVersion"]) == ("CycloneDX", "1.6")
    assert re.fullmatch(r"urn:uuid:[0-9a-f-]{36}", made["serialNumber"])
    found = {one["name"]: one for one in made["components"]}
    for package in locked("lock"):
        one = found.pop(package.name)
        assert one["version"] == package.version
        assert one["purl"] == one["bom-ref"]
        (distribution,) = one["externalReferences"]
        assert [h["content"] for h in distribution["hashes"]] == list(package.hashes) != []
        (licence,) = one["licenses"]
        said = licence.get("expression") or next(iter(licence["license"].values()))
        assert said == licence_of(package.name)
    assert set(found) == {"uPlot"}
    assert re.fullmatch(r"\d+\.\d+\.\d+", found["uPlot"]["version"])
    refs = {one["bom-ref"] for one in made["components"]} | {made["metadata"]["component"]["purl"]}
    assert {ref for one in made["dependencies"] for ref in (one["ref"], *one["dependsOn"])} <= refs
    assert bill() == made


def build(folder: Path, out: Path, umask: int, zone: str) -> bytes:
    done = subprocess.run(
        [sys.executable, "-c", BUILD, str(out)],
        cwd=folder, umask=umask, env={**os.environ, "TZ": zone, "PYTHONPATH": ""},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return (out / done.stdout.strip().splitlines()[-1]).read_bytes()


def test_two_builds_of_the_same_sources_give_the_same_bytes(tmp_path: Path) -> None:
    copies = []
    for number, zone in enumerate(("UTC", "Asia/Tokyo")):
        copy = tmp_path / f"copy{number}"
        ignored = shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc")
        for name in SOURCES:
            shutil.copytree(ROOT / name, copy / name, ignore=ignored, copy_function=shutil.copy)
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(ROOT / name, copy / name)
        for path in copy.rglob("*"):
            os.utime(path, (time.time() - 86400 * number,) * 2)
        copies.append(build(copy, tmp_path / f"out{number}", (0o022, 0o077)[number], zone))
    assert copies[0] == copies[1]


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="no systemd here")
@pytest.mark.parametrize("name", ["rigwatch.service", "rigwatch@.service"])
def test_the_units_expose_little(tmp_path: Path, name: str) -> None:
    unit = tmp_path / name.replace("@.", "@daq.")
    shutil.copy(ROOT / "docker" / "systemd" / name, unit)
    command = ["systemd-analyze", "security", "--offline=true", "--no-pager", str(unit)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    score = re.search(r"Overall exposure level for \S+: ([0-9.]+)", done.stdout)
    if score is None and "unrecognized option" in done.stderr:
        pytest.skip("this systemd does not judge files")
    assert score, done.stderr
    assert float(score[1]) <= MOST_EXPOSED
