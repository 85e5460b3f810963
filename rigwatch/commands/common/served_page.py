"""What a command says of the page that it serves."""

import argparse
import json
import webbrowser


def tell_address(arguments: argparse.Namespace, address: str, shows: str) -> None:
    """Print the page's address and what it shows, and open it if `--open` is given."""
    told = f"open in a browser, to see {shows}: {address}"
    print(json.dumps({"address": address}) if arguments.json else told, flush=True)
    if arguments.open:
        webbrowser.open(address)
