"""The observer's decision, sample by sample: whether the rig departs, and what the fault is.

residual ─▶ inputs ─▶ deviation ─▶ naming ─▶ outputs
           (edges,    (from        (episode,
            lateness)  healthy)     verdict)
"""

from monitor.observer.decision.deviation import friction_limit
from monitor.observer.decision.per_sample import decide

__all__ = ["decide", "friction_limit"]
