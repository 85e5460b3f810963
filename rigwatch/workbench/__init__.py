"""The workbench: compare a model with recordings, locate its errors, add missing effects.

study = open_study("emps")
print(compare(study).held_out_error)
print(explain(study).verdict)
add(study, "coulomb")
"""
