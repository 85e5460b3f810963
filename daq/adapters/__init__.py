"""Adapters: the devices that samples are read from, found by name through entry points."""

from daq.adapters.registry import adapter_for, known

__all__ = ["adapter_for", "known"]
