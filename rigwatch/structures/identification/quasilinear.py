"""Quasilinearization as published (R. Bellman; thesis 4.3), for any model of the engine.

    X⁽ⁿ⁾(t) = P⁽ⁿ⁾(t) + Σ γi·H_i⁽ⁿ⁾(t),   D·γ = b                                    (4.10), (4.17)

The equations are linearised about a nominal trajectory, which is the observed record itself: only
the parameters change from one iteration to the next. The integration step is the record's, as in
1999; `integrators` lists the methods, and names the thesis's. States that a record of positions
does not show are filled in:

* velocities of observed positions are their local slopes (they matter only if forces are
  nonlinear in velocity);
* states of unobserved nodes come from a simulation at the guess, then from the linear solution of
  the previous iteration.
"""

import numpy as np

from rigwatch.structures.identification.identify import Outcome, settled
from rigwatch.structures.identification.integrators import Integrator
from rigwatch.structures.identification.integrators import integrator as integrator_of
from rigwatch.structures.identification.least_squares import Step, require_determined
from rigwatch.structures.identification.least_squares import solve as least_squares
from rigwatch.structures.identification.problem import Problem, require_fine_enough
from rigwatch.structures.identification.sweep import Swept
from rigwatch.wire.arrays import FloatArray

STABLE = 2.78
"""Stability limit of the classical Runge-Kutta method [rad per step]."""
BLOWN_UP = 1e60
"""Bound that the sensitivities of a stable linear solution never reach."""
UNOBSERVED = (
    "unobserved states follow the model from the initial guess, not the record",
    "they are replaced by the linear solution of each iteration",
)


def solve(
    problem: Problem,
    *,
    iterations: int = 25,
    scale: FloatArray | None = None,
    integrator: str = "dormand-prince",
) -> Outcome:
    """Iterate until four digits are stable.

    Args:
        problem: the identification problem.
        iterations: largest number of iterations.
        scale: standard deviation of each output's noise; equal if None, as published.
        integrator: dormand-prince, the thesis's, or runge-kutta.

    Raises:
        ModelError: no such integrator, the step is too coarse, or the record does not
            determine the unknowns.
    """
    require_fine_enough(problem, problem.speed.whole, STABLE, "its Runge-Kutta step is stable")
    follower = _Nominal(problem, integrator_of(integrator))
    wanted = np.ones(problem.observed.shape[1]) if scale is None else scale
    found, step = [problem.guess], None
    name = problem.system.model.name
    for turn in range(iterations):
        swept = follower.sweep(found[-1])
        if not np.abs(swept.slopes).max() < BLOWN_UP:
            return Outcome(found[1:] or found, None, False, ("the linear solution blew up",))
        step = least_squares(problem.observed - swept.outputs, swept.slopes, problem.weight, wanted)
        if not turn:
            require_determined(problem.names, step.blind, name)
        found.append(found[-1] + step.change)
        follower.learn(swept, step.change)
        if not np.isfinite(found[-1]).all() or (turn and settled(found[-2], found[-1])):
            break
    if step is not None and settled(found[-2], found[-1]):
        require_determined(problem.names, step.blind, name)
    return _outcome(found, step, follower.remarks)


def _outcome(found: list[FloatArray], step: Step | None, remarks: tuple[str, ...]) -> Outcome:
    finite = bool(np.isfinite(found[-1]).all())
    covariance = step.covariance if step is not None and finite else None
    return Outcome(found[1:], covariance, finite and settled(found[-2], found[-1]), remarks)


class _Nominal:
    """The nominal trajectory: the record, for the states that it shows."""

    def __init__(self, problem: Problem, method: Integrator) -> None:
        self._problem, self._method = problem, method
        shown = problem.shown[problem.first :]
        self._hidden = problem.hidden
        self._states = shown.copy()
        self.remarks: tuple[str, ...] = ()
        if self._hidden.any():
            self._states[:, self._hidden] = self._simulated()[:, self._hidden]
            self.remarks = UNOBSERVED

    def sweep(self, unknowns: FloatArray) -> Swept:
        """P and H about the nominal trajectory, with the parameters of the last iteration."""
        problem = self._problem
        parameters, initial = problem.split(unknowns)
        return problem.sweeper.sweep(
            problem.inputs, problem.recording.dt, problem.first, self._states, parameters, initial,
            problem.loose, self._method,
        )  # fmt: skip

    def learn(self, swept: Swept, change: FloatArray) -> None:
        """Use the linear solution for the states that the record does not show."""
        if self._hidden.any():
            solution = swept.states + swept.state_slopes @ change
            self._states[:, self._hidden] = solution[:, self._hidden]

    def _simulated(self) -> FloatArray:
        """All states simulated at the guess, shape (samples, n)."""
        problem, states = self._problem, np.empty_like(self._states)
        parameters, x = problem.split(problem.guess)
        for row in range(len(states)):
            states[row] = x
            if row + 1 < len(states):
                problem.sweeper.forward(
                    problem.recording.inputs, problem.recording.dt, problem.first + row,
                    problem.substeps, x, parameters,
                )  # fmt: skip
        return states
