"""Corrects the residual for what is learnt of its inputs: edges between samples, and lateness.

They are learnt in a healthy rig only; while they change, the rig is not armed.
"""

import numpy as np

from monitor.drives import corrected, edges_unsure, follow_edges, follow_instants
from monitor.observer.decision.decision_state import (
    ABOVE,
    CHANGED,
    KNOWN_AGO,
    LASTED,
    LONG,
    MEDIUM,
    ONSET,
    READ,
    USUAL_MEDIUM,
    WAS_JUDGING,
    DecisionRules,
    DecisionState,
)
from monitor.observer.decision.deviation import healthy_variance, late_variance
from monitor.observer.decision.window_statistics import mean_square
from monitor.observer.lateness import (
    TAU,
    compare_motion,
    follow_lateness,
    forget_lateness,
    is_constant,
    is_late,
    lateness_changes,
    seems_to_grow,
    slides,
)
from monitor.observer.missing_force import JITTERS, LATE_UNIT, MOVED, UNSURE_INPUT, E
from monitor.signals import fill
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part


@part()
def follow_inputs(
    kept: DecisionState, row: FloatArray, usual: FloatArray, altered: float, rules: DecisionRules
) -> None:
    """Learn the inputs' edges and lateness, except in an episode, and correct the residual.

    While they change, the rig is not armed.
    """
    count = kept.counts
    judging = count[WAS_JUDGING] == 1
    calm, constant = count[ONSET] < 0, is_constant(kept.lateness)
    largest = min(rules.medium / rules.lasting, usual[USUAL_MEDIUM])
    healthy = healthy_variance(kept, rules) if calm or not judging else 0.0
    variance = healthy + late_variance(kept) + mean_square(kept, READ, MEDIUM)
    if calm and follow_edges(row[E], row[MOVED], row[UNSURE_INPUT], largest * variance, kept.edges):
        forget_lateness(kept.lateness)
        count[CHANGED] = 0
    row[E] = corrected(row[E], row[MOVED], kept.edges)
    if not judging or (calm and count[ABOVE] == 0):
        unsure, jitters = row[UNSURE_INPUT], row[JITTERS] > 0.0
        late = kept.lateness[TAU] * row[LATE_UNIT] if constant else 0.0
        follow_instants(row[E] - late, unsure, jitters, healthy, judging, kept.instants)
    count[KNOWN_AGO] = 0 if np.isinf(usual[USUAL_MEDIUM]) else count[KNOWN_AGO] + 1
    anew = 0 < count[KNOWN_AGO] <= LONG
    moves = is_late(kept.lateness) or slides(kept.lateness)
    learns = not judging or (calm and (count[ABOVE] == 0 or moves))
    if learns or (calm and anew):
        variance += edges_unsure(row[UNSURE_INPUT], kept.edges)
        follow_lateness(row, largest * variance, healthy, judging, learns, anew, kept.lateness)
    compare_motion(altered, judging and calm, kept.lateness)
    if is_constant(kept.lateness) != constant:
        # What edges left, and what lasted, was judged beside another lateness.
        fill(kept.instants, 0.0)
        count[LASTED] = 0
    if not judging and lateness_changes(kept.lateness):
        count[CHANGED] = -LONG
    elif not judging and seems_to_grow(kept.lateness):
        count[CHANGED] = 0
