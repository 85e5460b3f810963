"""The authority of a rig and the certificates of its processes and people.

A folder of keys holds the authority, a register of what it has issued, and a certificate with its
private key for each name. A machine needs the authority's certificate and its own names only.
"""

from rigwatch.keys.authority import Authority

__all__ = ["Authority"]
