"""The part of the residuals that neither past samples nor uncertain figures explain.

An error θ of the figures and of the first state moves all residuals together, so they are not
independent. An extended Kalman filter without system noise estimates θ sample by sample and leaves
independent innovations (R. E. Kalman, 1960; S. F. Schmidt, 1966). It is linearised about its own
estimate, not about the undamaged model's run: a nonlinear structure far from that run answers to θ
otherwise.

The covariance P = S·Sᵀ is kept as its factor S. With the slopes H of the scaled signals, B = H·S,

    L·Lᵀ = I + B·Bᵀ,   innovation = L⁻¹·(observed − predicted),   S ← S·(I + BᵀB)^(−1/2)
"""

import numpy as np

from rigwatch.structures.damage.spring_model import FINER, SpringModel
from rigwatch.wire.arrays import FloatArray

LARGEST = 1e3
"""Largest innovation [standard deviations]; also that of a run that has diverged."""


class Innovations:
    """The innovations of a model with uncertain figures, one sample at a time.

    Args:
        model: structure; its own record is not used.
        parameters: estimated, shape (n_p,).
        state: estimated at the first sample, shape (n,).
        spread: covariance of the springs' coefficients and that state, shape (c + n, c + n).
        sigma: standard deviation of each signal's noise, shape (m,).
    """

    def __init__(
        self,
        model: SpringModel,
        parameters: FloatArray,
        state: FloatArray,
        spread: FloatArray,
        sigma: FloatArray,
    ) -> None:
        self._problem, self._sigma = model.problem, sigma
        self._parameters, self._state = parameters.copy(), state.copy()
        names = list(model.problem.system.parameters)
        self._places = [names.index(name) for name in model.candidates]
        self._factor = _factor(spread)

    def update(
        self, inputs: FloatArray, dt: float, row: int, observed: FloatArray, *, learnt: bool
    ) -> FloatArray:
        """Innovations (m,) of signals (m,), NaN where missing; standard deviation 1 if only noise.

        Args:
            inputs: of the record, shape (samples, inputs).
            dt: time between samples [s].
            row: number of the sample.
            observed: signals at the sample, shape (m,).
            learnt: whether the estimates come from this sample too: it adds no information.
        """
        count, sweeper = len(self._sigma), self._problem.sweeper
        outputs, slopes = sweeper.observe(inputs, dt, row, self._state, self._parameters)
        error = (observed - outputs[:count]) / self._sigma
        seen = np.isfinite(observed)
        if learnt or not seen.any():
            return np.asarray(error)
        along = (slopes[:count] / self._sigma[:, None])[seen] @ self._factor
        root = np.linalg.cholesky(np.eye(len(along)) + along @ along.T)
        new = np.linalg.solve(root, error[seen])
        found = np.full(count, np.nan)
        found[seen] = np.clip(np.nan_to_num(new, nan=LARGEST), -LARGEST, LARGEST)
        if np.isfinite(new).all():
            self._correct(along, np.linalg.solve(root.T, new))
        return found

    def advance(self, inputs: FloatArray, dt: float, row: int) -> None:
        """Move from sample `row` to the next; arguments as of `update`."""
        problem, free = self._problem, len(self._places)
        step = problem.sweeper.forward(
            inputs, dt, row, FINER * problem.substeps, self._state, self._parameters
        )
        self._factor[free:] = step @ self._factor

    def along(self, model: SpringModel, first: int, last: int, learnt: int) -> FloatArray:
        """Innovations of a record's samples from `first` to before `last`, shape (samples, m).

        Args:
            model: the structure with its record; the estimated state is that at `first`.
            first, last: the range [samples].
            learnt: sample before which the record was used for the estimates.
        """
        inputs, found = model.problem.recording.inputs, np.empty((last - first, len(self._sigma)))
        for index, row in enumerate(range(first, last)):
            if index:
                self.advance(inputs, model.dt, row - 1)
            seen = model.observed[row]
            found[index] = self.update(inputs, model.dt, row, seen, learnt=row < learnt)
        return found

    def _correct(self, along: FloatArray, weighed: FloatArray) -> None:
        """Take in one sample: H·S of what was seen, and (I + B·Bᵀ)⁻¹ times its errors."""
        moved, free = self._factor @ (along.T @ weighed), len(self._places)
        self._parameters[self._places] += moved[:free]
        self._state += moved[free:]
        root = np.linalg.cholesky(np.eye(along.shape[1]) + along.T @ along)
        self._factor = np.linalg.solve(root, self._factor.T).T


def _factor(spread: FloatArray) -> FloatArray:
    """S of a covariance S·Sᵀ, one column for each uncertain direction."""
    size = np.sqrt(np.diag(spread))
    used = np.flatnonzero(size > 0)
    # In units of their standard deviations: stiffnesses and positions differ by many orders.
    cosines = spread[np.ix_(used, used)] / np.outer(size[used], size[used])
    values, vectors = np.linalg.eigh(cosines)
    factor = np.zeros((len(spread), len(used)))
    factor[used] = size[used, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    return factor
