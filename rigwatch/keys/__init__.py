"""The authority of a rig and the certificates of its processes and people.

A folder of keys holds the authority, a register of issued certificates, and a certificate with its
private key for each name. A machine needs only the authority's certificate and its own names.
"""

from rigwatch.keys.authority import Authority

__all__ = ["Authority"]
