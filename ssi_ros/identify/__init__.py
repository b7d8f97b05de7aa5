"""SSI-COV on sliding windows: from accelerations to tracked modes."""
from ssi_ros.identify.explain import explain
from ssi_ros.identify.monitor import identify, Monitor
from ssi_ros.identify.settings import Identification
from ssi_ros.identify.sliding import SlidingSsiCov
from ssi_ros.identify.ssi_cov import ssi_cov

__all__ = ['Identification', 'Monitor', 'SlidingSsiCov', 'explain', 'identify', 'ssi_cov']
