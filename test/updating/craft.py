"""A small spacecraft whose real twin differs from its model, and records of the twin."""
from dataclasses import replace
from functools import lru_cache

import numpy as np
from ssi_ros.effects import inject, parse_effect, simulate_setup
from ssi_ros.model import load_spacecraft
from ssi_ros.model.errors import Calibration, declared, of_recording

SECONDS = 400.0


@lru_cache
def model():
    """Return the packaged spacecraft with four modes an array, at 40 Hz."""
    whole = load_spacecraft()
    return replace(whole, rate_hz=40.0, arrays=tuple(replace(a, modes=4) for a in whole.arrays))


@lru_cache
def twin(seed=1, share=1.0):
    """Return the spacecraft that is recorded: each number off by `share` declared deviations."""
    names, stds = declared(model())
    errors = share * stds * np.random.default_rng(seed).standard_normal(len(stds))
    return replace(model(), calibration=Calibration(names, errors))


@lru_cache
def record(seed, *texts, torque=1.0, process=1.0, forces_db=0.0):
    """Return a record of the twin at other levels, forces on single modes among them."""
    e, known = twin().excitation, twin().calibration
    away = np.random.default_rng(seed).uniform(-1, 1, len(known.names)) * forces_db * (
        np.log(10) / 20)
    louder = replace(twin(), excitation=replace(
        e, torque_rms_n_m=tuple(torque * t for t in e.torque_rms_n_m),
        process_noise_rms=process * e.process_noise_rms), calibration=replace(
            known, values=known.values + np.where(of_recording(known.names), away, 0.0)))
    setup = inject(louder, [parse_effect(t) for t in texts], SECONDS)
    return simulate_setup(setup, seed)
