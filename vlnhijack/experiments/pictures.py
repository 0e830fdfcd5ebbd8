"""The pictures of an attack: the object before and after, the map, the curves."""

import pandas as pd

from vlnhijack.artifacts import read_rows
from vlnhijack.experiments.attacks import Attack
from vlnhijack.experiments.context import Context
from vlnhijack.navigation.views import panorama_cameras
from vlnhijack.rendering.observe import render_views
from vlnhijack.report.figures import before_after, curve, save_image
from vlnhijack.report.trajectory_map import trajectory_map
from vlnhijack.scenes.house_files import load_house
from vlnhijack.threat import AttackInstance

WIDTH, HEIGHT, SPP = 640, 480, 16
_VIEWS = 3


def illustrate(context: Context, attack: Attack, records: pd.DataFrame) -> None:
    """Write the pictures of an evaluated attack, unless they are there."""
    folder, instance = attack.folder, attack.instance
    if (folder / "map.png").exists():
        return
    house, attacked = context.houses[instance.scan], load_house(attack.house)
    views = _best_views(context, instance)
    position = house.graph.positions[house.graph.row(instance.viewpoint)].tolist()
    cameras = [panorama_cameras(tuple(position), WIDTH, HEIGHT)[view] for view in views]
    seed = context.seed("pictures", instance.id)
    before, after = (render_views(shown, cameras, SPP, seed).numpy() for shown in (house, attacked))
    for name, images in (("before", before), ("after", after)):
        for view, image in zip(views, images, strict=True):
            save_image(folder / "views" / f"{name}_{view:02d}.png", image)
    before_after(
        folder / "before_after.png", list(before), list(after), [f"view {view}" for view in views]
    )
    curve(folder / "curve.png", read_rows(attack.log), read_rows(attack.validations))
    test = records[records["condition"] == "Test"]
    clean, hijacked = (
        [list(path) for path in test.loc[test["arm"] == arm, "path"]]
        for arm in ("clean", "attacked")
    )
    trajectory_map(folder / "map.png", house, instance, clean, hijacked)


def _best_views(context: Context, instance: AttackInstance) -> list[int]:
    """The views at v_ATK that the object fills most, in the order of the panorama."""
    house = context.houses[instance.scan]
    column = [item.id for item in house.objects].index(instance.object_id)
    shares = context.coverage[instance.scan][house.graph.row(instance.viewpoint), :, column]
    return sorted(int(view) for view in shares.argsort()[::-1][:_VIEWS] if shares[view] > 0)
