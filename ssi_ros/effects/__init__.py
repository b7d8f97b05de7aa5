"""The effects that a simulator may lack, one small file each, and how they are injected."""
from ssi_ros.effects.base import Effect, effect, ModalPattern, Setup, Site
from ssi_ros.effects.config import load_configuration, save_configuration
from ssi_ros.effects.inject import inject
from ssi_ros.effects.library import effect_class, library, parse_effect, with_laws
from ssi_ros.effects.places import applicable, left_out, places
from ssi_ros.effects.simulate import simulate_setup

__all__ = ['applicable', 'Effect', 'effect', 'effect_class', 'inject', 'left_out', 'library',
           'load_configuration', 'ModalPattern', 'parse_effect', 'places', 'save_configuration',
           'Setup', 'simulate_setup', 'Site', 'with_laws']
