"""`rigwatch workbench`: the studies of a folder in a browser."""

import argparse
from pathlib import Path

from rigwatch.commands.common import PORT, say, tell_address, whole

HELP = "open the studies of a folder in a browser: compare, explain, add, undo"
EXAMPLE = """\
  rigwatch workbench studies/
  rigwatch workbench studies/ --rig configs/story.toml
  rigwatch workbench studies/ --address 0.0.0.0 --certificate rig.pem --key rig.key"""
OWN_FOLDER = Path("workbench")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "folder", type=Path, nargs="?", help="folder of studies and recordings, default ./workbench"
    )
    parser.add_argument("--rig", type=Path, metavar="CONFIG", help="configuration of a rig to show")
    parser.add_argument(
        "--port", type=PORT, default=0, help="port to listen on; default: a free one"
    )
    parser.add_argument("--address", default="127.0.0.1", help="address to listen on")
    parser.add_argument("--certificate", type=Path, metavar="PEM", help="certificate for TLS")
    parser.add_argument("--key", type=Path, metavar="PEM", help="private key of the certificate")
    parser.add_argument(
        "--behind-proxy",
        action="append",
        default=[],
        metavar="NAME",
        help="host name of a reverse proxy in front of it that terminates TLS",
    )
    parser.add_argument(
        "--most-upload", type=whole(1), default=1024, metavar="MB", help="largest upload"
    )
    parser.add_argument("--open", action="store_true", help="open it in this machine's browser")


def run(arguments: argparse.Namespace) -> int:
    """0 when it was ended."""
    from rigwatch.wire.errors import MissingExtraError

    try:
        from rigwatch.browser.server import Options, serve
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            error.name or "starlette", "workbench", "the workbench in a browser"
        ) from None

    folder = arguments.folder or OWN_FOLDER
    if arguments.folder is None:
        folder.mkdir(exist_ok=True)

    def ready(address: str) -> None:
        rig = f"the rig of {arguments.rig} and " if arguments.rig else ""
        tell_address(arguments, address, f"{rig}the studies of {folder}")
        if not arguments.json:
            say("Ctrl-C ends")

    serve(
        Options(
            arguments.address, arguments.port, arguments.certificate, arguments.key,
            tuple(arguments.behind_proxy), folder=folder, rig=arguments.rig,
            most_upload=arguments.most_upload << 20,
        ),
        ready,
    )  # fmt: skip
    return 0
