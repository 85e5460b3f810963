"""The option by which commands that change a rig name who acts."""

import argparse


def add_user(parser: argparse.ArgumentParser) -> None:
    """`user`, empty for the default that `operator_name` finds."""
    parser.add_argument(
        "--user",
        default="",
        help="who acts; default: the operator of the certificate, or without keys the login name",
    )
