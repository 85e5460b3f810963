"""What a command says of the page that it serves."""

import argparse
import json
import webbrowser


def tell_address(arguments: argparse.Namespace, address: str, label: str = "") -> None:
    """Print the page's address, after a label, and open it if `--open` is given."""
    print(json.dumps({"address": address}) if arguments.json else f"{label}{address}", flush=True)
    if arguments.open:
        webbrowser.open(address)
