"""Shared parts of commands: opening sessions, drawing, progress."""

from rigwatch.commands.common.batch_options import add_many, add_on, add_where, run_many, the_one
from rigwatch.commands.common.drawing import ready_to_draw, show_until_closed
from rigwatch.commands.common.log_arguments import add_log_columns
from rigwatch.commands.common.log_questions import LOGS, ask_for_logs, can_ask
from rigwatch.commands.common.many_studies import add_studies, run_studies, the_study
from rigwatch.commands.common.marks import marks_of
from rigwatch.commands.common.named_values import hint_of_unit, named_values, number_in_unit
from rigwatch.commands.common.numbers import PORT, POSITIVE, number, whole
from rigwatch.commands.common.operator_argument import add_user
from rigwatch.commands.common.output import check_folder, print_json, print_result, say
from rigwatch.commands.common.served_page import tell_address
from rigwatch.commands.common.session_files import (
    add_session_and_target,
    add_span,
    damage_lines,
    report_written,
    span_between,
    span_of,
    unix_time,
)
from rigwatch.commands.common.shipped_argument import file_or_name

__all__ = [
    "LOGS",
    "PORT",
    "POSITIVE",
    "add_log_columns",
    "add_many",
    "add_on",
    "add_session_and_target",
    "add_span",
    "add_studies",
    "add_user",
    "add_where",
    "ask_for_logs",
    "can_ask",
    "check_folder",
    "damage_lines",
    "file_or_name",
    "hint_of_unit",
    "marks_of",
    "named_values",
    "number",
    "number_in_unit",
    "print_json",
    "print_result",
    "ready_to_draw",
    "report_written",
    "run_many",
    "run_studies",
    "say",
    "show_until_closed",
    "span_between",
    "span_of",
    "tell_address",
    "the_one",
    "the_study",
    "unix_time",
    "whole",
]
