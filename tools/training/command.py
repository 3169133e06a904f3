"""`placegraph train`: trains the embedded networks; every step resumes from its checkpoint."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.errors import ConfigError

app = typer.Typer(
    help="Train the embedded networks on simulated houses (extra `train`).\n\nEvery step goes on where it was stopped.",
    no_args_is_help=True,
)
Data = Annotated[Path, typer.Option(help="Folder of the rendered views.")]
Work = Annotated[Path, typer.Option(help="Folder of checkpoints and exported files.")]
Steps = Annotated[int, typer.Option(min=1, help="Training steps in all.")]
Threads = Annotated[int, typer.Option(min=1, help="Threads of PyTorch.")]


@app.command()
def views(
    data: Data,
    houses: Annotated[int, typer.Option(min=1, help="How many houses.")] = 360,
    each: Annotated[int, typer.Option(min=1, help="Views of each.")] = 24,
    calibration: Annotated[
        bool, typer.Option(help="Houses kept aside for choosing INT8 ranges and thresholds.")
    ] = False,
) -> None:
    """Render the views that the networks are trained on."""
    from placegraph.tools.training.view_rendering import CALIBRATION_SEEDS, TRAINING_SEEDS, render_houses

    seeds = CALIBRATION_SEEDS if calibration else TRAINING_SEEDS
    if houses > len(seeds):
        raise ConfigError(f"--houses: at most {len(seeds)} seeds are set aside for this")
    render_houses(list(seeds[:houses]), each, data)


@app.command()
def objects(data: Data, work: Work, steps: Steps = 9000, threads: Threads = 2) -> None:
    """Train the detector from nothing, with the dense head from which the tagger is made."""
    from placegraph.tools.training.detector_training import train_objects

    train_objects(data, work / "objects.pt", steps, threads=threads)


@app.command()
def refine(
    data: Data,
    work: Work,
    steps: Steps = 9000,
    threads: Threads = 2,
    from_package: Annotated[
        bool, typer.Option("--from-package", help="Begin with the packaged weights, not with WORK/objects.pt.")
    ] = False,
) -> None:
    """Train the objects further on larger images; with --from-package also on views of your own."""
    from placegraph.models_onnx.manifest import find_weights
    from placegraph.tools.training.batch_norm_folding import fold_batch_norm, packaged_start
    from placegraph.tools.training.detector_training import train_objects
    from placegraph.tools.training.networks import ObjectNetwork
    from placegraph.tools.training.training_loop import read_average

    if from_package:
        start = packaged_start(
            find_weights("house_detector").files["model"], find_weights("house_tagger").files["model"]
        )
    else:
        start = fold_batch_norm(read_average(work / "objects.pt", ObjectNetwork()))
    train_objects(data, work / "refined.pt", steps, start, seed=2, threads=threads)


@app.command()
def tags(data: Data, work: Work, steps: Steps = 1000, threads: Threads = 2) -> None:
    """Tune the tagger; needs the refined objects."""
    from placegraph.tools.training.detector_training import read_refined
    from placegraph.tools.training.tagger_training import train_tagger

    train_tagger(data, read_refined(work / "refined.pt"), work / "tags.pt", steps, threads=threads)


@app.command()
def masks(data: Data, work: Work, steps: Steps = 4000, threads: Threads = 2) -> None:
    """Train the segmenter."""
    from placegraph.tools.training.segmenter_training import train_masks

    train_masks(data, work / "masks.pt", steps, threads=threads)


@app.command()
def scans(data: Data, houses: Annotated[int, typer.Option(min=1, help="How many houses.")] = 95) -> None:
    """Simulate what walks through houses leave of their furniture: what the location detector is trained on."""
    from placegraph.tools.training.location_training import simulate_scans
    from placegraph.tools.training.view_rendering import TRAINING_SEEDS

    simulate_scans(TRAINING_SEEDS[:houses], data)


@app.command()
def locations(data: Data, work: Work, steps: Steps = 3200, threads: Threads = 1) -> None:
    """Train the location detector on scans and write it to WORK/onnx."""
    from placegraph.tools.training.location_export import export_locations
    from placegraph.tools.training.location_training import train_locations

    train_locations(data, work / "locations.pt", steps, threads=threads)
    for file in export_locations(work / "locations.pt", data, work / "onnx"):
        print(file)


@app.command()
def reader(
    out: Annotated[Path, typer.Option(help="Adapter to write, a .gguf; checkpoints lie beside it.")],
    steps: Steps = 2000,
    seed: Annotated[int, typer.Option(min=0, help="Of the generated requests and the first weights.")] = 0,
    batch: Annotated[int, typer.Option(min=1, help="Requests a step.")] = 16,
    threads: Threads = 2,
    model: Annotated[
        Path | None, typer.Option(help="A GGUF of the family llama; without it the packaged model.")
    ] = None,
) -> None:
    """Train the language model's adapter that reads requests into programs, on generated requests."""
    from placegraph.tools.training.reader_training import train_reader

    train_reader(out, steps, model_path=model, seed=seed, batch=batch, threads=threads)


@app.command("evaluate-locations")
def evaluate_locations(
    model: Annotated[list[str] | None, typer.Option(help="Networks of the manifest, besides the recipe.")] = None,
    models: Annotated[list[Path] | None, typer.Option(help="More folders of weights.")] = None,
    houses: Annotated[int, typer.Option(min=1, help="How many evaluation houses.")] = 20,
) -> None:
    """Compare the paper's labelling recipe, and networks, with the true locations of evaluation houses: F1@delta."""
    from placegraph.models_onnx import LocationDetector
    from placegraph.models_onnx.load import load, require_task
    from placegraph.nodes.hierarchy.locations import LocationConfig
    from placegraph.tools.training.location_evaluation import comparison, finder_for
    from placegraph.tools.training.view_rendering import EVALUATION_SEEDS

    finders = {"recipe": finder_for(LocationConfig())}
    for name in model or ["house_locations"]:
        network = require_task(load(name, models or []), LocationDetector, name, "--model")
        finders[name] = finder_for(LocationConfig(model=name), network)
    print(comparison(finders, EVALUATION_SEEDS[:houses]))


@app.command()
def export(
    work: Work,
    calibration: Annotated[Path, typer.Option(help="Views kept aside: `placegraph train views --calibration`.")],
) -> None:
    """Write float and INT8 ONNX files of each network trained so far into WORK/onnx, with thresholds and checksums."""
    from placegraph.tools.training.network_packaging import package_networks

    for line in package_networks(work, calibration):
        print(line)
