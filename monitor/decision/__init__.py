"""Per-sample decision: estimates, departure from healthy behaviour, isolation, verdict.

sample_kernel ──▶ estimates ──▶ departure ──▶ episode ──▶ isolation ──▶ isolation_verdict
"""

from monitor.decision import kernel_state
from monitor.decision.decision_rules import rules_for
from monitor.decision.sample_kernel import watch_block

__all__ = ["kernel_state", "rules_for", "watch_block"]
