"""`rigwatch model`: files of equations."""

HELP = "list the shipped models, show one, start one of your own, check a file"
EXAMPLE = """\
  rigwatch model list
  rigwatch model show mass-spring-damper
  rigwatch model new my_rig.toml --like mass-spring-damper
  rigwatch model check my_rig.toml --save my_rig.svg"""

ACTIONS = {
    "list": "catalogue.model_list",
    "show": "catalogue.model_show",
    "new": "catalogue.model_new",
    "check": "catalogue.model_check",
}
