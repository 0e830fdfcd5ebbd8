"""Make a house of a Matterport3D scan."""

from pathlib import Path

from rich.progress import Progress

from vlnhijack.navigation.graph import scan_graph
from vlnhijack.scenes.house_files import check_name, save_house
from vlnhijack.scenes.importing.assemble import assemble
from vlnhijack.scenes.importing.mesh_file import ReadOptions, read_mesh
from vlnhijack.scenes.matterport.house_file import read_house_file
from vlnhijack.scenes.matterport.labels import label
from vlnhijack.scenes.matterport.matching import REACH, match_objects
from vlnhijack.scenes.matterport.scan_files import scan_files
from vlnhijack.scenes.matterport.segmentation import read_segmentation


def import_scan(
    scan: Path, connectivity: Path, folder: Path, *, allow_missing: bool, progress: Progress
) -> list[str]:
    """Write the house of a scan to `folder`; lines about it.

    connectivity: a folder or archive of graphs. Raises InputError, and writes nothing, where a file
    is missing or broken.
    """
    task = progress.add_task(f"{scan.name}: files", total=5)
    with scan_files(scan) as files:
        name = files.name
        check_name(name, scan)
        graph = scan_graph(connectivity, name)
        listed = read_house_file(files.segmentation / f"{name}.house")
        progress.update(task, advance=1, description=f"{name}: segmentation")
        segments = read_segmentation(files.segmentation, name, len(listed.objects))
        progress.update(task, advance=1, description=f"{name}: mesh")
        read = read_mesh(files.mesh, ReadOptions(up="z", allow_missing=allow_missing))
    progress.update(task, advance=1, description=f"{name}: objects")
    matching = progress.add_task(f"{name}: faces matched", total=len(read.mesh.faces))
    corners = read.mesh.vertices[read.mesh.faces]
    face_object, quality = match_objects(
        segments.corners,
        segments.face_object,
        corners,
        lambda faces: progress.advance(matching, faces),
    )
    mesh, rooms, lost = label(read.mesh, listed, face_object)
    progress.update(task, advance=1, description=f"{name}: house")
    house = assemble(mesh, name, graph, rooms)
    save_house(house, folder)
    progress.update(task, advance=1)
    lines = [
        f"{folder}: {len(rooms)} rooms, {len(house.objects)} objects, {len(mesh.faces)} faces, "
        f"{len(mesh.materials)} materials, {len(graph.viewpoints)} viewpoints",
        f"match: {quality.within_reach:.2%} of the faces are within {REACH:.2f} m of the "
        f"segmentation; half are within {1000 * quality.median:.1f} mm, 95 % within "
        f"{1000 * quality.high:.1f} mm; its files agree on {segments.agreement:.2%}",
    ]
    lines += [f"objects without faces, left out: {', '.join(map(str, lost))}"] if lost else []
    return lines + list(read.notes)
