"""`rigwatch keys`: the authority of a rig and its certificates."""

HELP = "create, issue, revoke and show the certificates of a rig's processes and operators"
EXAMPLE = """\
  rigwatch keys new keys --rig bench1 --address 192.168.1.5
  rigwatch keys issue keys ann --role operator
  rigwatch keys revoke keys ann
  rigwatch keys show keys"""

ACTIONS = {
    "new": "keys.keys_new",
    "issue": "keys.keys_issue",
    "revoke": "keys.keys_revoke",
    "show": "keys.keys_show",
}
