"""The workbench: compare a model with recordings, see where it fails, add what is missing.

study = open_study("emps")
print(compare(study).held_out_error)
print(explain(study).verdict)
add(study, "coulomb")
"""
