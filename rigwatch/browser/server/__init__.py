"""The pages' server: who may ask, what is where, and the answers."""

from rigwatch.browser.server.serving import Options, serve

__all__ = ["Options", "serve"]
