"""List, verify, import and fetch the weights that placegraph knows."""

from __future__ import annotations

import http.client
import os
import shutil
import urllib.error
import urllib.request
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from placegraph.models_onnx.load import load
from placegraph.models_onnx.manifest import (
    WEIGHTS_DIR,
    FileEntry,
    ManifestEntry,
    find_file,
    find_verified_file,
    known_weights,
    sha256,
)
from placegraph.runtime.errors import ModelError, PlacegraphError

TIMEOUT_S = 30.0  # without a byte from the server
BLOCK_BYTES = 1 << 20

app = typer.Typer(help="List, verify, import and fetch the networks' weights.", no_args_is_help=True)

ModelDirs = Annotated[list[Path] | None, typer.Option("--models", help="A further folder of models; may be repeated.")]
Target = Annotated[Path, typer.Option("--to", help="Folder that the files are written to.")]


@app.command("list")
def list_weights(models: ModelDirs = None) -> None:
    """Show every known network: name, family, licence, size, and where its files were found."""
    for name, network in sorted(known_weights(models or ()).items()):
        entry = network.entry
        megabytes = sum(file.size_bytes for file in entry.files.values()) / 1e6
        paths = {role: find_file(network, role, models or ()) for role in entry.files}
        missing = [entry.files[role].file for role, path in paths.items() if path is None]
        places = sorted({str(path.parent) for path in paths.values() if path is not None})
        where = f"missing {', '.join(missing)}" if missing else ", ".join(places)
        print(f"{name:20} {entry.family:12} {entry.licence:12} {megabytes:8.1f} MB  {where}")


@app.command()
def verify(
    names: Annotated[list[str] | None, typer.Argument(help="Networks to verify; all that are present.")] = None,
    models: ModelDirs = None,
) -> None:
    """Check the checksums of networks and that each loads as its family; exit code 1 if one does not."""
    networks = known_weights(models or ())
    failed = False
    for name in names or sorted(networks):
        if not names and any(
            find_file(networks[name], role, models or ()) is None for role in networks[name].entry.files
        ):
            print(f"{name:20} missing")
            continue
        try:
            load(name, models or ())
        except PlacegraphError as error:
            failed = True
            print(f"{name:20} FAILED: {error}")
        else:
            print(f"{name:20} ok")
    if failed:
        raise typer.Exit(1)


@app.command("import")
def import_weights(
    folder: Annotated[Path, typer.Argument(help="Folder that holds files of known networks.")],
    to: Target = WEIGHTS_DIR,
    models: ModelDirs = None,
) -> None:
    """Copy the files of known networks out of a folder, after checking each against the manifest."""
    for path in import_files(folder, to, known_weights(models or ())):
        print(f"imported {path}")


@app.command()
def fetch(
    name: Annotated[str, typer.Argument(help="A known network.")], to: Target = WEIGHTS_DIR, models: ModelDirs = None
) -> None:
    """Download the files of a network that are not there yet; a broken download is resumed the next time."""
    networks = known_weights(models or ())
    if name not in networks:
        raise ModelError(f"no weights named {name!r}; there are: {', '.join(sorted(networks))}")
    network = networks[name]
    for role, file in network.entry.files.items():
        if find_file(network, role, (*(models or ()), to)) is not None:
            print(f"present  {find_verified_file(network, role, (*(models or ()), to))}")
        else:
            print(f"fetched  {fetch_file(name, file, to)}")


def import_files(folder: Path, to: Path, networks: Mapping[str, ManifestEntry]) -> list[Path]:
    """Copy every file of the known weights that lies in `folder` into `to`; returns the copies, sorted.

    Nothing is copied unless all of them are right.

    Raises:
        ModelError: there is no such folder, it holds no known file, or a file of a known name has another checksum.
    """
    if not folder.is_dir():
        raise ModelError(f"{folder}: no such folder")
    checksums: dict[str, set[str]] = {}  # several networks may use files of one name
    for network in networks.values():
        for file in network.entry.files.values():
            checksums.setdefault(file.file, set()).add(file.sha256)
    paths = [folder / name for name in sorted(checksums) if (folder / name).is_file()]
    if not paths:
        raise ModelError(f"{folder}: holds none of the known files: {', '.join(sorted(checksums))}")
    for path in paths:
        if (digest := sha256(path)) not in checksums[path.name]:
            raise ModelError(f"{path}: sha256 is {digest}, expected {' or '.join(sorted(checksums[path.name]))}")
    to.mkdir(parents=True, exist_ok=True)
    for path in paths:
        part = to / f"{path.name}.part"
        shutil.copyfile(path, part)
        part.replace(to / path.name)
    return [to / path.name for path in paths]


def fetch_file(name: str, file: FileEntry, to: Path) -> Path:
    """Download one file into `to`, beginning where an earlier attempt stopped; returns its path.

    Raises:
        ModelError: the manifest names no http(s) address, the download fails, or its checksum is not the manifest's.
    """
    if not file.url:
        raise ModelError(
            f"weights {name!r}: {file.file} has no address to fetch it from; use `placegraph models import`"
        )
    if not file.url.startswith(("http://", "https://")):
        raise ModelError(f"weights {name!r}: {file.url}: only http and https addresses are fetched")
    to.mkdir(parents=True, exist_ok=True)
    part = to / f"{file.file}.{file.sha256[:8]}.part"  # a changed manifest must not resume another file
    try:
        _download(file, part)
    except (urllib.error.URLError, http.client.HTTPException, OSError) as error:
        raise ModelError(f"weights {name!r}: {file.url}: {error}; run the same again to resume") from error
    digest = sha256(part)
    if digest != file.sha256:
        part.unlink()
        raise ModelError(f"weights {name!r}: {file.url} gave a file of sha256 {digest}, expected {file.sha256}")
    part.replace(to / file.file)
    return to / file.file


def _download(file: FileEntry, part: Path) -> None:
    """Complete the partial file `part`. A server that cannot resume sends the whole, which then replaces it."""
    have = part.stat().st_size if part.exists() else 0
    if have == file.size_bytes:
        return
    if have > file.size_bytes:
        os.truncate(part, 0)
        have = 0
    headers = {"Range": f"bytes={have}-"} if have else {}
    request = urllib.request.Request(file.url, headers=headers)
    with urllib.request.urlopen(request, timeout=TIMEOUT_S) as reply:
        resumed = have > 0 and reply.status == 206
        with part.open("ab" if resumed else "wb") as out:
            size = have if resumed else 0
            while block := reply.read(BLOCK_BYTES):
                out.write(block)
                size += len(block)
                if size > file.size_bytes:
                    raise OSError(f"more than the {file.size_bytes} bytes expected")
    if size != file.size_bytes:
        raise OSError(f"ended after {size} of {file.size_bytes} bytes")
