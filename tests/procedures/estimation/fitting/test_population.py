"""Samples of posteriors that are known."""

import numpy as np
import pytest

from procedures.estimation.fitting.population import sampled


def box(values):
    return np.where(np.all(np.abs(values) < 10.0, axis=0), 0.0, -np.inf)


def drawn(unknowns):
    return np.random.default_rng(1).uniform(-10.0, 10.0, (unknowns, 1000))


def test_a_narrow_normal_posterior_with_correlation_has_its_mean_and_covariance():
    covariance = np.array([[1e-4, 1.9e-4], [1.9e-4, 4e-4]])
    mean, inverse = np.array([[3.0], [-2.0]]), np.linalg.inv(covariance)

    def likelihood(values):
        away = values - mean
        return -0.5 * np.einsum("in,ij,jn->n", away, inverse, away)

    found = sampled(drawn(2), box, likelihood, np.random.default_rng(2))
    assert found.mean(1) == pytest.approx(mean[:, 0], abs=2e-3)
    assert np.cov(found) == pytest.approx(covariance, rel=0.2)


def test_both_of_two_maxima_are_kept_by_their_weight():
    def likelihood(values):
        near = -0.5 * ((values[0] - 4.0) / 0.05) ** 2
        far = -0.5 * ((values[0] + 4.0) / 0.05) ** 2 + np.log(0.5)
        return np.logaddexp(near, far)

    found = sampled(drawn(1), box, likelihood, np.random.default_rng(3))[0]
    assert np.mean(found > 0.0) == pytest.approx(2.0 / 3.0, abs=0.12)
    assert np.std(found[found > 0.0]) == pytest.approx(0.05, rel=0.15)


def test_what_the_data_do_not_tell_stays_as_it_was_beforehand_and_inside():
    def likelihood(values):
        return -0.5 * (values[0] / 0.01) ** 2

    found = sampled(drawn(2), box, likelihood, np.random.default_rng(4))
    assert np.all(np.abs(found) < 10.0)
    assert np.quantile(found[1], [0.1, 0.5, 0.9]) == pytest.approx([-8.0, 0.0, 8.0], abs=0.9)
