"""Edits of a study's file: each returns the changed study and leaves all files unchanged.

`commit` writes the result together with the ledger's line.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.study.folder import FILE
from rigwatch.workbench.study.own_files import unsaved
from rigwatch.workbench.study.study import GIVEN, RECORDINGS, Study, converted, study_of
from rigwatch.workbench.study.study_file import Accepted

_TABLE = "\n[[effects]]\n"
_OF_EFFECT = re.compile(r"(?m)^[ \t]*\[\[[ \t]*effects[ \t]*\]\]")
_OTHER = re.compile(r"(?m)^[ \t]*\[(?!\[?[ \t]*effects[ \t]*[.\]])")
"""Beginning of a table that is none of an effect, nor a part of one."""
_REMARKS = re.compile(r"(\n[ \t]*(#[^\n]*)?)*\Z")
_LIST = r"\[(?:#[^\n]*|\"[^\"\n]*\"|'[^'\n]*'|[^\]\"'#])*\][^\n]*\n?"
"""A list of texts, on one line or on several."""
CHOSEN = "  # chosen from the data"
"""Comment on lines that are written with the first effect and removed with it."""
_HOLDS = re.compile(r"(?m)^[ \t]*(hold|late|holds_chosen)\b.*\n")
"""What `holds_chosen` declares to be chosen, whether or not the comment is still there."""


def append_effect(study: Study, accepted: Accepted) -> Study:
    """The study with one more effect in its file, values in the parameters' units."""
    written = converted(study, accepted, "from_si")
    table = f'effect = "{accepted.effect}"\nport = "{accepted.port}"\n'
    table += "ahead = true\n" if accepted.ahead else ""
    table += f'beyond = "{accepted.beyond}"\n' if accepted.beyond else ""
    table += f"parameters = {_inline(written.parameters)}\n"
    if written.model:
        table += f"model = {_inline(written.model)}\n"
    text = study.text.rstrip() + "\n" + _TABLE + table
    return study_of(study.folder, text)


def _inline(values: Mapping[str, float]) -> str:
    """An inline TOML table of numbers by name."""
    return f"{{ {', '.join(f'{name} = {value!r}' for name, value in values.items())} }}"


def drop_effect(study: Study) -> Study:
    """The study without the last effect in its file.

    Raises:
        ModelError: there is no effect, or it has no table of its own.
    """
    if not study.file.effects:
        raise ModelError(f"{study.folder}: found no effect to undo")
    text = _without_last_table(study.text)
    if study.file.holds_chosen:
        # They were chosen with the effect in the model.
        text = _HOLDS.sub("", text)
    if len(study.file.effects) == 1:
        text = "".join(line for line in text.splitlines(True) if CHOSEN not in line)
    changed, kept = study_of(study.folder, text), study.file.effects[:-1]
    if [(a.effect, a.port) for a in changed.file.effects] != [(a.effect, a.port) for a in kept]:
        expected = "each effect in a table [[effects]] of its own"
        raise ModelError(f"{study.folder / FILE}: found effects written otherwise, {expected}")
    return changed


def _without_last_table(text: str) -> str:
    """The text without its last table of an effect; what a user wrote behind it stays."""
    begin = next((found.start() for found in [*_OF_EFFECT.finditer(text)][::-1]), len(text))
    other = _OTHER.search(text, begin)
    table = text[begin : other.start() if other else len(text)]
    remarks = _REMARKS.search(table)
    assert remarks is not None  # at the end of any text there may be none
    behind = table[remarks.start() :] + text[begin + len(table) :]
    return "\n\n".join(filter(None, (text[:begin].rstrip(), behind.strip()))) + "\n"


def use_effect_file(study: Study, name: str, text: str) -> Study:
    """The study with an own effect file of this name and content in its folder.

    Raises:
        ConfigError: the content is invalid.
        ModelError: the name is not a plain one, or an accepted effect would change.
    """
    new = unsaved(study.folder, name, text)
    names = tuple(dict.fromkeys([*study.file.effect_files, name]))
    changed = study_of(study.folder, _with_list(study, "effect_files", names), new)
    for accepted in study.file.effects:
        if changed.effect(accepted.effect) != study.effect(accepted.effect):
            raise ModelError(
                f"{name}: {accepted.effect}: found another declaration of an effect that the model"
                " has, expected another name; `rigwatch undo` removes it from the model"
            )
    return changed


def use_model_file(study: Study, name: str, text: str) -> Study:
    """The study on an own model file of this name and content in its folder.

    Raises:
        ConfigError: the content is invalid.
        ModelError: the name is not a plain one, the model cannot be used, or effects have been
            accepted on the current one.
    """
    if study.file.effects:
        label = f"{study.file.effects[-1].effect}@{study.file.effects[-1].port}"
        raise ModelError(
            f"{study.folder}: found {label} accepted on the current model, expected a study without"
            " effects; `rigwatch undo` removes them"
        )
    new = unsaved(study.folder, name, text)
    kept = [x for x in study.text.splitlines(True) if not re.match(r"model\s*=", x)]
    return study_of(study.folder, "".join([f'model = "{name}"\n', *kept]), new)


def use_variants(study: Study, variants: Sequence[str]) -> Study:
    """The study with these model variants in its file."""
    return study_of(study.folder, _with_list(study, "variants", variants))


def _with_list(study: Study, key: str, names: Sequence[str]) -> str:
    """The file's text with a list of names at its top; without the key if the list is empty."""
    quoted = ", ".join(f'"{name}"' for name in names)
    kept = re.sub(rf"(?m)^[ \t]*{key}[ \t]*=[ \t]*{_LIST}", "", study.text)
    return (f"{key} = [{quoted}]\n" if names else "") + kept


def without_chosen_holds(study: Study) -> Study:
    """The study without the holds that were chosen from the recordings, which may be others now."""
    if not study.file.holds_chosen:
        return study
    return study_of(study.folder, _HOLDS.sub("", study.text))


def keep_holds(study: Study) -> Study:
    """The study with the holds and the horizon chosen from the data written to its file."""
    chosen = {n: h for n, h in study.holds.items() if h.source not in GIVEN}
    if study.horizon_from and study_of(study.folder, study.text).file.horizon is None:
        half = f"half_windows = true{CHOSEN}\n" if study.file.half_windows else ""
        text = f"horizon = {study.file.horizon!r}{CHOSEN}\n{half}" + study.text
        study = replace(study_of(study.folder, text), holds=study.holds)
    if not chosen or (study.file.hold and not study.file.holds_chosen):
        return study
    again = any(held.source == RECORDINGS for held in chosen.values())
    holds = ", ".join(f'{name} = "{held.hold}"' for name, held in chosen.items())
    late = ", ".join(f"{name} = {held.late!r}" for name, held in chosen.items() if held.late)
    lines = f"hold = {{ {holds} }}{CHOSEN}\n" + (f"late = {{ {late} }}{CHOSEN}\n" if late else "")
    lines += f"holds_chosen = true{CHOSEN}\n" if again else ""
    return study_of(study.folder, lines + _HOLDS.sub("", study.text))
