"""`rigwatch structure`: identification and damage of structures from their motion."""

HELP = "identify structures from their motion, and find damage in them"
EXAMPLE = """\
  rigwatch structure simulate configs/structures/kabe_antenna.toml antenna.csv
  rigwatch structure identify configs/structures/kabe_antenna.toml antenna.csv
  rigwatch structure compare configs/structures/kabe_antenna.toml antenna.csv --report antenna.html
  rigwatch structure damage configs/structures/kabe_antenna.toml antenna.csv --save antenna.rrd
  rigwatch structure watch configs/structures/kabe_antenna.toml rig.toml
  rigwatch structure modes configs/structures/kabe_antenna.toml --svg antenna.svg"""

ACTIONS = {
    "simulate": "structures.structure_simulate",
    "identify": "structures.structure_identify",
    "compare": "structures.structure_compare",
    "damage": "structures.structure_damage",
    "modes": "structures.structure_modes",
    "watch": "structures.structure_watch",
}
