"""Who may speak on a rig's bus: certificates, roles, and signed commands.

register        the certificates that a rig's authority has issued or revoked
validity        which of them end soon
certificates    mutual TLS of a process; the operator of a machine
access_list     topics allowed for each role, enforced by the router
signing         Signer: an operator signs a command ─▶ proof (`statement`)
verifying       Verifier: monitor and witness check it against authority and register
account_proof   the same without keys, with a secret of the account (`account_secret`)
proving         which of the two a rig uses
"""

from rigwatch.wire.access.access_list import access_settings, alarm_roles
from rigwatch.wire.access.certificates import (
    certificate_name,
    check_exposure,
    operator_name,
    tls_settings,
)
from rigwatch.wire.access.proving import (
    CommandSigner,
    CommandVerifier,
    signer_of,
    verifier_of,
)
from rigwatch.wire.access.register import (
    REGISTER,
    ROLES,
    Issued,
    Register,
    authority_file,
    key_files,
    read_register,
)
from rigwatch.wire.access.signing import Signer
from rigwatch.wire.access.statement import names_a_person
from rigwatch.wire.access.validity import (
    days_left,
    ending_soon,
    endings_text,
    ends_text,
    in_force,
    keys_trouble,
)
from rigwatch.wire.access.verifying import Verifier

__all__ = [
    "REGISTER",
    "ROLES",
    "CommandSigner",
    "CommandVerifier",
    "Issued",
    "Register",
    "Signer",
    "Verifier",
    "access_settings",
    "alarm_roles",
    "authority_file",
    "certificate_name",
    "check_exposure",
    "days_left",
    "ending_soon",
    "endings_text",
    "ends_text",
    "in_force",
    "key_files",
    "keys_trouble",
    "names_a_person",
    "operator_name",
    "read_register",
    "signer_of",
    "tls_settings",
    "verifier_of",
]
