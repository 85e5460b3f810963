"""The web server: access control, routes and responses."""

from rigwatch.browser.server.serving import Options, serve

__all__ = ["Options", "serve"]
