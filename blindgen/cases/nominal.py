# Licensed under the Apache License, Version 2.0.
"""Write the nominal model of a case as a spacecraft YAML, with what is declared uncertain."""
from blindgen.cases.draw import GAIN, INERTIA, SHAPE
from blindgen.sizes.unknowns import DAMPING_RMS, FREQUENCY_RMS
import yaml

PLACE_M = 0.01              # declared, though the sensors are where the model has them
THICKNESS_M = 0.02          # of the equivalent plate; the stiffness is given on its own


def nominal_yaml(craft, mesh=(12, 4)):
    """
    Return the text of a nominal spacecraft's YAML.

    Parameters
    ----------
    craft : Spacecraft
        Without errors.
    mesh : (int, int)
        Elements along and across; it is not the truth's, which has none.

    """
    data = {
        'hub': {'inertia_kg_m2': [[craft.hub_inertia[i] if i == j else 0.0 for j in range(3)]
                                  for i in range(3)]},
        'arrays': [{
            'name': a.name, 'side': int(a.side), 'root_m': a.root_m,
            'plate': {'length_m': a.plate.length_m, 'width_m': a.plate.width_m,
                      'thickness_m': THICKNESS_M,
                      'density_kg_m3': a.plate.mass_per_area_kg_m2 / THICKNESS_M,
                      'stiffness_n_m': a.plate.stiffness_n_m, 'poisson_ratio': a.plate.poisson,
                      'elements_along': mesh[0], 'elements_across': mesh[1]},
            'modes': a.modes, 'damping_ratio': a.damping[0], 'hinge_n_m_rad': float('inf')}
            for a in craft.arrays],
        'sensors': [{'name': s.name, 'array': craft.arrays[s.array].name, 'along_m': s.along_m,
                     'lateral_m': s.lateral_m} for s in craft.sensors],
        # the levels are those of the record's own rate, and the file's hold at 100 Hz
        'excitation': {'torque_rms_n_m': [v * (100.0 / craft.rate_hz)**0.5
                                          for v in craft.torque_rms],
                       'process_noise_rms': craft.process_rms * (100.0 / craft.rate_hz)**0.5},
        'noise_rms_m_s2': craft.noise_rms, 'rate_hz': craft.rate_hz,
        'momentum_n_m_s': [0.0, 0.0, 0.0],
        'uncertainty': {'frequency': round(FREQUENCY_RMS, 4),
                        'damping': round(float(DAMPING_RMS), 2),
                        'participation': SHAPE, 'shape': SHAPE, 'hub_inertia': INERTIA,
                        'gain': GAIN, 'sensor_place_m': PLACE_M}}
    return yaml.safe_dump(data, sort_keys=False)
