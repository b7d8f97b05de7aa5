"""Bins in which errors of a model do alike: what is lost, and that the likelihood is the same."""
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from ssi_ros.hermitian import hermitian, inverse_root, real_vectors, white_vectors
from ssi_ros.updating.merged_bins import (
    BinRuns, LOST, merged, merged_bins, MergedBins, OF_SCORES, runs_beside, white_changes)
from ssi_ros.updating.probable_errors import ErrorLikelihood, most_probable

BINS, CHANNELS, WEIGHT = 600, 2, 8.0
PEAKS = 90.0, 300.0, 305.0, 480.0


@pytest.fixture(scope='module')
def directions():
    """Return changes by a level and by frequencies of four resonances, (5, k l l)."""
    rng = np.random.default_rng(3)
    bins = np.arange(BINS)
    rows = [np.outer(np.ones(BINS), [0.3, 0.0, 0.0, 0.3])]
    for peak in PEAKS:
        line = 3.0 * (bins - peak) / (3.0 ** 2 + (bins - peak) ** 2)
        rows.append(np.outer(line, rng.standard_normal(CHANNELS ** 2)))
    return np.array([r.ravel() for r in rows])


def test_what_is_lost_stays_below_its_limit(directions):
    """In deviations of the errors beside the record, over all errors; most bins are merged."""
    information = WEIGHT * directions @ directions.T
    found = merged_bins(directions, BINS, WEIGHT, information)
    assert found.counts.sum() == BINS and len(found.starts) < BINS / 3
    means = found.vectors.reshape(len(directions), len(found.starts), -1)
    lost = information - WEIGHT * np.einsum('igm,jgm,g->ij', means, means, found.counts)
    covariance = np.linalg.inv(information + np.eye(len(information)))
    assert 0.0 < np.trace(covariance @ lost) < LOST


def test_errors_in_other_directions_have_the_same_bins(directions):
    """Directions of one space are a choice, down to their signs."""
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((5, 5)))[0]
    one, other = (merged_bins(d, BINS, WEIGHT, WEIGHT * d @ d.T)
                  for d in (directions, turn @ directions))
    assert np.array_equal(one.starts, other.starts)


def test_what_a_record_does_not_tell_is_the_same_in_all_bins(directions):
    """A record that is nothing but noise leaves one run."""
    quiet = 1e-6 * directions
    assert len(merged_bins(quiet, BINS, WEIGHT, WEIGHT * quiet @ quiet.T).starts) == 1


def test_the_most_probable_errors_are_those_of_all_bins(directions):
    """To a fraction of their deviations, and so is their likelihood."""
    rng = np.random.default_rng(5)
    shape = BINS, CHANNELS, round(2 * WEIGHT)
    noise = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    record = noise @ noise.conj().swapaxes(-1, -2) / (4 * WEIGHT)
    record += np.einsum('n,nkm->km', [0.5, 0.3, 0.0, -0.4, 0.2],
                        directions.reshape(5, BINS, -1)).reshape(record.shape) * np.eye(CHANNELS)
    excess = real_vectors(record - np.eye(CHANNELS)).reshape(1, -1)
    white = SimpleNamespace(lower=np.zeros((1, BINS, CHANNELS, CHANNELS)), excess=excess,
                            weight=WEIGHT)
    shown = WEIGHT * directions @ directions.T
    every = MergedBins(directions, np.arange(BINS), np.ones(BINS))
    (gain, errors), (merged_gain, merged_errors) = (
        most_probable(ErrorLikelihood(b, np.zeros(5), white), shown + np.eye(5), np.ones(5, bool))
        for b in (every, merged_bins(directions, BINS, WEIGHT, shown)))
    apart = merged_errors - errors
    # the loss is that of a tenth of a deviation squared, noise and the ends of two climbs beside
    assert apart @ (shown + np.eye(5)) @ apart < 2 * LOST
    assert gain > 5.0 and merged_gain == pytest.approx(gain, rel=0.01)


def test_scores_keep_what_a_record_shows(directions):
    """In the mean over effects 0.3 % of their squares are lost, with a third of the bins."""
    found = merged(directions.astype(np.float32), identities())
    edges = found.runs.edges
    assert len(edges) < BINS / 3 and edges[0] == 0 and edges[-1] == BINS
    kept = np.sum(np.square(found.vectors), axis=1) / np.sum(np.square(directions), axis=1)
    assert 1 - kept.mean() < OF_SCORES and kept.max() < 1 + 1e-6


def identities():
    """Return the factors of a white spectrum, (k, l, l)."""
    return np.tile(np.eye(CHANNELS, dtype=np.complex64), (BINS, 1, 1))


def test_another_model_whitens_what_is_merged_as_it_does_every_bin(directions):
    """One whose levels and cross spectra differ smoothly, in runs that resolve it."""
    bins = np.arange(BINS)
    model = np.zeros((BINS, CHANNELS, CHANNELS), complex)
    model[:, 0, 0], model[:, 1, 1] = 2.0, 1 + bins / BINS
    model[:, 1, 0] = 0.5j * np.cos(bins / 200)
    model[:, 0, 1] = model[:, 1, 0].conj()
    lower = inverse_root(model).astype(np.complex64)
    changes = hermitian(directions.reshape(5, BINS, CHANNELS, CHANNELS))
    every = white_changes(changes, identities())
    brief = merged(every.vectors, every.factor)
    runs = runs_beside(brief.runs, model)
    exact = runs.projected(white_vectors(lower, changes.astype(np.complex64)))
    short = brief.by(lower, runs, brief.vectors)
    assert short.shape[1] < BINS * CHANNELS ** 2 / 3
    lost = np.sum(np.square(short - exact), axis=1) / np.sum(np.square(exact), axis=1)
    assert lost.max() < 10 * OF_SCORES
    whole = every.by(lower, every.runs, every.vectors)
    assert whole == pytest.approx(white_vectors(lower, changes), abs=1e-5)


def test_a_delay_of_a_channel_turns_changes_with_their_spectrum(directions):
    """Whitened by the model that is delayed alike, products of changes stay as they were."""
    turn = np.exp(1j * np.linspace(0, 1, BINS))[:, None] ** np.array([0, 1])
    late = turn[:, :, None] * identities()
    every = white_changes(hermitian(directions.reshape(5, BINS, CHANNELS, CHANNELS)),
                          identities())
    found = replace(every, factor=late.astype(np.complex64)).by(
        identities(), every.runs, every.vectors)
    assert found @ found.T == pytest.approx(directions @ directions.T, rel=1e-4, abs=1e-4)
    assert np.abs(found - directions).max() > 0.1


@pytest.mark.slow
def test_projections_are_orthogonal_and_keep_what_is_constant():
    """Products of what is constant in every run stay; so do sums of traces of cubes."""
    rng = np.random.default_rng(8)
    runs = BinRuns(np.array([0, 1, 4, 5, 12]))
    levels = rng.standard_normal((3, 4, CHANNELS ** 2))
    whole = np.repeat(levels, np.diff(runs.edges), axis=1).reshape(3, -1)
    short = runs.projected(whole)
    assert short @ short.T == pytest.approx(whole @ whole.T)
    each = hermitian(whole.reshape(3, 12, CHANNELS, CHANNELS))
    assert runs.cubes(short, CHANNELS) == pytest.approx(
        np.einsum('rkij,rkjm,rkmi->r', each, each, each).real)
    other = rng.standard_normal((1, whole.shape[1]))
    assert runs.projected(other) @ short.T == pytest.approx(other @ whole.T)


def test_a_resonance_that_no_template_has_is_resolved():
    """A model whose peak lies within a run keeps its bins apart."""
    bins = np.arange(BINS)
    peak = 1 + 50 / (1 + (bins - 200.0) ** 2)
    model = peak[:, None, None] * np.eye(CHANNELS)
    one = BinRuns(np.array([0, BINS]))
    found = runs_beside(one, model)
    assert set(range(197, 204)) <= set(found.edges) and len(found.edges) < BINS / 4
