"""SSI-COV on sliding windows: from accelerations to tracked modes."""
from ssi_ros.identify.explain import explain
from ssi_ros.identify.monitor import identify, Monitor
from ssi_ros.identify.settings import Identification

__all__ = ['Identification', 'Monitor', 'explain', 'identify']
