"""Records of a structure's motion: from session files, or growing while it is measured."""

from rigwatch.structures.records.growing_record import GrowingRecord
from rigwatch.structures.records.record import Record, record_of, write_record
from rigwatch.structures.records.session_record import read_any
from rigwatch.structures.records.weighting import weights

__all__ = ["GrowingRecord", "Record", "read_any", "record_of", "weights", "write_record"]
