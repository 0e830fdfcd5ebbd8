"""What a person sees from each viewpoint of a house: the room, and the objects in line of sight."""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.ray.ray_pyembree import RayMeshIntersector

from vlnhijack import seeds
from vlnhijack.frames import heading_of
from vlnhijack.scenes.house import House, Room, nearest_room
from vlnhijack.scenes.surface import Surface

POINTS = 24
RECOGNISED = 0.4  # an object is a landmark where this share of its surface points is seen
ANGULAR_SIZE = 0.15  # and where it spans this angle, radians


@dataclass(frozen=True)
class Sighting:
    """An object as seen from a viewpoint.

    distance: metres along the floor to the nearest point of its footprint; heading: of its centre,
    radians in the world's frame; salience: angle it spans times the share of it that is seen.
    """

    object_id: str
    category: str
    distance: float
    heading: float
    salience: float


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Sightings and room of every viewpoint; footprints (x0, y0, x1, y1) of every object."""

    house: House
    sightings: dict[str, dict[str, Sighting]]
    rooms: dict[str, Room]
    footprints: dict[str, NDArray[np.float64]]

    def position(self, viewpoint: str) -> NDArray[np.float64]:
        """(x, y) of a viewpoint, metres."""
        graph = self.house.graph
        return graph.positions[graph.row(viewpoint), :2]

    def category(self, object_id: str) -> str:
        return self.house.object(object_id).category

    def gap(self, one: str, other: str) -> float:
        """Metres between the footprints of two objects."""
        return box_gap(self.footprints[one], self.footprints[other])

    def nearest(self, viewpoint: str, category: str) -> float:
        """Metres to the nearest object of a category in sight; infinite where there is none."""
        seen = self.sightings[viewpoint].values()
        return min((s.distance for s in seen if s.category == category), default=np.inf)


def find_landmarks(house: House) -> Landmarks:
    """Look around from every viewpoint of a house, by ray casts to points of every object."""
    footprints = {
        o.id: _footprint(np.concatenate([part.vertices for part in house.parts(o.id)]))
        for o in house.objects
    }
    shares = _visible_shares(house)
    sightings = {
        viewpoint: _sightings(house, footprints, row, shares[row])
        for row, viewpoint in enumerate(house.graph.viewpoints)
    }
    places = house.graph.positions.tolist()
    rooms = {
        viewpoint: nearest_room(house.rooms, x, y)
        for viewpoint, (x, y, _) in zip(house.graph.viewpoints, places, strict=True)
    }
    return Landmarks(house, sightings, rooms, footprints)


def box_distance(point: NDArray[np.float64], box: NDArray[np.float64] | tuple[float, ...]) -> float:
    """Distance along the floor from a point (x, y, …) to a box (x0, y0, x1, y1); 0 inside."""
    return box_gap(np.concatenate([point[:2], point[:2]]), np.asarray(box))


def box_gap(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Distance along the floor between two boxes (x0, y0, x1, y1); 0 where they overlap."""
    return float(
        np.linalg.norm(np.maximum(0, np.maximum(one[:2] - other[2:], other[:2] - one[2:])))
    )


def _footprint(vertices: NDArray[np.float32]) -> NDArray[np.float64]:
    return np.concatenate([vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)]).astype(float)


def _sightings(
    house: House, footprints: dict[str, NDArray[np.float64]], row: int, shares: NDArray[np.float64]
) -> dict[str, Sighting]:
    position, found = house.graph.positions[row], {}
    for thing, share in zip(house.objects, shares, strict=True):
        offset = np.asarray(thing.centre) - position
        angle = float(np.linalg.norm(thing.size) / np.linalg.norm(offset))
        if share >= RECOGNISED and angle >= ANGULAR_SIZE:
            found[thing.id] = Sighting(
                thing.id,
                thing.category,
                box_distance(position, footprints[thing.id]),
                float(heading_of(offset)),
                min(angle, 1.5) * float(share),
            )
    return found


def _visible_shares(house: House) -> NDArray[np.float64]:
    """Share (viewpoints, objects) of each object's surface points whose ray first hits it."""
    if not house.objects:
        return np.zeros((len(house.graph.viewpoints), 0))
    meshes = [_mesh(surface) for surface in house.surfaces]
    targets = {thing.id: row for row, thing in enumerate(house.objects)}
    owners = [targets.get(surface.object_id or "", -1) for surface in house.surfaces]
    owner = np.repeat(owners, [len(mesh.faces) for mesh in meshes])
    scene = RayMeshIntersector(trimesh.util.concatenate(meshes))
    points = np.stack([_points(house, object_id) for object_id in targets])
    shares = np.empty((len(house.graph.viewpoints), len(targets)))
    for row, position in enumerate(house.graph.positions):
        directions = (points - position).reshape(-1, 3)
        hits = scene.intersects_first(np.broadcast_to(position, directions.shape), directions)
        seen = (owner[hits] == np.repeat(np.arange(len(targets)), POINTS)) & (hits >= 0)
        shares[row] = seen.reshape(-1, POINTS).mean(axis=1)
    return shares


def _mesh(surface: Surface) -> trimesh.Trimesh:
    return trimesh.Trimesh(surface.vertices, surface.faces, process=False)


def _points(house: House, object_id: str) -> NDArray[np.float64]:
    mesh = trimesh.util.concatenate([_mesh(part) for part in house.parts(object_id)])
    seed = seeds.integer(0, "landmarks", object_id)
    return np.asarray(trimesh.sample.sample_surface(mesh, POINTS, seed=seed)[0], float)
