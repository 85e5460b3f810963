"""`rigwatch commission`: makes a model file from recordings."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import POSITIVE, named_values, print_result, say, whole
from rigwatch.commands.processes.model_place import check_place, install_model

if TYPE_CHECKING:
    from monitor.model import RigModel
    from monitor.signals import Recording, Role
    from rigwatch.wire.wiring_names import Wiring

TRANSFER_S, EQUATIONS_S = (3.0, 3.0), (10.0, 65.0)
"""Time of commissioning: at least, and more for each 100 000 samples [s]."""
HELP = "create the monitor's model file from commissioning recordings"
EXAMPLE = (
    "  rigwatch commission --chirp sessions/chirp --healthy sessions/healthy "
    "--friction sessions/known-friction --output configs/bench1-model.toml\n"
    "  rigwatch commission --healthy sessions/sine --scheme equations --set m=0.31 "
    "--output configs/bench1-model.toml"
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
    parser.add_argument(
        "--output", type=Path, default=Path("model.toml"), help="the model file, default model.toml"
    )
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
        help="how the rig is monitored: by a transfer function and its healthy average, equations "
        "along the measured motion (no --friction needed), or by whichever describes it",
    )
    parser.add_argument(
        "--equations",
        default="servo-pneumatic",
        metavar="MODEL",
        help="name of a shipped model or a model file, for --scheme equations and auto",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter of the equations that you know, in its unit or one in brackets such as "
        "m=310[g]: the moving mass that you have weighed, to which forces are in proportion",
    )
    parser.add_argument(
        "--any-wiring",
        action="store_true",
        help="commission although position and acceleration do not show one motion",
    )
    parser.add_argument(
        "--band", type=POSITIVE, nargs=2, default=(1.0, 14.0), metavar=("LOW", "HIGH"),
        help="frequency range of the transfer function's fit [Hz], default 1 14",
    )  # fmt: skip
    parser.add_argument(
        "--window",
        type=whole(1),
        help="window of the estimates [samples], default 32, for inertia 6 s",
    )
    parser.add_argument(
        "--hop", type=whole(1), default=1, help="samples between estimates, default 1"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if the model file is written."""
    check_place(arguments.output)
    stated = _stated(arguments)
    recordings = _recordings(arguments)
    accepted = _accepted_wiring(arguments, recordings)
    from msgspec import structs

    from monitor.commissioning import CommissionSettings, commission_best
    from monitor.signals import commission_inertia

    if arguments.plant == "inertia":
        model = commission_inertia(
            recordings[:1] if len(arguments.healthy) == 1 else recordings,
            window=arguments.window,
            hop=arguments.hop,
        )
    else:
        _say_how_long(recordings, arguments.scheme)
        settings = CommissionSettings(
            band=tuple(arguments.band), window=arguments.window or 32, hop=arguments.hop
        )
        model = commission_best(
            recordings, settings, arguments.scheme, arguments.equations, say, stated=stated
        )
    model = structs.replace(model, accepted_wiring=accepted)
    kept = install_model(arguments.output, model)
    if kept:
        say(f"the model before is {kept}")
    summary = _summary(model, arguments.output)
    print_result(arguments, summary, (f"{key}: {value}" for key, value in summary.items()))
    return 0


def _stated(arguments: argparse.Namespace) -> dict[str, float]:
    """The values of `--set`, in SI.

    Raises:
        ModelError: one is not NAME=VALUE, no parameter of the equations, or out of its bounds.
    """
    from monitor.commissioning import stated_in_si, units_of_parameters
    from rigwatch.wire.errors import ModelError

    if not arguments.set:
        return {}
    if arguments.scheme == "transfer" or arguments.plant == "inertia":
        raise ModelError("--set: found no model of equations, expected --scheme equations or auto")
    units = units_of_parameters(arguments.equations)
    stated = named_values("--set", arguments.set, "m=0.31", units)
    return stated_in_si(arguments.equations, stated)


def _recordings(arguments: argparse.Namespace) -> "list[Recording]":
    from rigwatch.wire.errors import ModelError

    if not arguments.healthy:
        raise ModelError("--healthy: found no recording, expected at least one")
    needed = _needed(arguments)
    roles: tuple[Role, ...] = ("chirp", "healthy", "friction")
    return [
        one
        for role in roles
        for path in getattr(arguments, role)
        for one in _read(role, path, needed)
    ]


def _needed(arguments: argparse.Namespace) -> set[str]:
    """The channels that the model will read."""
    from monitor.commissioning import channels_of
    from monitor.signals import INERTIA_CHANNELS

    if arguments.plant == "inertia":
        return set(INERTIA_CHANNELS)
    return channels_of(arguments.scheme, arguments.equations)


def _read(role: "Role", path: Path, needed: set[str]) -> "list[Recording]":
    from monitor.signals import recorded
    from rigwatch.wire.session import open_session

    say(f"reading {path} ({role})")
    session = open_session(path)
    rate = session.info.sample_rate_hz
    return recorded(role, path.name, session.samples(), rate, needed=needed, say=say)


def _accepted_wiring(
    arguments: argparse.Namespace, recordings: "list[Recording]"
) -> "tuple[Wiring, ...]":
    """What is wired wrongly and taken for right, as a monitor is to take it too.

    Raises:
        ModelError: something is, and nobody has said that it may be.
    """
    from monitor.wiring import recorded_wiring
    from rigwatch.wire.errors import ModelError

    found = list(filter(None, map(recorded_wiring, recordings)))
    if found and not arguments.any_wiring:
        raise ModelError(f"{found[0][1]}; --any-wiring commissions it all the same")
    for _, text in found:
        say(text)
    return tuple(dict.fromkeys(name for name, _ in found))


def _say_how_long(recordings: "list[Recording]", scheme: str) -> None:
    """A rough time, from a machine of 2024; the first run also compiles kernels."""
    lengths = [(len(next(iter(one.channels.values()))), one.sample_rate) for one in recordings]
    seconds, samples = sum(n / rate for n, rate in lengths), sum(n for n, _ in lengths)
    work = TRANSFER_S if scheme == "transfer" else EQUATIONS_S
    rough = float(f"{work[0] + work[1] * samples / 1e5:.1g}")
    say(f"{seconds:.0f} s of recordings: this takes about {rough:g} s, more on a busy machine")


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
