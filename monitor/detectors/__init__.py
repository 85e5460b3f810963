"""Detectors in addition to the friction scheme, one row each in `registry`."""

from monitor.detectors.detector import Detector
from monitor.detectors.registry import DETECTORS, DetectorKind, detector_kind
from monitor.detectors.selection import FRICTION, detectors_of

__all__ = ["DETECTORS", "FRICTION", "Detector", "DetectorKind", "detector_kind", "detectors_of"]
