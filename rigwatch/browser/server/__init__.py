"""The web server: access control, routes and responses."""

from rigwatch.browser.server.serving import Listening, Options, serve, serve_fleet

__all__ = ["Listening", "Options", "serve", "serve_fleet"]
