"""SSI-COV on sliding windows: from accelerations to tracked modes."""
from ssi_ros.identify.era import era
from ssi_ros.identify.explain import explain
from ssi_ros.identify.methods import Method
from ssi_ros.identify.monitor import identify, Monitor
from ssi_ros.identify.okid import pulse_responses
from ssi_ros.identify.settings import Identification
from ssi_ros.identify.sliding import SlidingSsiCov
from ssi_ros.identify.ssi_cov import ssi_cov
from ssi_ros.identify.ssi_data import ssi_data

__all__ = ['Identification', 'Method', 'Monitor', 'SlidingSsiCov', 'era', 'explain', 'identify',
           'pulse_responses', 'ssi_cov', 'ssi_data']
