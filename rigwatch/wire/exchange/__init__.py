"""Sessions to and from other formats: CSV, Parquet and MAT files, with units converted."""

from rigwatch.wire.exchange.column_units import AMBIGUOUS, conversion
from rigwatch.wire.exchange.exporting import export_session
from rigwatch.wire.exchange.importing import Imported, import_file
from rigwatch.wire.exchange.mapping import ImportMapping, parse_map_option, parse_source
from rigwatch.wire.exchange.table_files import columns_of, read_table
from rigwatch.wire.exchange.tables import Table

__all__ = [
    "AMBIGUOUS",
    "ImportMapping",
    "Imported",
    "Table",
    "columns_of",
    "conversion",
    "export_session",
    "import_file",
    "parse_map_option",
    "parse_source",
    "read_table",
]
