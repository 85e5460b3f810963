"""`rigwatch archive`: a catalogue of many sessions, and questions to it."""

HELP = "catalogue many sessions in a folder or object store, and query them"
EXAMPLE = """\
  rigwatch archive index sessions --on local:4
  rigwatch archive query sessions friction-growth
  rigwatch archive show s3://recordings/rigs"""
ACTIONS = {
    "index": "archive.archive_index",
    "query": "archive.archive_query",
    "show": "archive.archive_show",
    "retain": "archive.archive_retain",
    "thin": "archive.archive_thin",
}
