"""`rigwatch study`: a model, recordings, and every step taken with them."""

HELP = "create a study of a model and recordings, show its steps, promote its result"
EXAMPLE = """\
  rigwatch study new emps --template configs/studies/emps.toml --sessions recordings/
  rigwatch study base rubbing
  rigwatch study show emps
  rigwatch study report emps --output emps.html
  rigwatch study view emps --save emps.rrd
  rigwatch study promote emps --rig emps-rig.toml
  rigwatch study replay emps"""

ACTIONS = {
    "new": "workbench.study_new",
    "base": "workbench.study_base",
    "show": "workbench.study_show",
    "report": "workbench.study_report",
    "view": "workbench.study_view",
    "promote": "workbench.study_promote",
    "replay": "workbench.study_replay",
    "accept-data": "workbench.study_accept_data",
}
