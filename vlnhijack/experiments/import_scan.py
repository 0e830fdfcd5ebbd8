"""Make a house folder of a Matterport3D scan."""

import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import Progress

from vlnhijack.artifacts import require_replaceable
from vlnhijack.experiments.import_house import ImportOptions, Stages, write_house
from vlnhijack.navigation.graph import scan_graph
from vlnhijack.scenes.house_files import HOUSE_FILE, check_name
from vlnhijack.scenes.importing.mesh_file import read_mesh
from vlnhijack.scenes.importing.source_mesh import SourceMesh
from vlnhijack.scenes.matterport.house_file import read_house_file
from vlnhijack.scenes.matterport.labels import label
from vlnhijack.scenes.matterport.matching import REACH, MatchQuality, match_objects
from vlnhijack.scenes.matterport.scan_files import scan_files
from vlnhijack.scenes.matterport.segmentation import Segmentation, read_segmentation


def import_scan(
    scan: Path, connectivity: Path, folder: Path, options: ImportOptions, progress: Progress
) -> list[str]:
    """Write the house of a scan to `folder`, as a whole or not at all; lines about it.

    connectivity: a folder or archive of graphs; of the options, the labels play no part.
    """
    require_replaceable(folder, HOUSE_FILE)
    started = time.perf_counter()
    stages = Stages(progress, scan.resolve().name, total=9 if options.unwrap_all else 8)
    stages.next("files")
    with scan_files(scan) as files:
        check_name(files.name, scan)
        graph = scan_graph(connectivity, files.name)
        listed = read_house_file(files.segmentation / f"{files.name}.house")
        stages.next("segmentation")
        segments = read_segmentation(files.segmentation, files.name, len(listed.objects))
        stages.next("mesh")
        read = read_mesh(files.mesh, options.read)
    stages.next("objects")
    face_object, quality = _match(segments, read.mesh, progress)
    mesh, rooms, lost = label(read.mesh, listed, face_object)
    lines = write_house(mesh, rooms, graph, folder, options, stages)
    without = f"objects without faces, left out: {', '.join(map(str, lost)) or 'none'}"
    seconds = time.perf_counter() - started
    return [
        *read.notes,
        _describe(quality, segments.agreement),
        without,
        *lines,
        f"{folder}: {seconds:.0f} s",
    ]


def _match(
    segments: Segmentation, mesh: SourceMesh, progress: Progress
) -> tuple[NDArray[np.int32], MatchQuality]:
    task = progress.add_task("faces matched", total=len(mesh.faces))
    corners = mesh.vertices[mesh.faces]
    return match_objects(
        segments.corners,
        segments.face_object,
        corners,
        lambda faces: progress.advance(task, faces),
    )


def _describe(quality: MatchQuality, agreement: float) -> str:
    return (
        f"match: {quality.within_reach:.2%} of the faces are within {REACH:.2f} m of the "
        f"segmentation, half within {1000 * quality.median:.1f} mm, 95 % within "
        f"{1000 * quality.high:.1f} mm; its files agree on {agreement:.2%} of its faces"
    )
