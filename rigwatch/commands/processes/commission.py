"""`rigwatch commission`: makes a model file from recordings."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import POSITIVE, print_json, say, whole

if TYPE_CHECKING:
    from monitor.model import RigModel
    from monitor.signals import Recording, Role

HELP = "make a model file from commissioning recordings"
EXAMPLE = (
    "  rigwatch commission --chirp sessions/chirp --healthy sessions/healthy "
    "--friction sessions/known-friction --output configs/bench1-model.toml"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    roles = (
        ("chirp", "chirp or multisine without friction"),
        ("healthy", "healthy reference under a running excitation, may be given several times"),
        (
            "friction",
            "a healthy beginning, then a known friction fault, may be given several times",
        ),
    )
    for role, text in roles:
        parser.add_argument(
            f"--{role}", type=Path, action="append", default=[], metavar="SESSION", help=text
        )
    parser.add_argument("--output", type=Path, default=Path("model.toml"), help="the model file")
    parser.add_argument(
        "--plant",
        choices=("transfer-function", "inertia"),
        default="transfer-function",
        help="inertia: force and position only, M q'' = force + offset, from one --healthy",
    )
    parser.add_argument(
        "--scheme",
        choices=("auto", "transfer", "equations"),
        default="auto",
        help="what the rig is watched by: a transfer function and its healthy average, equations "
        "along the measured motion (no --friction needed), or whichever describes the healthy rig",
    )
    parser.add_argument(
        "--equations",
        default="servo-pneumatic",
        metavar="MODEL",
        help="name of a shipped model or a model file, for --scheme equations and auto",
    )
    parser.add_argument(
        "--band", type=POSITIVE, nargs=2, default=(1.0, 14.0), metavar=("LOW", "HIGH"),
        help="frequency range of the transfer function's fit [Hz]",
    )  # fmt: skip
    parser.add_argument("--window", type=whole(1), help="window of the estimates [samples]")
    parser.add_argument("--hop", type=whole(1), default=1, help="samples between estimates")


def run(arguments: argparse.Namespace) -> int:
    """0 if the model file is written."""
    recordings = _recordings(arguments)
    from monitor.commissioning import CommissionSettings, commission_best
    from monitor.model import model_text
    from monitor.signals import commission_inertia
    from rigwatch.wire.errors import ModelError
    from rigwatch.wire.new_file import write_new

    if arguments.plant == "inertia":
        model = commission_inertia(recordings, window=arguments.window, hop=arguments.hop)
    else:
        settings = CommissionSettings(
            band=tuple(arguments.band), window=arguments.window or 32, hop=arguments.hop
        )
        model = commission_best(recordings, settings, arguments.scheme, arguments.equations, say)
    write_new(arguments.output, model_text(model), replace=True, raises=ModelError)
    if arguments.json:
        print_json(_summary(model, arguments.output))
    else:
        print(
            "\n".join(f"{key}: {value}" for key, value in _summary(model, arguments.output).items())
        )
    return 0


def _recordings(arguments: argparse.Namespace) -> "list[Recording]":
    from rigwatch.wire.errors import ModelError

    if not arguments.healthy:
        raise ModelError("--healthy: found no recording, expected at least one")
    roles: tuple[Role, ...] = ("chirp", "healthy", "friction")
    return [_read(role, path) for role in roles for path in getattr(arguments, role)]


def _read(role: "Role", path: Path) -> "Recording":
    from monitor.signals import joined
    from rigwatch.wire.session import open_session

    say(f"reading {path} ({role})")
    session = open_session(path)
    return joined(role, path.name, session.samples(), session.info.sample_rate_hz)


def _summary(model: "RigModel", output: Path) -> dict[str, Any]:
    why = {"scheme": model.scheme.why} if model.scheme and model.scheme.why else {}
    return {
        "model": str(output),
        "plant": type(model.plant).__struct_config__.tag,
        **why,
        "signature": list(model.signature),
        "friction_explained": model.friction.explained,
        "residual_noise": model.noise.residual,
        "settle_samples": model.decision.settle,
        "references": len(model.reference),
    }
