"""The known weights and where their files are. Every file is verified by its checksum before it is used.

A manifest is a TOML file of tables `[weights.<name>]`; `models_onnx/manifest.toml` is ours and says how to write one.
Each folder of models may hold another, for weights that are not ours.
"""

from __future__ import annotations

import hashlib
import os
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from placegraph.runtime.errors import ModelError

PACKAGE_DIR = Path(__file__).parent
EMBEDDED_DIR = PACKAGE_DIR / "embedded"
WEIGHTS_DIR = PACKAGE_DIR / "weights"
MODELS_VARIABLE = "PLACEGRAPH_MODELS"
LABELS_ROLE = "labels"

OptionsT = TypeVar("OptionsT", bound="ModelOptions")


class ModelOptions(BaseModel):
    """Base of a family's options: frozen, strict, unknown keys refused."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class FileEntry(ModelOptions):
    """One file of some weights."""

    file: Annotated[str, StringConstraints(pattern=r"^[^/\\]+$")]  # a bare name: folders are searched for it
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]
    size_bytes: Annotated[int, Field(gt=0)]
    url: str = ""  # where `placegraph models fetch` gets it; "": it must be imported


class WeightsEntry(ModelOptions):
    """One table of a manifest."""

    family: str
    licence: str
    source: str  # in words: where the files come from
    files: dict[str, FileEntry]
    labels: Annotated[tuple[str, ...], Field(strict=False)] = ()  # in place of a file of role "labels"
    options: dict[str, Any] = {}


@dataclass(frozen=True)
class ManifestEntry:
    """A manifest's entry with the place it was read from."""

    name: str
    entry: WeightsEntry
    manifest: Path


@dataclass(frozen=True)
class Weights:
    """Verified files of one name, by role ("model", "encoder", ...), with the labels and options of their family."""

    name: str
    family: str
    files: dict[str, Path]
    labels: tuple[str, ...]
    options: dict[str, Any]

    def file(self, role: str) -> Path:
        """The file of a role; raises ModelError when the manifest names none."""
        if role not in self.files:
            raise ModelError(f"weights {self.name!r}: family {self.family!r} needs a file of role {role!r}")
        return self.files[role]

    def class_names(self) -> tuple[str, ...]:
        """The labels of a network with classes of its own; raises ModelError when there are none."""
        if not self.labels:
            raise ModelError(f"weights {self.name!r}: family {self.family!r} needs labels, or a file of role 'labels'")
        return self.labels

    def parse_options(self, kind: type[OptionsT]) -> OptionsT:
        """The options as the family's own type; raises ModelError naming the option that does not fit."""
        try:
            return kind.model_validate(self.options)
        except ValidationError as error:
            raise ModelError(f"weights {self.name!r}, options: {_first_problem(error)}") from error


def model_folders(model_dirs: Sequence[Path | str] = ()) -> list[Path]:
    """The folders searched for files, in order: embedded, weights, those of $PLACEGRAPH_MODELS, then `model_dirs`."""
    from_environment = [Path(part) for part in os.environ.get(MODELS_VARIABLE, "").split(os.pathsep) if part]
    all_folders = [EMBEDDED_DIR, WEIGHTS_DIR, *from_environment, *(Path(folder) for folder in model_dirs)]
    return list(dict.fromkeys(Path(folder).expanduser().resolve() for folder in all_folders))


def known_weights(model_dirs: Sequence[Path | str] = ()) -> dict[str, ManifestEntry]:
    """All known weights by name: ours, then those of each folder's own manifest.

    Raises:
        ModelError: a manifest cannot be read, or two of them describe the same name.
    """
    manifests = [PACKAGE_DIR / "manifest.toml", *(folder / "manifest.toml" for folder in model_folders(model_dirs))]
    known: dict[str, ManifestEntry] = {}
    for path in manifests:
        if not path.is_file():
            continue
        for name, entry in _read(path).items():
            if name in known:
                raise ModelError(f"weights {name!r} are described twice: {known[name].manifest} and {path}")
            known[name] = ManifestEntry(name, entry, path)
    return known


def find_weights(name: str, model_dirs: Sequence[Path | str] = ()) -> Weights:
    """The weights `name`, with every file verified.

    Raises:
        ModelError: the name is unknown, a file is in none of the folders, or its checksum is wrong.
    """
    known = known_weights(model_dirs)
    if name not in known:
        raise ModelError(f"no weights named {name!r}; there are: {', '.join(sorted(known))}")
    entry = known[name].entry
    files = {role: find_verified_file(known[name], role, model_dirs) for role in entry.files}
    labels = entry.labels
    if LABELS_ROLE in files:
        if labels:
            raise ModelError(f"weights {name!r}: labels are given both in {known[name].manifest} and as a file")
        labels = read_lines(files[LABELS_ROLE])
    return Weights(name, entry.family, files, labels, dict(entry.options))


def find_file(listed: ManifestEntry, role: str, model_dirs: Sequence[Path | str] = ()) -> Path | None:
    """Path of the first file with the name of a role's file, not verified; None when no folder holds one."""
    name = listed.entry.files[role].file
    paths = (folder / name for folder in _searched(listed, model_dirs))
    return next((path for path in paths if path.is_file()), None)


def find_verified_file(listed: ManifestEntry, role: str, model_dirs: Sequence[Path | str] = ()) -> Path:
    """Path of the file of a role whose checksum is right.

    Raises:
        ModelError: no folder holds it, or only with another sha256 than the manifest's.
    """
    expected, searched = listed.entry.files[role], _searched(listed, model_dirs)
    wrong: list[str] = []
    for path in (folder / expected.file for folder in searched):
        if not path.is_file():
            continue
        digest = sha256(path)
        if digest == expected.sha256:
            return path
        wrong.append(f"{path} has {digest}")
    if wrong:
        raise ModelError(
            f"weights {listed.name!r}: {expected.file} should have sha256 {expected.sha256}, but {'; '.join(wrong)}"
        )
    how = f"`placegraph models fetch {listed.name}`" if expected.url else "`placegraph models import DIR`"
    raise ModelError(
        f"weights {listed.name!r}: {expected.file} ({role}) is in none of: {', '.join(map(str, searched))}; "
        f"get it with {how}, or name its folder in the environment variable {MODELS_VARIABLE}"
    )


def _searched(listed: ManifestEntry, model_dirs: Sequence[Path | str]) -> list[Path]:
    # the manifest's own folder first: file names such as model.onnx recur
    first = [] if listed.manifest.parent == PACKAGE_DIR else [listed.manifest.parent]
    return list(dict.fromkeys([*first, *model_folders(model_dirs)]))


def read_lines(path: Path) -> tuple[str, ...]:
    """Non-empty lines of a text file, stripped; raises ModelError when there are none or the text is not UTF-8."""
    try:
        lines = tuple(line.strip() for line in path.read_text("utf-8").splitlines() if line.strip())
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{path}: {error}") from error
    if not lines:
        raise ModelError(f"{path}: no line of text")
    return lines


def sha256(path: Path) -> str:
    """SHA-256 of a file, 64 hex digits; raises ModelError when it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ModelError(f"{path}: {error}") from error


def _read(path: Path) -> dict[str, WeightsEntry]:
    try:
        table = tomllib.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ModelError(f"{path}: {error}") from error
    if set(table) - {"weights"} or not isinstance(table.get("weights", {}), dict):
        raise ModelError(f"{path}: only tables [weights.<name>] are expected, found {', '.join(sorted(table))}")
    found = {}
    for name, body in table.get("weights", {}).items():
        try:
            found[name] = WeightsEntry.model_validate(body)
        except ValidationError as error:
            raise ModelError(f"{path}: [weights.{name}] {_first_problem(error)}") from error
    return found


def _first_problem(error: ValidationError) -> str:
    problem = error.errors()[0]
    return f"{'.'.join(map(str, problem['loc'])) or 'table'}: {problem['msg']}"
