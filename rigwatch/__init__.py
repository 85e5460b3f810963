"""Watches a test rig against a model of it and tells its people what the model is missing."""

__version__ = "0.1.0"
